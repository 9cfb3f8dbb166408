//! What moves with the lattice or is turned with it is computed the same.

use gluey_geom::{Aabb, Dim, Twist, Vector};
use gluey_levelset::Ball;
use gluey_stokes::FlowSolver;
use gluey_stokes::fem::TreeMesh;
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{METHODS, Method};
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{couette, solve};
use crate::statistics::largest;

/// Relative tolerances of the solver.
const TOLERANCES: [f64; 3] = [1e-6, 1e-8, 1e-10];
/// Names of the operations, by their number in the table.
const OPERATIONS: [&str; 3] = ["translation by cells", "quarter turn", "reciprocity"];
/// The last of them, for what holds bodies.
const RECIPROCITY: usize = 2;

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "symmetry",
    title: "Translation by whole cells, quarter turns, reciprocity",
    text: "Two free bodies of radius 0.1 in shear on a uniform mesh of the unit box (a/h = 3.2 in 2D, 1.6 in 3D). Moved by three cells along a period \
           of the box, or turned with the flow by 90 degrees, they must move as before: largest difference of a velocity or, \
           times the radius, a spin, relative to the radius times the shear rate. It may be as large as the solver's tolerance \
           makes it; the direct solver of 2D knows no tolerance. Reciprocity: the resistance matrix of two bodies of radii 0.1 and \
           0.15 at a gap of 0.01 radii is symmetric, largest difference over the largest entry.",
    keys: &["dimension", "operation", "tolerance"],
    measures: &["difference"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

const RADIUS: f64 = 0.1;

fn tasks(_: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (method, tolerance) in iproduct!(METHODS, TOLERANCES) {
        let plane: [SymmetryMeasure; 3] = [translation::<2>, quarter_turn::<2>, asymmetry::<2>];
        let space: [SymmetryMeasure; 3] = [translation::<3>, quarter_turn::<3>, asymmetry::<3>];
        let task = |dimension: f64, level: u8, operation: usize, measure: SymmetryMeasure| {
            let at = [dimension, operation as f64, tolerance];
            Task::new(method.name, &at, move || Ok(vec![measure(method, level, tolerance)?]))
        };
        tasks.extend((0..2).map(|k| task(2.0, 5, k, plane[k])));
        tasks.extend((0..2).map(|k| task(3.0, 4, k, space[k])));
        if method.holds_bodies {
            tasks.extend([task(2.0, 5, RECIPROCITY, plane[2]), task(3.0, 4, RECIPROCITY, space[2])]);
        }
    }
    tasks
}

type SymmetryMeasure = fn(&Method, u8, f64) -> Result<f64, VerifyError>;

/// Largest difference of the resistance matrix of two unequal bodies from its transpose, over its largest
/// entry.
fn asymmetry<const D: usize>(method: &Method, level: u8, tolerance: f64) -> Result<f64, VerifyError> {
    let [first, second] = centers::<D>();
    let line = (second - first).normalize();
    let radii = [RADIUS, 1.5 * RADIUS];
    let distance = radii[0] + radii[1] + 0.01 * RADIUS;
    let balls = [Ball::new(first, radii[0]), Ball::new(first + line * distance, radii[1])];
    let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level)?;
    let mut solver = FlowSolver::new(method.params::<D>(tolerance))?;
    let resistance = solver.prepared(mesh, &balls)?.resistance()?;
    Ok((&resistance - resistance.transpose()).amax() / resistance.amax())
}

/// Two bodies in general position.
fn centers<const D: usize>() -> [Vector<D>; 2] {
    let first = Vector::from_fn(|d, _| [0.387, 0.431, 0.512][d]);
    let second = Vector::from_fn(|d, _| [0.591, 0.554, 0.463][d]);
    [first, second]
}

