//! The contact model.

use std::sync::{Mutex, MutexGuard, PoisonError};

use gluey_contact::{
    Contact, ContactModel, ContactParams, ContactReport, ContactState, Domain, GammaUpdate, PairKey,
    PairState, Partner, StepGeometry, Wall, WithFixed,
};
use gluey_geom::{Lattice, Twist};
use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;

use crate::arrays::{FloatArray, Numbers, array, of_vectors, vectors};
use crate::errors::plain;
use crate::pool::compute;

/// The outcome of a correction: velocities, contacts and a report.
type Corrected<'py> = (Bound<'py, PyAny>, Bound<'py, PyDict>, Bound<'py, PyDict>);

/// The contact model in a dimension.
#[pyclass(frozen, module = "gluey._gluey")]
pub struct PairContact {
    model: Mutex<Model>,
}

enum Model {
    Plane(gluey_contact::PairContact<2, WithFixed>),
    Space(gluey_contact::PairContact<3, WithFixed>),
}

/// Parameters and surroundings; a dictionary with these keys.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Parameters<'py> {
    law: String,
    exact_gap: bool,
    memory: String,
    gamma_min: Option<f64>,
    threshold: f64,
    solver: String,
    tolerance: f64,
    iteration_limit: usize,
    fixed: Vec<usize>,
    periods: Vec<Option<f64>>,
    /// Unit vectors into the fluid.
    wall_normals: Numbers<'py>,
    wall_offsets: FloatArray<'py>,
}

/// A step; a dictionary with these keys.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct StepArguments<'py> {
    positions: Numbers<'py>,
    radii: FloatArray<'py>,
    velocities: Numbers<'py>,
    drift: Numbers<'py>,
    dt: f64,
    velocity_weight: f64,
    sliding: (f64, f64),
}

/// Contacts or memory; a dictionary with these keys.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct MemoryArrays<'py> {
    first: PyReadonlyArray1<'py, i64>,
    second: PyReadonlyArray1<'py, i64>,
    wall: PyReadonlyArray1<'py, i64>,
    image: numpy::PyReadonlyArray2<'py, i64>,
    force: FloatArray<'py>,
    gamma: FloatArray<'py>,
}

#[pymethods]
impl PairContact {
    #[new]
    fn new(dimension: usize, parameters: Parameters<'_>) -> PyResult<Self> {
        let model = match dimension {
            2 => Model::Plane(model(&parameters)?),
            _ => Model::Space(model(&parameters)?),
        };
        Ok(Self { model: Mutex::new(model) })
    }

    /// Corrects the velocities of a step.
    fn correct<'py>(&self, py: Python<'py>, step: StepArguments<'py>) -> PyResult<Corrected<'py>> {
        let mut model = self.lock(py);
        match &mut *model {
            Model::Plane(model) => correct(py, model, &step),
            Model::Space(model) => correct(py, model, &step),
        }
    }

    /// What the next step depends on.
    fn memory<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let pairs = match &*self.lock(py) {
            Model::Plane(model) => model.checkpoint().pairs,
            Model::Space(model) => model.checkpoint().pairs,
        };
        let entry = |state: &PairState| (state.pair, state.lambda, state.gamma);
        arrays(py, pairs.iter().map(entry).collect())
    }

    /// Goes on from what [`Self::memory`] gave.
    fn set_memory(&self, py: Python<'_>, memory: MemoryArrays<'_>) -> PyResult<()> {
        let state = memory.state()?;
        let set = match &mut *self.lock(py) {
            Model::Plane(model) => model.resume(state),
            Model::Space(model) => model.resume(state),
        };
        set.map_err(|error| plain(py, "ContactError", &error))
    }

    /// Tells that the flow was reversed.
    fn reverse(&self, py: Python<'_>) {
        match &mut *self.lock(py) {
            Model::Plane(model) => model.reverse(),
            Model::Space(model) => model.reverse(),
        }
    }
}

