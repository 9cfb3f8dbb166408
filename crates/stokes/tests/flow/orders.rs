//! Convergence to smooth solutions, and of a particle's motion to the exact one.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Dim, Matrix, Spin, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Refinement, SolverKind};
use gluey_testkit::convergence_order;
use gluey_testkit::exact::{
    InclusionViscosity, PolynomialFlow, RigidSphere, StokesSolution, ViscousInclusion, WavyPressure,
};

use crate::support::{SOLVERS, UNFITTED, bands, flow_solver, graded, l2_errors, mesh, params, solve};

fn disc(center: Vector<2>, radius: f64) -> ViscousInclusion {
    ViscousInclusion {
        center,
        radius,
        matrix_viscosity: 1.0,
        inclusion_viscosity: InclusionViscosity::Rigid,
        pure_shear: 0.6,
        simple_shear: 1.0,
        spin: -0.5,
    }
}

fn sphere(center: Vector<3>, radius: f64) -> RigidSphere {
    let strain = Matrix::<3>::new(0.5, 0.2, -0.3, 0.2, -0.8, 0.4, -0.3, 0.4, 0.3);
    RigidSphere { center, radius, viscosity: 1.0, strain, spin: Spin::<3>::new(0.3, -0.2, -0.5) }
}

/// Orders of velocity and pressure in L2 for a flow that is smooth in the box, under its body force.
fn orders<const D: usize>(
    exact: &impl StokesSolution<D>,
    levels: &[u8],
    solver: SolverKind,
    mesh: impl Fn(u8) -> TreeMesh<D>,
) -> (f64, f64) {
    let sizes: Vec<f64> = levels.iter().map(|&level| 0.5f64.powi(level.into())).collect();
    let errors = levels.iter().map(|&level| {
        let mut solver = flow_solver(params(UNFITTED, solver, 1e-9));
        let force = |x: &Vector<D>| exact.body_force(x);
        let boundary = |x: &Vector<D>| exact.velocity(x);
        let flow = solver.solve_forced(mesh(level), &[], &boundary, Some(&force)).unwrap();
        l2_errors(&flow, exact)
    });
    let (velocity, pressure): (Vec<f64>, Vec<f64>) = errors.unzip();
    (convergence_order(&sizes, &velocity), convergence_order(&sizes, &pressure))
}

fn check<const D: usize>(exact: &impl StokesSolution<D>, levels: &[u8], solver: SolverKind) {
    let uniform = |level| TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level).unwrap();
    for (velocity, pressure) in
        [orders(exact, levels, solver, uniform), orders(exact, levels, solver, graded)]
    {
        assert!(velocity > 2.8 && velocity < 4.2, "velocity of order {velocity} in {D}D");
        assert!(pressure > 1.8 && pressure < 2.7, "pressure of order {pressure} in {D}D");
    }
}

/// The flow outside a disc or sphere that itself lies outside the box.
#[test]
fn smooth_flows_converge_at_order_three_and_two() {
    check(&disc(Vector::<2>::new(-0.4, 0.3), 0.3), &[3, 4, 5], SolverKind::Direct);
    check(&sphere(Vector::<3>::new(-0.4, 0.3, 0.6), 0.3), &[2, 3], SolverKind::Multigrid);
}

#[test]
fn flows_under_a_body_force_converge_at_order_three_and_two() {
    let flow = WavyPressure(PolynomialFlow { viscosity: 1.0 });
    for solver in SOLVERS {
        check::<2>(&flow, &[3, 4, 5], solver);
    }
    check::<3>(&flow, &[3, 4], SolverKind::Multigrid);
}

/// Errors of the velocity (relative to the rate 1 times the radius) and the spin of a body that is at rest,
/// turning with the flow, in the exact solution.
fn body_error<const D: usize>(
    exact: &impl StokesSolution<D>,
    ball: Ball<D>,
    spin: Spin<D>,
    level: u8,
    solver: SolverKind,
) -> f64 {
    use gluey_levelset::Body;
    // Else what is seen in 2D is the error of larger cells away from the disc.
    let coarsest = if D == 2 { level } else { 3 };
    let mesh = mesh(&Refinement { coarsest, ..bands(level) }, &[ball]);
    let flow = solve(params(UNFITTED, solver, 1e-8), mesh, &[ball], &|x| exact.velocity(x));
    let twist = flow.twists[0];
    let turned = Dim::<D>::spin_slice(&(twist.spin - spin)).iter().fold(0.0, |m: f64, w| m.max(w.abs()));
    turned.max(twist.velocity.amax() / ball.bounding_radius())
}

#[test]
fn the_motion_of_a_disc_converges() {
    let center = Vector::<2>::new(0.43, 0.56);
    let exact = disc(center, 0.18);
    let ball = Ball::new(center, 0.18);
    let levels = [4u8, 5, 6, 7];
    let errors =
        levels.map(|level| body_error(&exact, ball, Spin::<2>::new(-0.5), level, SolverKind::Direct));
    let order = convergence_order(&levels.map(|l| 0.5f64.powi(l.into())), &errors);
    assert!(order > 2.5, "order {order}: {errors:?}");
    assert!(errors[3] < 6.5e-8, "{errors:?}");
}

#[test]
fn the_motion_of_a_sphere_converges() {
    let center = Vector::<3>::new(0.43, 0.56, 0.48);
    let exact = sphere(center, 0.2);
    let ball = Ball::new(center, 0.2);
    let errors = [4u8, 5].map(|level| body_error(&exact, ball, exact.spin, level, SolverKind::Multigrid));
    assert!(errors[1] < errors[0] && errors[1] < 1.07e-5, "{errors:?}");
}