fn translation<const D: usize>(method: &Method, level: u8, tolerance: f64) -> Result<f64, VerifyError> {
    let periodic = std::array::from_fn(|d| d == 0);
    let twists = |shift: f64| {
        let mut offset = Vector::<D>::zeros();
        offset[0] = shift;
        let period = std::array::from_fn(|d| (d == 0).then_some(1.0));
        let balls = centers::<D>().map(|center| Ball::periodic(center + offset, RADIUS, period));
        let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], periodic, level)?;
        Ok::<_, VerifyError>(solve(method, tolerance, mesh, &balls, &couette)?.twists)
    };
    Ok(difference(&twists(0.0)?, &twists(3.0 * 0.5f64.powi(level.into()))?))
}

fn quarter_turn<const D: usize>(method: &Method, level: u8, tolerance: f64) -> Result<f64, VerifyError> {
    let middle = Vector::<D>::repeat(0.5);
    let twists = |centers: [Vector<D>; 2], flow: &dyn Fn(&Vector<D>) -> Vector<D>| {
        let balls = centers.map(|center| Ball::new(center, RADIUS));
        let mesh = TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level)?;
        Ok::<_, VerifyError>(solve(method, tolerance, mesh, &balls, flow)?.twists)
    };
    let straight = twists(centers(), &couette)?;
    let turned = twists(centers().map(|x| middle + turn(&(x - middle))), &|x: &Vector<D>| {
        turn(&couette(&(middle + turn_back(&(x - middle)))))
    })?;
    let back = |twist: &Twist<D>| {
        let mut spin = twist.spin;
        if D == 3 {
            (spin[0], spin[1]) = (twist.spin[1], -twist.spin[0]);
        }
        Twist { velocity: turn_back(&twist.velocity), spin }
    };
    Ok(difference(&straight, &turned.iter().map(back).collect::<Vec<_>>()))
}

/// The vector turned by 90 degrees in the plane of shear.
fn turn<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut turned = *x;
    (turned[0], turned[1]) = (-x[1], x[0]);
    turned
}

/// The inverse of [`turn`].
fn turn_back<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut turned = *x;
    (turned[0], turned[1]) = (x[1], -x[0]);
    turned
}

fn difference<const D: usize>(a: &[Twist<D>], b: &[Twist<D>]) -> f64 {
    let of_body = |(a, b): (&Twist<D>, &Twist<D>)| {
        let spin = a.spin - b.spin;
        let spin = largest(Dim::<D>::spin_slice(&spin));
        [(a.velocity - b.velocity).amax() / RADIUS, spin]
    };
    largest(&a.iter().zip(b).flat_map(of_body).collect::<Vec<_>>())
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (dimension, (operation, name), method) in
        iproduct!([2.0, 3.0], OPERATIONS.iter().enumerate(), METHODS)
    {
        let at = [("dimension", dimension), ("operation", operation as f64), ("tolerance", TOLERANCES[2])];
        if method.holds_bodies || operation != RECIPROCITY {
            let value = largest(&table.values("difference", method.name, &at));
            let what = format!("{name}, {dimension}D, tolerance 1e-10");
            numbers.push(Number::new(NumberKind::Size, what, method.name, value));
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    Plot::of_methods("tolerance of the solver", "largest difference, 3D", &OPERATIONS, |method, operation| {
        let at = [("dimension", 3.0), ("operation", operation as f64)];
        let points = table.values("tolerance", method, &at).into_iter();
        points.zip(table.values("difference", method, &at)).rev().collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_back_undoes_a_turn() {
        let x = Vector::<3>::new(0.3, -0.2, 0.7);
        assert_eq!(turn_back(&turn(&x)), x);
        assert_eq!(turn(&Vector::<2>::new(1.0, 0.0)), Vector::<2>::new(0.0, 1.0));
    }

    /// A twist with the sign of its spin reversed is not the same.
    #[test]
    fn a_wrong_sign_is_a_difference() {
        let twist = Twist { velocity: Vector::<2>::new(0.1, 0.2), spin: gluey_geom::Spin::<2>::new(-0.5) };
        assert_eq!(difference(&[twist], &[twist]), 0.0);
        let reversed = Twist { spin: -twist.spin, ..twist };
        assert_eq!(difference(&[twist], &[reversed]), 1.0);
    }
}
