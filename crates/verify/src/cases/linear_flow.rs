//! One disc or sphere in a linear flow, with the exact velocity on a box around it.

use gluey_geom::{Dim, Matrix, Spin};
use gluey_levelset::Ball;
use gluey_testkit::convergence_order;
use gluey_testkit::exact::{InclusionViscosity, StokesSolution};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{METHODS, Method};
use crate::norms::errors;
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{around_one_body, disc_in_linear_flow, shift, solve, sphere_in_linear_flow, uniform};
use crate::statistics::over_positions;

const KEYS: &[&str] = &["a/h", "position"];
const MEASURES: &[&str] = &["velocity", "spin", "stresslet", "field", "field, largest", "pressure"];
/// Cells per radius, and positions of the lattice.
type Meshes = &'static [(f64, usize)];

/// The chapter of the disc.
pub const DISC: VerificationCase = VerificationCase {
    name: "disc-in-linear-flow",
    title: "A disc in a linear flow, exact data on a box",
    text: "A free disc of radius one in the flow of Schmid and Podladchikov (2003) for a rigid inclusion, whose velocity is given \
           on the sides of a box of half-width 2.5 radii (less the net flux of its interpolation): no error but that of the \
           method. Rigid velocity and spin (rms over positions), stresslet (mean; exact 4 pi mu a^2 E), velocity and pressure in \
           the fluid (relative, mean square; largest at a node).",
    keys: KEYS,
    measures: MEASURES,
    tasks: |extent| tasks(disc, disc_meshes(extent)),
    numbers: |tables| numbers(&tables.of(DISC.name)),
    plot: |tables| plot(&tables.of(DISC.name)),
};

/// The chapter of the sphere.
pub const SPHERE: VerificationCase = VerificationCase {
    name: "sphere-in-linear-flow",
    title: "A sphere in a linear flow, exact data on a box",
    text: "The same for a free sphere in a general linear flow (Batchelor 1967, section 4.11; Kim and Karrila 1991, section 3.3); \
           stresslet exact 20/3 pi mu a^3 E (Einstein).",
    keys: KEYS,
    measures: MEASURES,
    tasks: |extent| tasks(sphere, sphere_meshes(extent)),
    numbers: |tables| numbers(&tables.of(SPHERE.name)),
    plot: |tables| plot(&tables.of(SPHERE.name)),
};

fn disc_meshes(extent: Extent) -> Meshes {
    extent.pick(&[(3.2, 8), (6.4, 8), (12.8, 4)], &[(3.2, 8), (6.4, 8), (12.8, 4), (25.6, 2)])
}

fn sphere_meshes(extent: Extent) -> Meshes {
    extent.pick(&[(1.6, 8), (3.2, 2)], &[(1.6, 16), (3.2, 4), (4.8, 1)])
}

type FlowMeasure = fn(&'static Method, f64, usize) -> Result<Vec<f64>, VerifyError>;

fn tasks(measure: FlowMeasure, meshes: Meshes) -> Vec<Task> {
    let of_mesh = |(method, &(cells, count)): (&'static Method, &(f64, usize))| {
        let task = move |k| Task::new(method.name, &[cells, k as f64], move || measure(method, cells, k));
        (0..count).map(task)
    };
    iproduct!(METHODS, meshes).flat_map(of_mesh).collect()
}

fn disc(method: &'static Method, cells: f64, position: usize) -> Result<Vec<f64>, VerifyError> {
    let (exact, strain) = disc_in_linear_flow(shift::<2>(position) / cells, InclusionViscosity::Rigid);
    let far = Far { strain, spin: Spin::<2>::new(exact.spin) };
    measure(method, cells, &exact, Ball::new(exact.center, 1.0), far)
}

fn sphere(method: &'static Method, cells: f64, position: usize) -> Result<Vec<f64>, VerifyError> {
    let exact = sphere_in_linear_flow(shift::<3>(position) / cells);
    let far = Far { strain: exact.strain, spin: exact.spin };
    measure(method, cells, &exact, Ball::new(exact.center, 1.0), far)
}

/// The flow far away.
struct Far<const D: usize> {
    strain: Matrix<D>,
    spin: Spin<D>,
}

fn measure<const D: usize>(
    method: &Method,
    cells: f64,
    exact: &impl StokesSolution<D>,
    ball: Ball<D>,
    far: Far<D>,
) -> Result<Vec<f64>, VerifyError> {
    let lattice = around_one_body::<D>(cells);
    let boundary = lattice.without_net_flux(|x| exact.velocity(x));
    let flow = solve(method, 1e-9, uniform(&lattice)?, &[ball], &boundary)?;
    let twist = flow.twists[0];
    let turned = twist.spin - far.spin;
    let turned = Dim::<D>::spin_slice(&turned).iter().map(|w| w * w).sum::<f64>().sqrt();
    let of_strain = if D == 2 { 4.0 } else { 20.0 / 3.0 } * std::f64::consts::PI * far.strain.norm_squared();
    let stresslet = lattice.stresslet(&flow, &boundary, &far.strain) / of_strain - 1.0;
    let errors = errors(&flow, exact, &[ball]);
    Ok(vec![
        twist.velocity.norm(),
        turned,
        stresslet,
        errors.velocity,
        errors.largest,
        errors.pressure / errors.pressure_scale,
    ])
}

/// The statistic of a measure over positions.
fn statistic(table: &CaseTable, method: &str, measure: &str, cells: f64) -> f64 {
    over_positions(measure, &table.values(measure, method, &[("a/h", cells)]))
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (&measure, method) in iproduct!(MEASURES, METHODS) {
        let kind = if measure == "stresslet" { NumberKind::Error } else { NumberKind::Size };
        let (mut sizes, mut magnitudes) = (Vec::new(), Vec::new());
        for cells in table.steps("a/h", method.name, &[]) {
            let value = statistic(table, method.name, measure, cells);
            numbers.push(Number::new(kind, format!("{measure}, a/h = {cells}"), method.name, value));
            sizes.push(1.0 / cells);
            magnitudes.push(value.abs());
        }
        let value = convergence_order(&sizes, &magnitudes);
        numbers.push(Number::new(NumberKind::Order, format!("{measure}, order"), method.name, value));
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["velocity", "spin", "stresslet", "field"];
    Plot::of_methods("cells per radius *a*/*h*", "error", &things, |method, thing| {
        let point = |cells: f64| (cells, statistic(table, method, things[thing], cells).abs());
        table.steps("a/h", method, &[]).into_iter().map(point).collect()
    })
}
