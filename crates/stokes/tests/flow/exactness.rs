//! Flows that the elements hold exactly are found exactly, on meshes with hanging nodes.

use gluey_geom::{Dim, Spin, Twist, Vector};
use gluey_levelset::Ball;
use gluey_stokes::Formulation;

use crate::support::{
    SOLVERS, UNFITTED, bands, bump, couette, graded, mesh, nodal_error, paper, paper_at_center, params,
    solve, strain_inside, twist_distance,
};

/// Size of the wrong start; tolerances are relative to the residual it leaves.
const DETOUR: f64 = 0.01;

fn couette_flow_is_found<const D: usize>() {
    for formulation in [paper(1e3, 1), UNFITTED] {
        for solver in SOLVERS {
            let mesh = graded::<D>(3 - (D as u8 - 2));
            let start = |x: &Vector<D>| couette(x) + bump(x) * DETOUR;
            let flow = solve(params(formulation, solver, 1e-13), mesh, &[], &start);
            assert!(!flow.discretisation.velocity.constraints().is_empty());
            assert!(nodal_error(&flow, &start) > 1e-3, "the start is no solution");
            let error = nodal_error(&flow, &couette);
            assert!(error < 1e-10, "{D}D, {solver:?}: {error:e}");
            let pressure = flow.pressure.iter().fold(0.0, |m: f64, p| m.max(p.abs()));
            assert!(pressure < 1e-10, "{D}D, {solver:?}: pressure {pressure:e}");
        }
    }
}

#[test]
fn couette_flow_is_exact_in_2d() {
    couette_flow_is_found::<2>();
}

#[test]
fn couette_flow_is_exact_in_3d() {
    couette_flow_is_found::<3>();
}

/// The start is the answer, and the right-hand side nothing but rounding.
fn undisturbed_flow_stays<const D: usize>() {
    for solver in SOLVERS {
        let flow = solve(params(UNFITTED, solver, 1e-8), graded::<D>(2), &[], &couette);
        assert!(nodal_error(&flow, &couette) < 1e-14);
        assert!(flow.pressure.iter().all(|p| p.abs() < 1e-13));
    }
}

#[test]
fn an_empty_box_keeps_its_undisturbed_flow() {
    undisturbed_flow_stays::<2>();
    undisturbed_flow_stays::<3>();
}

/// `u = y (1 - y) e_x`, `p = -2 x`. A residual at a pressure node is its error times the volume of a cell, so
/// the same tolerance leaves more of the pressure in 3D.
fn poiseuille_flow_is_found<const D: usize>() {
    let poiseuille = |x: &Vector<D>| couette::<D>(&Vector::from_fn(|_, _| 0.5 + x[1] * (1.0 - x[1])));
    let tolerance = 1e-10 * 10f64.powi(D as i32 - 2);
    for solver in SOLVERS {
        let start = |x: &Vector<D>| poiseuille(x) + bump(x) * DETOUR;
        let flow = solve(params(UNFITTED, solver, 1e-13), graded::<D>(2), &[], &start);
        let error = nodal_error(&flow, &poiseuille);
        assert!(error < 1e-10, "{D}D, {solver:?}: {error:e}");
        let nodes = &flow.discretisation.pressure;
        let first = flow.pressure[0] + 2.0 * nodes.point(0)[0];
        for (n, p) in flow.pressure.iter().enumerate() {
            let error = p + 2.0 * nodes.point(n)[0] - first;
            assert!(error.abs() < tolerance, "{D}D, {solver:?}, node {n}: {error:e}");
        }
    }
}

#[test]
fn poiseuille_flow_and_its_pressure_are_exact() {
    poiseuille_flow_is_found::<2>();
    poiseuille_flow_is_found::<3>();
}

/// When the boundary moves as one body, so does everything inside, on any mesh and in any formulation.
fn everything_moves_as_one<const D: usize>(formulation: Formulation, level: u8) {
    let tolerance = 1e-8;
    let center = Vector::<D>::repeat(0.5);
    let mut spin: Spin<D> = Dim::<D>::zero_spin();
    (0..Dim::<D>::ROT).for_each(|k| spin[k] = 0.7 - 0.4 * k as f64);
    let whole = Twist { velocity: Vector::<D>::from_fn(|d, _| 0.3 - 0.2 * d as f64), spin };
    let balls = [0.33, 0.61].map(|x| Ball::new(Vector::<D>::from_fn(|d, _| x + 0.01 * d as f64), 0.17));
    let expected: Vec<Twist<D>> = balls
        .iter()
        .map(|b| Twist { velocity: whole.velocity_at(&(b.center() - center)), spin: whole.spin })
        .collect();
    for solver in SOLVERS {
        let start = |x: &Vector<D>| whole.velocity_at(&(x - center)) + bump(x);
        let flow = solve(params(formulation, solver, 1e-12), mesh(&bands(level), &balls), &balls, &start);
        let error = twist_distance(&flow.twists, &expected);
        assert!(error < tolerance, "{D}D, {solver:?}: twists {error:e}");
        let error = nodal_error(&flow, &|x| whole.velocity_at(&(x - center)));
        assert!(error < tolerance, "{D}D, {solver:?}: nodes {error:e}");
        assert!(strain_inside(&flow, &balls, 0.0) < 10.0 * tolerance);
    }
}

#[test]
fn a_rigid_motion_of_the_boundary_carries_everything() {
    for formulation in [UNFITTED, paper(1e3, 2), paper_at_center(1e3, 2)] {
        everything_moves_as_one::<2>(formulation, 5);
        everything_moves_as_one::<3>(formulation, 3);
    }
}
