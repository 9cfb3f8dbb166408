//! A disc or a sphere that is moved or turned near a plane wall.

use std::f64::consts::PI;

use gluey_geom::{Dim, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Refinement};
use itertools::iproduct;

use crate::case::{CaseTable, Task, VerificationCase, VerifyError};
use crate::method::{FILM_METHODS, Method, holding};
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{level, mean_and_scatter, mesh, shift};
use crate::statistics::{largest, rms};

/// So small that the other walls are 160 radii away or more, and 40.
const RADIUS_OF_DISC: f64 = 0.003125;
const RADIUS_OF_SPHERE: f64 = 0.0125;

/// Distances of the centre from the wall in radii are `cosh(alpha)`.
const ALPHAS: [f64; 4] = [1.0, 0.5, 0.3, 0.1];

/// The force on a sphere that is moved along the wall over `6 pi mu a U` and the torque on one that is turned
/// about an axis along it over `8 pi mu a^3 w` at these distances (Goldman, Cox and Brenner 1967).
const TABLE: [[f64; 2]; 4] = [[1.5675, 1.0998], [2.1514, 1.3877], [2.6475, 1.7012], [3.7863, 2.5056]];

/// The chapter of the disc.
pub const DISC: VerificationCase = VerificationCase {
    name: "disc-wall",
    title: "A disc near a wall",
    text: "A disc of radius 0.003125 near a wall of the unit box at rest, held at a velocity across or along the wall or at a spin, at \
           gaps of 0.54, 0.13, 0.045 and 0.005 radii and several places along the wall: relative errors of force and torque, which are \
           4 pi mu U / (alpha - tanh alpha), 4 pi mu U / alpha and 4 pi mu a^2 w coth alpha with the distance a cosh alpha of the centre \
           (Jeffrey and Onishi 1981, 10.1093/qjmam/34.2.129). A disc that is moved along has no torque and one that turns no force: \
           what they have, over 4 pi mu a. The other walls are 160 radii away.",
    keys: &["a/h", "gap", "position"],
    measures: &["force across", "force along", "torque", "coupling"],
    tasks: |extent| tasks(disc, extent.pick(&[(3.2, 4), (6.4, 2)], &[(3.2, 8), (6.4, 4), (12.8, 4)])),
    numbers: |tables| numbers_of_disc(&tables.of(DISC.name)),
    plot: |tables| plot(&tables.of(DISC.name), "rms relative error, *a*/*h* = 6.4", 6.4),
};

/// The chapter of the sphere.
pub const SPHERE: VerificationCase = VerificationCase {
    name: "wall",
    title: "A sphere near a wall",
    text: "A sphere of radius 0.0125 near a wall of the unit box at rest, held at a velocity across or along the wall or at a spin \
           about an axis along it, at gaps of 0.54, 0.13, 0.045 and 0.005 radii and several places along the wall: relative errors of the force \
           (Brenner 1961, 10.1016/0009-2509(61)80035-3, a series; Goldman, Cox and Brenner 1967, 10.1016/0009-2509(67)80047-2, tabulated to \
           five digits) and of the torque. The other walls, 40 radii away, change these by about 1e-4. By the reciprocal theorem the \
           torque on the sphere that is moved along is the force on the one that turns: their difference over 6 pi mu a^2.",
    keys: &["a/h", "gap", "position"],
    measures: &["force across", "force along", "torque", "reciprocity"],
    tasks: |extent| tasks(sphere, extent.pick(&[(1.6, 3), (3.2, 2)], &[(1.6, 6), (3.2, 4), (6.4, 2)])),
    numbers: |tables| numbers_of_sphere(&tables.of(SPHERE.name)),
    plot: |tables| plot(&tables.of(SPHERE.name), "rms relative error, *a*/*h* = 3.2", 3.2),
};

fn gap(alpha: f64) -> f64 {
    alpha.cosh() - 1.0
}

