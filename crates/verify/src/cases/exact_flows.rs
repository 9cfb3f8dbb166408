//! Flows that the elements hold: found exactly, up to the tolerance of the solver.

use gluey_geom::{Aabb, Dim, Space, Vector};
use gluey_stokes::fem::TreeMesh;
use gluey_testkit::exact::{PolynomialFlow, StokesSolution};

use crate::case::{Case, Extent, Tables, Task, VerifyError};
use crate::method::{METHODS, Method};
use crate::norms::errors;
use crate::number::{Kind, Number};
use crate::plot::Plot;
use crate::set_up::{couette, solve};
use crate::statistics::largest;

/// Relative tolerances of the solver.
const TOLERANCES: [f64; 3] = [1e-6, 1e-9, 1e-12];
/// Size of the detour from which the solver starts, in units of the polynomial flow.
const DETOUR: f64 = 10.0;

/// The chapter.
pub const CASE: Case = Case {
    name: "exact-flows",
    title: "Couette and Poiseuille flow",
    text: "u = y - 1/2 and u = y (1 - y), p = -2 x are quadratic and linear: Q2-Q1 elements hold them exactly, on a mesh with \
           hanging nodes too. The solver starts from a wrong field. What is left is its tolerance, by which the residual is \
           smaller than that of the start.",
    keys: &["dimension", "flow", "tolerance"],
    measures: &["velocity", "pressure"],
    tasks,
    numbers,
    plot,
};

/// The flow, its pressure gradient along x.
#[derive(Clone, Copy)]
enum Channel {
    Couette,
    Poiseuille,
}

impl<const D: usize> StokesSolution<D> for Channel {
    fn velocity(&self, x: &Vector<D>) -> Vector<D> {
        match self {
            Self::Couette => couette(x),
            Self::Poiseuille => couette(&Vector::from_fn(|_, _| 0.5 + x[1] * (1.0 - x[1]))),
        }
    }

    fn pressure(&self, x: &Vector<D>) -> f64 {
        match self {
            Self::Couette => 0.0,
            Self::Poiseuille => -2.0 * x[0],
        }
    }

    fn viscosity(&self, _x: &Vector<D>) -> f64 {
        1.0
    }
}

fn tasks(_: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for method in METHODS {
        for (number, channel) in [(0.0, Channel::Couette), (1.0, Channel::Poiseuille)] {
            for tolerance in TOLERANCES {
                let at = |dimension| [dimension, number, tolerance];
                let work = move || measure::<2>(method, channel, tolerance);
                tasks.push(Task::new(method.name, &at(2.0), work));
                let work = move || measure::<3>(method, channel, tolerance);
                tasks.push(Task::new(method.name, &at(3.0), work));
            }
        }
    }
    tasks
}

fn measure<const D: usize>(method: &Method, channel: Channel, tolerance: f64) -> Result<Vec<f64>, VerifyError>
where
    Dim<D>: Space<D>,
    PolynomialFlow: StokesSolution<D>,
{
    let mesh = TreeMesh::refine(Aabb::unit(), [1; D], [false; D], 4, |lower, _, level| {
        level < 3 || lower.iter().all(|&x| x < 0.45)
    })?;
    let detour = |x: &Vector<D>| PolynomialFlow { viscosity: 1.0 }.velocity(x) * DETOUR;
    let flow = solve(method, tolerance, mesh, &[], &|x| channel.velocity(x) + detour(x))?;
    let errors = errors(&flow, &channel, &[]);
    Ok(vec![errors.largest, errors.pressure])
}

fn numbers(tables: &Tables) -> Vec<Number> {
    let table = tables.of(CASE.name);
    let mut numbers = Vec::new();
    for (dimension, (flow, name)) in
        [2.0, 3.0].into_iter().flat_map(|d| [(d, (0.0, "Couette")), (d, (1.0, "Poiseuille"))])
    {
        let at = [("dimension", dimension), ("flow", flow), ("tolerance", TOLERANCES[2])];
        for measure in CASE.measures.iter().take(1 + flow as usize) {
            numbers.extend(METHODS.iter().map(|method| {
                let value = largest(&table.values(measure, method.name, &at));
                Number::new(
                    Kind::Size,
                    format!("{name} flow, {dimension}D, {measure}, tolerance 1e-12"),
                    method.name,
                    value,
                )
            }));
        }
    }
    numbers
}

fn plot(tables: &Tables) -> Plot {
    let table = tables.of(CASE.name);
    Plot::of_methods(
        "tolerance of the solver",
        "largest relative error",
        &["*u* 3D", "*p* 3D"],
        |method, thing| {
            let at = [("dimension", 3.0), ("flow", 1.0)];
            let errors = table.values(CASE.measures[thing], method, &at);
            table.values("tolerance", method, &at).into_iter().zip(errors).collect()
        },
    )
}
