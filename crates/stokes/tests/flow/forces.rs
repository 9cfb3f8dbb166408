//! No force and no torque on free bodies, computed from the stress of the flow alone.

use gluey_geom::{Dim, Spin, Vector};
use gluey_levelset::{Ball, Body, Ramp};
use gluey_stokes::{
    Flow, Formulation, PointMatrices, SolidNodes, SolidRegion, SolverKind, StokesSystem, VelocitySpace,
    solid_nodes,
};

use crate::support::{SOLVERS, UNFITTED, bands, couette, mesh, pair_at, paper, params, solve};

/// Loads of the fluid's stress on all nodes of a flow, as if there were no bodies: what a body takes up
/// shows.
fn loads<const D: usize>(flow: &Flow<D>) -> Vec<f64> {
    let nowhere = vec![None; flow.discretisation.velocity.node_count()];
    let space = VelocitySpace::new::<Ball<D>>(&flow.discretisation, &[], &nowhere);
    let system = StokesSystem::new(space, 1.0);
    let mut b = vec![0.0; system.dim()];
    system.residual(&flow.velocity, &flow.pressure, &mut b);
    b
}

/// The nodes that the solid of each body acts on, for bodies that share no cell.
fn held_nodes<const D: usize>(flow: &Flow<D>, balls: &[Ball<D>], formulation: Formulation) -> SolidNodes {
    let discretisation = &flow.discretisation;
    match formulation {
        Formulation::Paper(paper) => {
            let cell = discretisation.mesh.size(discretisation.mesh.max_level());
            let matrices = PointMatrices::new(paper.quadrature);
            let region = SolidRegion::new(discretisation, balls, Ramp::new(paper.ramp * cell), &matrices);
            region.touched_nodes(&discretisation.velocity, balls)
        }
        // All around the surface: forces on it are those on all these nodes.
        Formulation::Unfitted { .. } => solid_nodes(discretisation, balls, -2.0),
    }
}

fn free_bodies_feel_nothing<const D: usize>(balls: &[Ball<D>], level: u8, solvers: &[SolverKind]) {
    for formulation in [UNFITTED, paper(1e3, 1)] {
        for &solver in solvers {
            let flow = solve(params(formulation, solver, 1e-12), mesh(&bands(level), balls), balls, &couette);
            let (loads, held) = (loads(&flow), held_nodes(&flow, balls, formulation));
            for (body, ball) in balls.iter().enumerate() {
                let (mut force, mut size) = (Vector::<D>::zeros(), 0.0);
                let mut torque: Spin<D> = Dim::<D>::zero_spin();
                for n in (0..held.len()).filter(|&n| held[n] == Some(body as u32)) {
                    let load = Vector::<D>::from_column_slice(&loads[n * D..][..D]);
                    force += load;
                    torque += Dim::<D>::moment(&ball.arm(&flow.discretisation.velocity.point(n)), &load);
                    size += load.norm();
                }
                let torque = Dim::<D>::spin_slice(&torque).iter().fold(0.0, |m: f64, t| m.max(t.abs()));
                let total = force.amax().max(torque / ball.bounding_radius());
                assert!(size > 1e-3, "the body holds something: {size:e}");
                assert!(total < 1e-10, "{D}D, {formulation:?}, {solver:?}: {total:e} of {size:e}");
            }
        }
    }
}

#[test]
fn free_discs_feel_no_force_and_no_torque() {
    free_bodies_feel_nothing(&pair_at(Vector::<2>::new(0.503, 0.497), 1.0, 30.0), 6, &SOLVERS);
}

#[test]
fn free_spheres_feel_no_force_and_no_torque() {
    let spheres = [Ball::new(Vector::<3>::new(0.28, 0.5, 0.48), 0.14), Ball::new(Vector::repeat(0.72), 0.14)];
    free_bodies_feel_nothing(&spheres, 4, &[SolverKind::Multigrid]);
}
