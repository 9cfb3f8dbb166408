//! Flows on several ranks beside those of the serial solver, which has another numbering of unknowns, other
//! preconditioners and, in 2D, none.

use gluey_distributed::{BoxFlow, equal_cuts};
use gluey_fem::{ImplicitTree, TreeMesh};
use gluey_geom::{Aabb, Vector};
use gluey_stokes::{FlowParams, FlowSolver, Formulation, Lubrication, SolverKind};

use crate::support::on_ranks;

const FLOW: BoxFlow = BoxFlow { viscosity: 1.7, tolerance: 1e-11, max_iterations: 120 };

fn walls<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut u = Vector::zeros();
    u[0] = x[1] * (0.3 + x[D - 1]) - 0.2;
    u[1] = (2.0 * std::f64::consts::TAU * x[0]).sin() * (1.0 - x[1]) * x[1];
    u
}

fn ranks_find_the_serial_flow<const D: usize>(level: u8, is_adaptive: bool, solver: SolverKind) {
    let wants = |lower: &Vector<D>, h: f64, level: u8| {
        let distance = (lower + Vector::repeat(0.5 * h) - Vector::repeat(0.45)).norm() - 0.3;
        !is_adaptive || level < 2 || distance.abs() < h
    };
    let mesh = TreeMesh::refine(Aabb::unit(), [1; D], [false; D], level, wants).unwrap();
    let formulation = Formulation::Unfitted { lubrication: Lubrication::None };
    let params = FlowParams { viscosity: FLOW.viscosity, formulation, solver, tolerance: 1e-11 };
    let serial = FlowSolver::<D>::new(params).unwrap().solve(mesh, &[], &walls).unwrap();
    let scale = serial.velocity.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    for size in [1, 3, 8] {
        let parts = on_ranks(size, |ranks| {
            let mut tree = ImplicitTree::new(Aabb::unit(), [1; D], [false; D], level, &wants).unwrap();
            let cuts = equal_cuts(&tree, ranks);
            FLOW.solve(&mut tree, &cuts, ranks, &walls).unwrap().velocity()
        });
        let velocity: Vec<f64> = parts.unwrap().iter().flatten().flatten().copied().collect();
        assert_eq!(velocity.len(), serial.velocity.len());
        let difference = velocity.iter().zip(&serial.velocity).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        println!("{size} ranks: {:.1e}", difference / scale);
        assert!(difference < 1.2e-10 * scale, "{size} ranks: {:e}", difference / scale);
    }
}

#[test]
fn ranks_find_the_flow_of_the_serial_solver() {
    for is_adaptive in [false, true] {
        ranks_find_the_serial_flow::<2>(5, is_adaptive, SolverKind::Direct);
        ranks_find_the_serial_flow::<3>(if is_adaptive { 4 } else { 3 }, is_adaptive, SolverKind::Multigrid);
    }
}
