//! The second coefficient of the viscosity, from pairs of spheres at random places.

use std::f64::consts::PI;

use gluey_geom::{Aabb, Matrix, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Refinement};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{IN_SHEARED_BOXES, Method};
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{level, shift, stress_of};
use crate::statistics::mean;

/// Radius in the unit box, which is periodic.
const RADIUS: f64 = 0.025;
const CELLS_PER_RADIUS: f64 = 3.2;
/// Distances of centres in radii between which pairs are computed: at the nearer they touch.
const RANGE: [f64; 2] = [2.0, 4.0];
/// `J r^6` far away, from the strain that each stresslet makes at the other sphere.
const FAR: f64 = 7.5;
/// The coefficient for pairs at random places, all equally likely.
const COEFFICIENT: f64 = 5.002;

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "random-pairs",
    title: "The second coefficient of the viscosity",
    text: "The relative viscosity of spheres at random is 1 + 5/2 phi + c phi^2 with c = 5/2 + 15/2 int_2^inf J r^2 dr (Batchelor and \
           Green 1972, 10.1017/S0022112072001435), J being what the other sphere adds to the stresslet of each of a free pair at the \
           distance r (radii), mean over directions, in units of that of one alone. c = 5.002 where all places are equally likely (the \
           hydrodynamic part in equilibrium). Pairs with random directions and places, one in each of equal ranges of r^-3 up to \
           contact, in a periodic box of 40 radii; the stresslets are those in five orthogonal strains, less those of either sphere alone in the \
           same cells. Beyond four radii J r^6 is 15/2 + b r^-2 with b from the pairs nearest to there.",
    keys: &["pair"],
    measures: &["r^-3", "J r^6"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(extent: Extent) -> Vec<Task> {
    let count = if extent == Extent::Quick { 4 } else { 12 };
    let task = |(method, k): (&'static Method, usize)| {
        Task::new(method.name, &[k as f64], move || measure(method, k, count))
    };
    iproduct!(IN_SHEARED_BOXES, 0..count).map(task).collect()
}

/// A place in the unit cube and one more number, different for each pair.
fn random(k: usize) -> (Vector<3>, f64) {
    (shift::<3>(k) + Vector::repeat(0.5), ((k + 1) as f64 * 0.618_033_988_749_895).fract())
}

fn measure(method: &Method, k: usize, count: usize) -> Result<Vec<f64>, VerifyError> {
    let (random, other) = random(k);
    let [near, far] = RANGE.map(|r| r.powi(-3));
    let inverse = far + (near - far) * (k as f64 + other) / count as f64;
    let distance = inverse.powf(-1.0 / 3.0);
    let (sin, cos) = (2.0 * PI * random[1]).sin_cos();
    let up = 2.0 * random[0] - 1.0;
    let across = (1.0 - up * up).sqrt();
    let direction = Vector::<3>::new(across * cos, across * sin, up);
    let h = 0.5f64.powi(level(RADIUS, CELLS_PER_RADIUS).into());
    let middle = Vector::<3>::repeat(0.5) + shift::<3>(7 * k + 3) * h;
    let ball = |side: f64| {
        let center = middle + direction * (side * 0.5 * distance * RADIUS);
        Ball::periodic(center, RADIUS, [Some(1.0); 3])
    };
    let pair = [ball(-1.0), ball(1.0)];
    let both = stresslet(method, &pair)?;
    let alone = stresslet(method, &pair[..1])? + stresslet(method, &pair[1..])?;
    // The images of a sphere strain it by the share that it takes of the box, those of two by twice that.
    let share = 4.0 / 3.0 * PI * RADIUS.powi(3);
    let added = 0.5 * (both / (1.0 + 2.0 * share) - alone / (1.0 + share));
    Ok(vec![inverse, added * inverse.powi(-2)])
}

/// The stresslets of free spheres along the strain, mean over all strains, in units of `20/3 pi mu a^3`.
fn stresslet(method: &Method, balls: &[Ball<3>]) -> Result<f64, VerifyError> {
    let refinement = Refinement::to_level(level(RADIUS, CELLS_PER_RADIUS));
    let mesh = refinement.mesh(Aabb::unit(), [1; 3], [true; 3], balls)?;
    let mut solver = FlowSolver::new(method.params::<3>(1e-7))?;
    let mut prepared = solver.prepared(mesh, balls)?;
    let mut sum = 0.0;
    for strain in strains() {
        let flow = prepared.solve(&Conditions::in_linear_flow(&strain).with_stress())?;
        sum += stress_of(&flow)?.of_bodies(1.0).dot(&strain);
    }
    Ok(sum / 5.0 / (20.0 / 3.0 * PI * RADIUS.powi(3)))
}

/// Five orthogonal strains of length one.
fn strains() -> [Matrix<3>; 5] {
    let diagonal =
        |x: f64, y: f64, z: f64| Matrix::<3>::from_diagonal(&Vector::<3>::new(x, y, z).normalize());
    let shear = |i: usize, j: usize| {
        let mut strain = Matrix::<3>::zeros();
        (strain[(i, j)], strain[(j, i)]) = (0.5f64.sqrt(), 0.5f64.sqrt());
        strain
    };
    [diagonal(1.0, -1.0, 0.0), diagonal(-1.0, -1.0, 2.0), shear(0, 1), shear(0, 2), shear(1, 2)]
}

/// The coefficient and its standard error from `J r^6` in equal ranges of `r^-3`, nearer pairs later.
fn coefficient(values: &[f64]) -> [f64; 2] {
    let [near, far] = RANGE.map(|r| r.powi(-3));
    let count = values.len() as f64;
    // `int J r^2 dr` is a third of the integral of `J r^6` over r^-3. Neighbours differ by chance and by the
    // trend, which makes the error rather too large.
    let squares: f64 = values.windows(2).map(|pair| 0.5 * (pair[1] - pair[0]).powi(2)).sum();
    let error = (squares / (count - 1.0).max(1.0) / count).sqrt();
    // `b r^-2` is `b t^(2/3)`, whose mean up to `t` is three fifths of it there.
    let outer = FAR + 0.6 * (values.first().copied().unwrap_or(f64::NAN) - FAR);
    let integral = (mean(values) * (near - far) + outer * far) / 3.0;
    [2.5 + 7.5 * integral, 7.5 / 3.0 * (near - far) * error]
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for method in IN_SHEARED_BOXES {
        let [found, error] = coefficient(&table.values("J r^6", method.name, &[]));
        let miss = "second coefficient less 5.002".to_owned();
        numbers.push(Number::new(NumberKind::Error, miss, method.name, found - COEFFICIENT));
        numbers.push(Number::new(NumberKind::Size, "its standard error".to_owned(), method.name, error));
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    Plot::of_methods("r^-3 of the pair", "J r^6", &["pairs"], |method, _| {
        let of = |measure| table.values(measure, method, &[]);
        of("r^-3").into_iter().zip(of("J r^6")).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strains_are_orthogonal_and_of_length_one() {
        let strains = strains();
        for (i, a) in strains.iter().enumerate() {
            for (j, b) in strains.iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((a.dot(b) - expected).abs() < 1e-15 && a.trace().abs() < 1e-15);
            }
        }
    }

    /// With `15/2 r^-6` everywhere the integral is 15/2 / 24.
    #[test]
    fn the_coefficient_is_that_of_the_integral() {
        let [found, error] = coefficient(&[FAR; 5]);
        assert!((found - 2.5 - 7.5 * 7.5 / 24.0).abs() < 1e-12 && error == 0.0, "{found}");
    }
}
