//! A disc that is moved or turned near a plane wall.

use std::f64::consts::PI;

use gluey_geom::{Spin, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Refinement};

use crate::case::{Case, Extent, Tables, Task, VerifyError};
use crate::method::{FILM_METHODS, Method};
use crate::number::{Kind, Number};
use crate::plot::Plot;
use crate::set_up::{level, mean_and_scatter, mesh, shift};
use crate::statistics::{largest, rms};

/// So small that the other walls are 160 radii away or more.
const RADIUS: f64 = 0.003125;

/// Distances of the centre from the wall in radii are `cosh(alpha)`.
const ALPHAS: [f64; 4] = [1.0, 0.5, 0.3, 0.1];

/// The chapter.
pub const CASE: Case = Case {
    name: "disc-wall",
    title: "A disc near a wall",
    text: "A disc of radius 0.003125 near a wall of the unit box at rest, held at a velocity across or along the wall or at a spin, at \
           gaps of 0.54, 0.13, 0.045 and 0.005 radii and several places along the wall: relative errors of force and torque, which are \
           4 pi mu U / (alpha - tanh alpha), 4 pi mu U / alpha and 4 pi mu a^2 w coth alpha with the distance a cosh alpha of the centre \
           (Jeffrey and Onishi 1981, 10.1093/qjmam/34.2.129). A disc that is moved along has no torque and one that turns no force: \
           what they have, over 4 pi mu a. The other walls are 160 radii away.",
    keys: &["a/h", "gap", "position"],
    measures: &["force across", "force along", "torque", "coupling"],
    tasks,
    numbers,
    plot,
};

/// Force across, force along and torque over `4 pi mu U` and `4 pi mu a^2 w`.
fn exact(alpha: f64) -> [f64; 3] {
    [1.0 / (alpha - alpha.tanh()), 1.0 / alpha, 1.0 / alpha.tanh()]
}

fn gap(alpha: f64) -> f64 {
    alpha.cosh() - 1.0
}

/// Cells per radius, and places along the wall.
fn meshes(extent: Extent) -> &'static [(f64, usize)] {
    match extent {
        Extent::Quick => &[(3.2, 4), (6.4, 2)],
        Extent::Full => &[(3.2, 8), (6.4, 4), (12.8, 4)],
    }
}

fn methods() -> impl Iterator<Item = &'static Method> {
    FILM_METHODS.iter().filter(|method| method.holds_bodies)
}

/// The thinnest film, which no mesh here resolves, is asked only of what lubricates.
fn alphas(method: &Method) -> &'static [f64] {
    if method.lubricates { &ALPHAS } else { &ALPHAS[..ALPHAS.len() - 1] }
}

fn tasks(extent: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for method in methods() {
        for &(cells, count) in meshes(extent) {
            for &alpha in alphas(method) {
                tasks.extend((0..count).map(|k| {
                    let at = [cells, gap(alpha), k as f64];
                    Task::new(method.name, &at, move || measure(method, cells, alpha, k))
                }));
            }
        }
    }
    tasks
}

fn measure(method: &Method, cells: f64, alpha: f64, position: usize) -> Result<Vec<f64>, VerifyError> {
    let mut center = Vector::<2>::repeat(0.5) + shift::<2>(position) * (RADIUS / cells);
    center[1] = alpha.cosh() * RADIUS;
    let disc = [Ball::new(center, RADIUS)];
    let mesh = mesh(&Refinement::to_level(level(RADIUS, cells)), &disc)?;
    let mut solver = FlowSolver::new(method.params::<2>(1e-9))?;
    let mut prepared = solver.prepared(mesh, &disc)?;
    let mut held = |x: f64, y: f64, spin: f64| -> Result<Wrench<2>, VerifyError> {
        let twist = Twist { velocity: Vector::<2>::new(x, y), spin: Spin::<2>::new(spin) };
        Ok(prepared.solve(&Conditions::at_rest().with_twists(&[twist]))?.wrenches[0])
    };
    let (across, along, turned) = (held(0.0, 1.0, 0.0)?, held(1.0, 0.0, 0.0)?, held(0.0, 0.0, 1.0)?);
    let exact = exact(alpha).map(|resistance| 4.0 * PI * resistance);
    let coupling = along.torque[0].abs().max(turned.force[0].abs());
    Ok(vec![
        across.force[1] / exact[0] - 1.0,
        along.force[0] / exact[1] - 1.0,
        turned.torque[0] / (exact[2] * RADIUS * RADIUS) - 1.0,
        coupling / (4.0 * PI * RADIUS),
    ])
}

fn numbers(tables: &Tables) -> Vec<Number> {
    let table = tables.of(CASE.name);
    let mut numbers = Vec::new();
    for method in methods() {
        for cells in table.steps("a/h", method.name, &[]) {
            for gap in alphas(method).iter().map(|&alpha| gap(alpha)) {
                let at = [("a/h", cells), ("gap", gap)];
                for measure in &CASE.measures[..3] {
                    let name = format!("{measure}, a/h = {cells}, gap {gap:.3} a");
                    numbers.extend(mean_and_scatter(&table, method.name, measure, &at, &name));
                }
                let coupling = largest(&table.values("coupling", method.name, &at));
                let name = format!("coupling, a/h = {cells}, gap {gap:.3} a");
                numbers.push(Number::new(Kind::Size, name, method.name, coupling));
            }
        }
    }
    numbers
}

fn plot(tables: &Tables) -> Plot {
    let table = tables.of(CASE.name);
    let things = &CASE.measures[..3];
    Plot::of_methods("gap in radii", "rms relative error, *a*/*h* = 6.4", things, |method, thing| {
        let at = |gap| [("a/h", 6.4), ("gap", gap)];
        let error = |gap| rms(&table.values(CASE.measures[thing], method, &at(gap)));
        ALPHAS.iter().map(|&alpha| gap(alpha)).map(|gap| (gap, error(gap))).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lubrication theory of a film `g + x^2 / (2 a)`: `3 sqrt 2 pi mu xi^-1.5` across, `2 sqrt 2 pi mu
    /// xi^-0.5` along and about the centre. Far away a disc that turns does not feel the wall.
    #[test]
    fn resistances_have_their_limits() {
        let alpha = 1e-2f64;
        let xi = 2.0 * (0.5 * alpha).sinh().powi(2);
        let [across, along, torque] = exact(alpha).map(|resistance| 4.0 * PI * resistance);
        let root = 2f64.sqrt() * PI;
        assert!((across / (3.0 * root * xi.powf(-1.5)) - 1.0).abs() < 1e-4, "{across}");
        assert!((along / (2.0 * root / xi.sqrt()) - 1.0).abs() < 1e-4, "{along}");
        assert!((torque / (2.0 * root / xi.sqrt()) - 1.0).abs() < 1e-4, "{torque}");
        assert!((exact(20.0)[2] - 1.0).abs() < 1e-12);
    }
}
