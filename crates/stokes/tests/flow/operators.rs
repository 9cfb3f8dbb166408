//! The operator in double precision, and one V-cycle as a solver.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Vector};
use gluey_levelset::Ball;
use gluey_linalg::{LinOp, Preconditioner, vector};
use gluey_stokes::{Formulation, MultigridSolver, Problem, Refinement, SaddleSolver, SystemOperator};

use crate::support::{UNFITTED, balls, graded, mesh, paper};

fn problem<const D: usize>(mesh: TreeMesh<D>, balls: &[Ball<D>], formulation: Formulation) -> Problem<D> {
    Problem::new(mesh, balls, 1.0, formulation).unwrap()
}

fn operator_is_symmetric<const D: usize>(formulation: Formulation) {
    // Close enough to share cells.
    let pair =
        [0.3, 0.58].map(|x| Ball::new(Vector::<D>::from_fn(|d, _| if d == 0 { x } else { 0.4 }), 0.13));
    let level = 7 - D as u8;
    let around = Refinement { coarsest: level - 2, surface: level, band: 1.0 };
    for (mesh, balls) in [(mesh(&around, &pair), &pair[..]), (graded(level - 1), &[])] {
        let problem = problem(mesh, balls, formulation);
        let system = &problem.system;
        assert!(!problem.discretisation().velocity.constraints().is_empty());
        let mut operator = SystemOperator::new(system);
        let [x, y] = [1, 2].map(|seed| {
            let mut x = vec![0.0; system.dim()];
            vector::fill_pseudo_random(seed, &mut x);
            system.reduce(&mut x);
            x
        });
        let (mut ax, mut ay) = (x.clone(), y.clone());
        operator.apply(&x, &mut ax);
        operator.apply(&y, &mut ay);
        let difference = (vector::dot(&x, &ay) - vector::dot(&y, &ax)).abs();
        let scale = vector::norm(&x) * vector::norm(&ay);
        assert!(difference < 1e-14 * scale, "{D}D, {formulation:?}: {difference:e} of {scale:e}");
    }
}

#[test]
fn the_operator_is_symmetric_to_round_off() {
    for formulation in [UNFITTED, paper(1e3, 1)] {
        operator_is_symmetric::<2>(formulation);
        operator_is_symmetric::<3>(formulation);
    }
}

/// Factor by which a V-cycle shortens the error in the energy norm, after enough of them to find the worst
/// direction.
fn contraction<const D: usize>(problem: &Problem<D>) -> f64 {
    let (system, split) = (&problem.system, problem.system.velocity_dim());
    let mut solver = MultigridSolver::default();
    solver.prepare(problem).unwrap();
    let cycle = solver.velocity_cycle().unwrap();
    let mut operator = SystemOperator::new(system);
    let (mut e, mut ae, mut z) = (vec![0.0; system.dim()], vec![0.0; system.dim()], vec![0.0; split]);
    vector::fill_pseudo_random(1, &mut e);
    system.reduce(&mut e);
    e[split..].fill(0.0);
    let mut energies = Vec::new();
    for _ in 0..16 {
        operator.apply(&e, &mut ae);
        energies.push(vector::dot(&e[..split], &ae[..split]).sqrt());
        cycle.apply(&ae[..split], &mut z);
        vector::axpy(-1.0, &z, &mut e[..split]);
    }
    (energies[15] / energies[11]).powf(0.25)
}

fn contractions<const D: usize>(balls: &[Ball<D>], levels: &[u8]) -> Vec<f64> {
    let uniform = |level| TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level).unwrap();
    levels.iter().map(|&level| contraction(&problem(uniform(level), balls, UNFITTED))).collect()
}

/// Smallest and largest factor over the levels.
fn range(factors: &[f64]) -> (f64, f64) {
    factors.iter().fold((f64::INFINITY, 0.0), |(low, high), &f| (f.min(low), f.max(high)))
}

#[test]
fn the_contraction_of_a_cycle_does_not_depend_on_the_number_of_levels() {
    let apart = balls(&[Vector::<2>::new(0.37, 0.52), Vector::<2>::new(0.61, 0.47)]);
    let spheres = [Ball::new(Vector::<3>::new(0.28, 0.5, 0.48), 0.14), Ball::new(Vector::repeat(0.72), 0.14)];
    for factors in [contractions::<2>(&[], &[4, 5, 6, 7]), contractions::<3>(&[], &[4, 5])] {
        let (low, high) = range(&factors);
        assert!(high < 0.25 && high < 1.2 * low, "no bodies: {factors:?}");
    }
    for (factors, most) in
        [(contractions(&apart, &[5, 6, 7, 8]), 0.4), (contractions(&spheres, &[4, 5]), 0.6)]
    {
        assert!(range(&factors).1 < most, "two bodies: {factors:?}");
    }
}