/// The force on a sphere moved towards the wall over `6 pi mu a U` (Brenner 1961).
fn force_across(alpha: f64) -> f64 {
    let sinh = alpha.sinh();
    let term = |n: f64| {
        let k = 2.0 * n + 1.0;
        let above = 2.0 * (k * alpha).sinh() + k * (2.0 * alpha).sinh();
        let below = 4.0 * (0.5 * k * alpha).sinh().powi(2) - (k * sinh).powi(2);
        n * (n + 1.0) / ((2.0 * n - 1.0) * (2.0 * n + 3.0)) * (above / below - 1.0)
    };
    let count = (20.0 / alpha) as usize;
    4.0 / 3.0 * sinh * (1..=count).map(|n| term(n as f64)).sum::<f64>()
}

/// Force across, force along and torque of a disc over `4 pi mu U` and `4 pi mu a^2 w`.
fn of_disc(alpha: f64) -> [f64; 3] {
    [1.0 / (alpha - alpha.tanh()), 1.0 / alpha, 1.0 / alpha.tanh()]
}

/// The measures by a method, with these cells per radius, at the place of this number and this position.
type WallMeasure = fn(&Method, f64, usize, usize) -> Result<Vec<f64>, VerifyError>;

/// By meshes, with cells per radius and the number of positions along the wall. The thinnest film, which no
/// mesh here resolves, is asked only of what lubricates.
fn tasks(measure: WallMeasure, meshes: &[(f64, usize)]) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (method, &(cells, count)) in iproduct!(holding(FILM_METHODS), meshes) {
        let places = if method.lubricates { ALPHAS.len() } else { ALPHAS.len() - 1 };
        tasks.extend(iproduct!(0..places, 0..count).map(|(place, k)| {
            let at = [cells, gap(ALPHAS[place]), k as f64];
            Task::new(method.name, &at, move || measure(method, cells, place, k))
        }));
    }
    tasks
}

fn disc(method: &Method, cells: f64, place: usize, position: usize) -> Result<Vec<f64>, VerifyError> {
    let [across, along, turned] =
        wrenches::<2>(method, RADIUS_OF_DISC, cells, ALPHAS[place].cosh(), position)?;
    let exact = of_disc(ALPHAS[place]).map(|resistance| 4.0 * PI * resistance);
    let coupling = along.torque[0].abs().max(turned.force[0].abs());
    Ok(vec![
        across.force[1] / exact[0] - 1.0,
        along.force[0] / exact[1] - 1.0,
        turned.torque[0] / (exact[2] * RADIUS_OF_DISC * RADIUS_OF_DISC) - 1.0,
        coupling / (4.0 * PI * RADIUS_OF_DISC),
    ])
}

fn sphere(method: &Method, cells: f64, place: usize, position: usize) -> Result<Vec<f64>, VerifyError> {
    let [across, along, turned] =
        wrenches::<3>(method, RADIUS_OF_SPHERE, cells, 1.0 + gap(ALPHAS[place]), position)?;
    let (force, torque) = (6.0 * PI * RADIUS_OF_SPHERE, 8.0 * PI * RADIUS_OF_SPHERE.powi(3));
    Ok(vec![
        across.force[1] / force / force_across(ALPHAS[place]) - 1.0,
        along.force[0] / force / TABLE[place][0] - 1.0,
        turned.torque[2] / torque / TABLE[place][1] - 1.0,
        (along.torque[2] - turned.force[0]) / (force * RADIUS_OF_SPHERE),
    ])
}

/// What holds a body at this distance in radii that is moved across the wall, along it, and turned.
fn wrenches<const D: usize>(
    method: &Method,
    radius: f64,
    cells: f64,
    distance: f64,
    position: usize,
) -> Result<[Wrench<D>; 3], VerifyError> {
    let mut center = Vector::repeat(0.5) + shift::<D>(position) * (radius / cells);
    center[1] = distance * radius;
    let body = [Ball::new(center, radius)];
    let mesh = mesh(&Refinement::to_level(level(radius, cells)), &body)?;
    let mut solver = FlowSolver::new(method.params::<D>(1e-9))?;
    let mut prepared = solver.prepared(mesh, &body)?;
    let mut held = |twist: Twist<D>| -> Result<Wrench<D>, VerifyError> {
        Ok(prepared.solve(&Conditions::at_rest().with_twists(&[twist]))?.wrenches[0])
    };
    let moved = |axis: usize| {
        let mut twist = Twist::default();
        twist.velocity[axis] = 1.0;
        twist
    };
    let mut turned = Twist::default();
    turned.spin[Dim::<D>::ROT - 1] = 1.0;
    Ok([held(moved(1))?, held(moved(0))?, held(turned)?])
}

