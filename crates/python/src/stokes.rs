//! Stokes flow around particles at given places.

use std::sync::{Mutex, PoisonError};

use gluey::flow::prepared_flow;
use gluey::{RunError, memory};
use gluey_geom::{Matrix, Twist, Vector, Wrench};
use gluey_stokes::motion::LinearFlow;
use gluey_stokes::{Conditions, Flow, Prepared, StokesError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;

use crate::arrays::{Numbers, array, of_matrices, of_spins, of_vectors, spins, vectors};
use crate::case::Case;
use crate::errors::{of_run, plain};
use crate::pool::compute;

/// The flows around the particles of a case.
#[pyclass(frozen, module = "gluey._gluey")]
pub struct Stokes {
    threads: Option<usize>,
    flows: Mutex<Flows>,
}

enum Flows {
    Plane(Around<2>),
    Space(Around<3>),
}

/// Flows around particles in a box, in which the undisturbed velocity is that of a shear about its middle.
struct Around<const D: usize> {
    prepared: Prepared<'static, D>,
    middle: f64,
}

/// The drive of a flow; a dictionary with these keys, without `hold` for free particles.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct FlowDrive<'py> {
    /// Whether velocities and spins are given, and not forces and torques.
    hold: bool,
    vectors: Numbers<'py>,
    spins: Numbers<'py>,
    shear_rate: f64,
}

#[pymethods]
impl Stokes {
    #[new]
    fn new(py: Python<'_>, case: &Case, threads: Option<usize>) -> PyResult<Self> {
        let case = case.inner();
        let middle = 0.5 * (case.lower()[1] + case.upper()[1]);
        let flows = compute(py, threads, || -> Result<Flows, RunError> {
            memory::check_within(case, None)?;
            let failed = |error: gluey::FlowError| RunError::Flow(error.into());
            Ok(match case.dimension {
                2 => Flows::Plane(Around { prepared: prepared_flow(case).map_err(failed)?, middle }),
                _ => Flows::Space(Around { prepared: prepared_flow(case).map_err(failed)?, middle }),
            })
        })?;
        Ok(Self { threads, flows: Mutex::new(flows.map_err(|error| of_run(py, &error))?) })
    }

    /// The flow under some conditions.
    fn solve<'py>(&self, py: Python<'py>, drive: FlowDrive<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut flows = self.flows.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner);
        match &mut *flows {
            Flows::Plane(around) => around.solve(py, self.threads, &drive),
            Flows::Space(around) => around.solve(py, self.threads, &drive),
        }
    }

    /// The mobility matrix, or the resistance matrix.
    fn matrix<'py>(&self, py: Python<'py>, resistance: bool) -> PyResult<Bound<'py, PyAny>> {
        let mut flows = self.flows.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner);
        match &mut *flows {
            Flows::Plane(around) => around.matrix(py, self.threads, resistance),
            Flows::Space(around) => around.matrix(py, self.threads, resistance),
        }
    }
}

impl<const D: usize> Around<D> {
    fn solve<'py>(
        &mut self,
        py: Python<'py>,
        threads: Option<usize>,
        drive: &FlowDrive<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (vectors, spins) = (vectors::<D>(&drive.vectors)?, spins::<D>(&drive.spins)?);
        if vectors.len() != spins.len() {
            return Err(PyValueError::new_err(format!(
                "{} vectors and {} spins",
                vectors.len(),
                spins.len()
            )));
        }
        let both = || vectors.iter().copied().zip(spins.iter().copied());
        let wrenches: Vec<_> = both().map(|(force, torque)| Wrench::<D> { force, torque }).collect();
        let twists: Vec<_> = both().map(|(velocity, spin)| Twist::<D> { velocity, spin }).collect();
        let (hold, rate, middle) = (drive.hold, drive.shear_rate, self.middle);
        let undisturbed = LinearFlow::<D>::shear(rate, middle);
        let shear = move |x: &Vector<D>| undisturbed.velocity(x);
        let prepared = &mut self.prepared;
        let solved = compute(py, threads, || {
            let conditions = Conditions::boundary(&shear);
            let conditions = match hold {
                true => conditions.with_twists(&twists),
                false => conditions.with_wrenches(&wrenches),
            };
            let flow = prepared.solve(&conditions)?;
            let moments = moments(prepared, &flow)?;
            Ok((flow, moments))
        })?;
        let (flow, moments) = solved.map_err(|error: StokesError| plain(py, "StokesError", &error))?;
        of_flow(py, &flow, moments)
    }

    fn matrix<'py>(
        &mut self,
        py: Python<'py>,
        threads: Option<usize>,
        resistance: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let prepared = &mut self.prepared;
        let matrix =
            compute(py, threads, || if resistance { prepared.resistance() } else { prepared.mobility() })?;
        let matrix = matrix.map_err(|error| plain(py, "StokesError", &error))?;
        let shape = [matrix.nrows(), matrix.ncols()];
        array(py, matrix.transpose().as_slice().to_vec(), shape)
    }
}

/// The stresslets of the bodies with what films add, and the share of films; nothing in a formulation that
/// has none.
type BodyMoments<const D: usize> = Option<[Vec<Matrix<D>>; 2]>;

fn moments<const D: usize>(
    prepared: &Prepared<'_, D>,
    flow: &Flow<D>,
) -> Result<BodyMoments<D>, StokesError> {
    let of_mesh = match prepared.stresslets(flow) {
        Ok(stresslets) => stresslets,
        Err(StokesError::Unsupported { .. }) => return Ok(None),
        Err(error) => return Err(error),
    };
    let of_films = prepared.film_stresslets(flow);
    let sums = of_mesh.iter().zip(&of_films).map(|(mesh, films)| mesh + films).collect();
    Ok(Some([sums, of_films]))
}

fn of_flow<'py, const D: usize>(
    py: Python<'py>,
    flow: &Flow<D>,
    moments: BodyMoments<D>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("velocities", of_vectors(py, flow.twists.iter().map(|twist| twist.velocity))?)?;
    dict.set_item("spins", of_spins::<D>(py, flow.twists.iter().map(|twist| twist.spin))?)?;
    dict.set_item("forces", of_vectors(py, flow.wrenches.iter().map(|wrench| wrench.force))?)?;
    dict.set_item("torques", of_spins::<D>(py, flow.wrenches.iter().map(|wrench| wrench.torque))?)?;
    let of_moments = |k: usize| moments.as_ref().map(|moments| of_matrices(py, &moments[k])).transpose();
    dict.set_item("stresslets", of_moments(0)?)?;
    dict.set_item("film_stresslets", of_moments(1)?)?;
    dict.set_item("cells", flow.discretisation.mesh.cell_count())?;
    dict.set_item("unknowns", flow.discretisation.dof_count())?;
    dict.set_item("iterations", flow.iteration_count)?;
    Ok(dict)
}
