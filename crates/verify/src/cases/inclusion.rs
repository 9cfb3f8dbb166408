//! A disc or sphere of another viscosity in a linear flow, with the exact velocity on a box around it.

use gluey_geom::Matrix;
use gluey_levelset::Ball;
use gluey_stokes::{FlowParams, FlowSolver, Formulation, PaperParams};
use gluey_testkit::convergence_order;
use gluey_testkit::exact::{InclusionViscosity, StokesSolution, ViscousSphere};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::norms::errors;
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{around_one_body, disc_in_linear_flow, shift, sphere_in_linear_flow, uniform};
use crate::statistics::over_positions;

/// Viscosity inside over that around it.
const RATIOS: [f64; 3] = [2.0, 10.0, 100.0];
const METHOD: &str = "paper";

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "inclusion",
    title: "A viscous inclusion",
    text: "A disc and a sphere of 2, 10 and 100 times the viscosity of the fluid around them in a linear flow, whose exact velocity is \
           given on the sides of a box of half-width 2.5 radii: Schmid and Podladchikov 2003, 10.1046/j.1365-246X.2003.02042.x, for a \
           disc; Eshelby 1957, 10.1098/rspa.1957.0133, for a sphere, inside which the strain is 5 / (2 r + 3) of that far away. Only \
           `paper` has a viscosity inside bodies (here without multiplier, one solve); elsewhere they are rigid. Relative \
           errors of the velocity in fluid and body (mean square) and of the stresslet (mean over positions).",
    keys: &["dimension", "a/h", "ratio", "position"],
    measures: &["velocity", "stresslet"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

/// Cells per radius and positions, in 2D and 3D.
fn meshes(extent: Extent) -> [&'static [(f64, usize)]; 2] {
    extent.pick(
        [&[(3.2, 4), (6.4, 4)], &[(1.6, 1)]],
        [&[(3.2, 8), (6.4, 8), (12.8, 4), (25.6, 2)], &[(1.6, 4), (3.2, 2)]],
    )
}

fn tasks(extent: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (dimension, meshes) in [2, 3].into_iter().zip(meshes(extent)) {
        for (&(cells, count), ratio) in iproduct!(meshes, RATIOS) {
            let measure = if dimension == 2 { disc } else { sphere };
            tasks.extend((0..count).map(|k| {
                let at = [f64::from(dimension), cells, ratio, k as f64];
                Task::new(METHOD, &at, move || measure(cells, ratio, k))
            }));
        }
    }
    tasks
}

fn disc(cells: f64, ratio: f64, position: usize) -> Result<Vec<f64>, VerifyError> {
    let viscosity = InclusionViscosity::Finite(ratio);
    let (exact, strain) = disc_in_linear_flow(shift::<2>(position) / cells, viscosity);
    let stresslet = 4.0 * (ratio - 1.0) / (ratio + 1.0);
    measure(cells, ratio, &exact, Ball::new(exact.center, 1.0), strain, stresslet)
}

fn sphere(cells: f64, ratio: f64, position: usize) -> Result<Vec<f64>, VerifyError> {
    let rigid = sphere_in_linear_flow(shift::<3>(position) / cells);
    let exact = ViscousSphere { rigid, ratio };
    let stresslet = 20.0 / 3.0 * exact.share();
    measure(cells, ratio, &exact, Ball::new(rigid.center, 1.0), rigid.strain, stresslet)
}

/// Errors of the velocity and of the stresslet, which is this many `pi mu a^D` times the strain.
fn measure<const D: usize>(
    cells: f64,
    ratio: f64,
    exact: &impl StokesSolution<D>,
    ball: Ball<D>,
    strain: Matrix<D>,
    stresslet: f64,
) -> Result<Vec<f64>, VerifyError> {
    let lattice = around_one_body::<D>(cells);
    let boundary = lattice.without_net_flux(|x| exact.velocity(x));
    let params = PaperParams { viscosity_ratio: ratio, uzawa_steps: 1, ..PaperParams::default() };
    let params = FlowParams {
        formulation: Formulation::Paper(params),
        tolerance: 1e-9,
        ..FlowParams::for_dimension(D)
    };
    let flow = FlowSolver::new(params)?.solve(uniform(&lattice)?, &[ball], &boundary)?;
    let of_strain = stresslet * std::f64::consts::PI * strain.norm_squared();
    let found = lattice.stresslet(&flow, &boundary, &strain);
    Ok(vec![errors(&flow, exact, &[]).velocity, found / of_strain - 1.0])
}

/// The mean square of the errors of velocities, the mean of those of stresslets.
fn statistic(table: &CaseTable, measure: &str, at: &[(&str, f64)]) -> f64 {
    over_positions(measure, &table.values(measure, METHOD, at))
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (dimension, ratio) in iproduct!([2.0, 3.0], RATIOS) {
        let at = [("dimension", dimension), ("ratio", ratio)];
        let computed = table.steps("a/h", METHOD, &at);
        for &measure in CASE.measures {
            let kind = if measure == "stresslet" { NumberKind::Error } else { NumberKind::Size };
            let of = |cells: f64| statistic(table, measure, &[&at[..], &[("a/h", cells)]].concat());
            let name = format!("{measure}, {dimension}D, {ratio} times");
            for &cells in &computed {
                numbers.push(Number::new(kind, format!("{name}, a/h = {cells}"), METHOD, of(cells)));
            }
            if measure == "velocity" && computed.len() > 1 {
                let sizes: Vec<f64> = computed.iter().map(|cells| 1.0 / cells).collect();
                let magnitudes: Vec<f64> = computed.iter().map(|&cells| of(cells)).collect();
                let order = convergence_order(&sizes, &magnitudes);
                numbers.push(Number::new(NumberKind::Order, format!("{name}, order"), METHOD, order));
            }
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["2D, 2 times", "2D, 100 times", "3D, 2 times", "3D, 100 times"];
    Plot::of_methods("cells per radius *a*/*h*", "error of the velocity", &things, |method, thing| {
        if method != METHOD {
            return Vec::new();
        }
        let at = [("dimension", (2 + thing / 2) as f64), ("ratio", if thing % 2 == 0 { 2.0 } else { 100.0 })];
        let point = |cells| (cells, statistic(table, "velocity", &[&at[..], &[("a/h", cells)]].concat()));
        table.steps("a/h", method, &at).into_iter().map(point).collect()
    })
}