/// Mean and scatter of forces and torque at a place.
fn of_place(table: &CaseTable, method: &Method, at: &[(&'static str, f64); 2]) -> Vec<Number> {
    let [(_, cells), (_, gap)] = at;
    let of_measure = |measure: &&str| {
        let name = format!("{measure}, a/h = {cells}, gap {gap:.3} a");
        mean_and_scatter(table, method.name, measure, at, &name)
    };
    DISC.measures[..3].iter().flat_map(of_measure).collect()
}

fn numbers_of_disc(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for method in holding(FILM_METHODS) {
        for at in table.places(method.name, ["a/h", "gap"]) {
            numbers.extend(of_place(table, method, &at));
            let [(_, cells), (_, gap)] = at;
            let name = format!("coupling, a/h = {cells}, gap {gap:.3} a");
            let coupling = largest(&table.values("coupling", method.name, &at));
            numbers.push(Number::new(NumberKind::Size, name, method.name, coupling));
        }
    }
    numbers
}

fn numbers_of_sphere(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for method in holding(FILM_METHODS) {
        let places = table.places(method.name, ["a/h", "gap"]);
        numbers.extend(places.iter().flat_map(|at| of_place(table, method, at)));
        let asymmetry = largest(&table.values("reciprocity", method.name, &[]));
        numbers.push(Number::new(NumberKind::Size, "reciprocity".to_owned(), method.name, asymmetry));
    }
    numbers
}

fn plot(table: &CaseTable, y: &'static str, cells: f64) -> Plot {
    let things = &DISC.measures[..3];
    Plot::of_methods("gap in radii", y, things, |method, thing| {
        let at = |gap| [("a/h", cells), ("gap", gap)];
        let error = |gap| rms(&table.values(things[thing], method, &at(gap)));
        ALPHAS.into_iter().map(gap).map(|gap| (gap, error(gap))).collect()
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
        let [across, along, torque] = of_disc(alpha).map(|resistance| 4.0 * PI * resistance);
        let root = 2f64.sqrt() * PI;
        assert!((across / (3.0 * root * xi.powf(-1.5)) - 1.0).abs() < 1e-4, "{across}");
        assert!((along / (2.0 * root / xi.sqrt()) - 1.0).abs() < 1e-4, "{along}");
        assert!((torque / (2.0 * root / xi.sqrt()) - 1.0).abs() < 1e-4, "{torque}");
        assert!((of_disc(20.0)[2] - 1.0).abs() < 1e-12);
    }

    /// Near contact `1/e - ln(e)/5 + 0.97128` (Cox and Brenner 1967), far away 1 + 9/8 of the distance's
    /// inverse.
    #[test]
    fn the_series_has_its_limits() {
        let alpha = 0.05;
        let gap = gap(alpha);
        let expansion = 1.0 / gap - 0.2 * gap.ln() + 0.97128;
        assert!((force_across(alpha) / expansion - 1.0).abs() < 1e-4, "{} {expansion}", force_across(alpha));
        let expansion = 1.0 / (1.0 - 9.0 / 8.0 / 6f64.cosh());
        assert!((force_across(6.0) / expansion - 1.0).abs() < 1e-6);
    }

    /// The expansions near contact of Chaoui and Feuillebois 2003, 10.1093/qjmam/56.3.381.
    #[test]
    fn tabulated_values_have_their_limit() {
        for (alpha, [force, torque]) in ALPHAS.into_iter().zip(TABLE).skip(2) {
            let gap = gap(alpha);
            let log = -gap.ln();
            let along = 8.0 / 15.0 * log + 0.95429 + 64.0 / 375.0 * gap * log + 0.42945 * gap;
            let turned = 0.4 * log + 0.37089 + 66.0 / 125.0 * gap * log + 0.34008 * gap;
            assert!((along - force).abs() < 1e-3, "{along} {force}");
            assert!((turned - torque).abs() < 4e-3, "{turned} {torque}");
        }
    }
}
