//! Flows that the elements hold: found exactly, up to the tolerance of the solver.

use gluey_geom::{Aabb, Vector};
use gluey_stokes::fem::TreeMesh;
use gluey_testkit::exact::{PolynomialFlow, StokesSolution};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{METHODS, Method};
use crate::norms::errors;
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{couette, solve};
use crate::statistics::largest;

/// Relative tolerances of the solver.
const TOLERANCES: [f64; 3] = [1e-6, 1e-9, 1e-12];
/// Size of the detour from which the solver starts, in units of the polynomial flow.
const DETOUR: f64 = 10.0;

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "exact-flows",
    title: "Couette and Poiseuille flow",
    text: "u = y - 1/2 and u = y (1 - y), p = -2 x are quadratic and linear: Q2-Q1 elements hold them exactly, on a mesh with \
           hanging nodes too. The solver starts from a wrong field. What is left is its tolerance, by which the residual is \
           smaller than that of the start.",
    keys: &["dimension", "flow", "tolerance"],
    measures: &["velocity", "pressure"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
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
    let channels = [Channel::Couette, Channel::Poiseuille];
    let places = iproduct!(METHODS, channels, TOLERANCES, [measure::<2> as ChannelMeasure, measure::<3>]);
    let dimensions = [2.0, 3.0].into_iter().cycle();
    let task = |((method, channel, tolerance, measure), dimension): (
        (&'static Method, _, _, ChannelMeasure),
        f64,
    )| {
        let at = [dimension, f64::from(channel as u8), tolerance];
        Task::new(method.name, &at, move || measure(method, channel, tolerance))
    };
    places.zip(dimensions).map(task).collect()
}

type ChannelMeasure = fn(&Method, Channel, f64) -> Result<Vec<f64>, VerifyError>;

fn measure<const D: usize>(method: &Method, channel: Channel, tolerance: f64) -> Result<Vec<f64>, VerifyError>
where
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

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (dimension, (flow, name)) in iproduct!([2.0, 3.0], [(0.0, "Couette"), (1.0, "Poiseuille")]) {
        let at = [("dimension", dimension), ("flow", flow), ("tolerance", TOLERANCES[2])];
        for (measure, method) in iproduct!(&CASE.measures[..1 + flow as usize], METHODS) {
            let what = format!("{name} flow, {dimension}D, {measure}, tolerance 1e-12");
            let value = largest(&table.values(measure, method.name, &at));
            numbers.push(Number::new(NumberKind::Size, what, method.name, value));
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let (x, y) = ("tolerance of the solver", "largest relative error");
    Plot::of_methods(x, y, &["*u* 3D", "*p* 3D"], |method, thing| {
        let at = [("dimension", 3.0), ("flow", 1.0)];
        let errors = table.values(CASE.measures[thing], method, &at);
        table.values("tolerance", method, &at).into_iter().zip(errors).collect()
    })
}