impl PairContact {
    /// Waits without the interpreter, which the thread that has the model may need.
    fn lock(&self, py: Python<'_>) -> MutexGuard<'_, Model> {
        self.model.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }
}

fn model<const D: usize>(parameters: &Parameters<'_>) -> PyResult<gluey_contact::PairContact<D, WithFixed>> {
    let value_error = |error: String| PyValueError::new_err(error);
    let params = ContactParams {
        law: parameters
            .law
            .parse()
            .map_err(|error: gluey_contact::UnknownName| value_error(error.to_string()))?,
        exact_gap: parameters.exact_gap,
        gamma_update: match parameters.memory.as_str() {
            "paper" => GammaUpdate::Paper,
            "consistent" => GammaUpdate::Consistent,
            other => {
                return Err(value_error(format!(
                    "unknown memory `{other}`: expected `consistent` or `paper`"
                )));
            }
        },
        gamma_min: parameters.gamma_min,
        threshold: parameters.threshold,
        solver: parameters
            .solver
            .parse()
            .map_err(|error: gluey_contact::UnknownName| value_error(error.to_string()))?,
        tolerance: parameters.tolerance,
        iteration_limit: parameters.iteration_limit,
        ..ContactParams::default()
    };
    let normals = vectors::<D>(&parameters.wall_normals)?;
    let walls = normals.into_iter().zip(parameters.wall_offsets.as_slice()?);
    let domain = Domain {
        walls: walls.map(|(normal, &offset)| Wall { normal, offset, speed: 0.0 }).collect(),
        lattice: Lattice::new(std::array::from_fn(|d| parameters.periods.get(d).copied().flatten())),
        ..Domain::default()
    };
    let mobility = WithFixed::new(parameters.fixed.iter().copied());
    Ok(gluey_contact::PairContact::with_mobility(params, mobility).within(domain))
}

fn correct<'py, const D: usize>(
    py: Python<'py>,
    model: &mut gluey_contact::PairContact<D, WithFixed>,
    step: &StepArguments<'py>,
) -> PyResult<Corrected<'py>> {
    let (positions, drift) = (vectors::<D>(&step.positions)?, vectors::<D>(&step.drift)?);
    let radii = step.radii.as_slice()?;
    let velocities = vectors::<D>(&step.velocities)?;
    let mut twists: Vec<_> =
        velocities.iter().map(|&velocity| Twist { velocity, ..Twist::default() }).collect();
    let geometry = StepGeometry {
        positions: &positions,
        radii,
        drift: &drift,
        velocity_weight: step.velocity_weight,
        dt: step.dt,
    };
    model.set_sliding(step.sliding.0, step.sliding.1);
    let report = compute(py, None, || model.correct(&geometry, &mut twists))?;
    let report = report.map_err(|error| plain(py, "ContactError", &error))?;
    let entry = |contact: &Contact| (contact.pair, contact.lambda, contact.gamma);
    let contacts = arrays(py, model.contacts().iter().map(entry).collect())?;
    let gaps: Vec<f64> = model.contacts().iter().map(|contact| contact.gap).collect();
    let count = gaps.len();
    contacts.set_item("gap", array(py, gaps, [count])?)?;
    let velocities = of_vectors(py, twists.iter().map(|twist| twist.velocity))?;
    Ok((velocities, contacts, of_report(py, &report)?))
}

fn of_report<'py>(py: Python<'py>, report: &ContactReport) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("iterations", report.iterations)?;
    told.set_item("passes", report.passes)?;
    told.set_item("residual", report.residual)?;
    told.set_item("pairs", report.pair_count)?;
    told.set_item("active", report.active_count)?;
    told.set_item("smallest_gap", report.worst.map(|worst| worst.gap))?;
    Ok(told)
}

/// Pairs with their forces and memories as arrays. Particles and walls count from 0; -1 is none.
fn arrays<'py>(py: Python<'py>, pairs: Vec<(PairKey, f64, f64)>) -> PyResult<Bound<'py, PyDict>> {
    let count = pairs.len();
    let ints = |number: &dyn Fn(&PairKey) -> i64| {
        array(py, pairs.iter().map(|(key, ..)| number(key)).collect(), [count])
    };
    let dict = PyDict::new(py);
    dict.set_item("first", ints(&|key| i64::from(key.first))?)?;
    dict.set_item("second", ints(&|key| key.particles().1.map_or(-1, |second| second as i64))?)?;
    let wall = |key: &PairKey| match key.second {
        Partner::Wall(wall) => i64::from(wall),
        Partner::Particle { .. } => -1,
    };
    dict.set_item("wall", ints(&wall)?)?;
    let image = |key: &PairKey| match key.second {
        Partner::Particle { image, .. } => image.map(i64::from),
        Partner::Wall(_) => [0; 3],
    };
    dict.set_item("image", array(py, pairs.iter().flat_map(|(key, ..)| image(key)).collect(), [count, 3])?)?;
    dict.set_item("force", array(py, pairs.iter().map(|(_, force, _)| *force).collect(), [count])?)?;
    dict.set_item("gamma", array(py, pairs.iter().map(|(.., gamma)| *gamma).collect(), [count])?)?;
    Ok(dict)
}

impl MemoryArrays<'_> {
    fn state(&self) -> PyResult<ContactState> {
        let (first, second) = (self.first.as_slice()?, self.second.as_slice()?);
        let (wall, image) = (self.wall.as_slice()?, self.image.as_slice()?);
        let (force, gamma) = (self.force.as_slice()?, self.gamma.as_slice()?);
        let lengths = [second.len(), wall.len(), image.len() / 3, force.len(), gamma.len()];
        if lengths.iter().any(|length| *length != first.len()) {
            return Err(PyValueError::new_err("the arrays of a memory must be equally long"));
        }
        let pair = |k: usize| -> PyResult<PairState> {
            let bad = || PyValueError::new_err(format!("pair {k} of the memory: indices must be 0 or more"));
            let index = |number: i64| usize::try_from(number).map_err(|_| bad());
            let count = |number: i64| i32::try_from(number).map_err(|_| bad());
            let key = match wall[k] {
                -1 => {
                    let image = [count(image[3 * k])?, count(image[3 * k + 1])?, count(image[3 * k + 2])?];
                    PairKey::across(index(first[k])?, index(second[k])?, image)
                }
                wall => PairKey::wall(index(first[k])?, index(wall)?),
            };
            Ok(PairState { pair: key, gamma: gamma[k], lambda: force[k] })
        };
        Ok(ContactState {
            pairs: (0..first.len()).map(pair).collect::<PyResult<_>>()?,
            ..ContactState::default()
        })
    }
}
