//! How the penalised formulation tends to rigidity, and what both say of one flow.

use gluey_geom::{Dim, Twist, Vector};
use gluey_levelset::{Ball, Ramp};
use gluey_stokes::{
    DirectSolver, Discretisation, Flow, Formulation, PaperParams, PointMatrices, SaddleSolver, SolidRegion,
    SolverKind, StokesSystem, VelocitySpace,
};

use crate::support::{
    UNFITTED, bands, couette, mesh, pair_at, pair_motion, paper, paper_at_center, params, solve,
    strain_inside, twist_distance,
};

/// Size of the finest cells.
const CELL: f64 = 1.0 / 128.0;

fn pair() -> Vec<Ball<2>> {
    pair_at(Vector::<2>::new(0.503, 0.497), 0.5, 30.0)
}

fn flow(formulation: Formulation) -> Flow<2> {
    let pair = pair();
    solve(params(formulation, SolverKind::Direct, 1e-10), mesh(&bands(7), &pair), &pair, &couette)
}

/// Largest strain a whole cell or more inside the discs.
fn strain(flow: &Flow<2>) -> f64 {
    strain_inside(flow, &pair(), CELL)
}

#[test]
fn the_strain_inside_falls_as_the_viscosity_ratio_rises() {
    let strains = [1e2, 1e3, 1e4].map(|r| strain(&flow(paper(r, 1))));
    for step in strains.windows(2) {
        let ratio = step[0] / step[1];
        assert!((7.0..11.0).contains(&ratio), "{strains:?}");
    }
}

/// Slower than the strain: the ramp's outermost layer becomes part of the solid as it stiffens. Where no ramp
/// moves the surface, motions converge as fast, see below.
#[test]
fn motions_tend_to_a_limit_as_the_viscosity_ratio_rises() {
    let motions = [1e2, 1e3, 1e4, 1e5].map(|r| flow(paper(r, 1)).twists);
    let steps: Vec<f64> = motions.windows(2).map(|m| twist_distance(&m[0], &m[1])).collect();
    assert!(steps.windows(2).all(|s| s[1] < 0.6 * s[0]), "{steps:?}");
}

/// Flow around bodies that are the cells whose centre lies inside, eliminated: every node of these cells is
/// rigid.
fn twists_of_rigid_cells<const D: usize>(balls: &[Ball<D>], level: u8) -> Vec<Twist<D>> {
    let discretisation = Discretisation::new(mesh(&bands(level), balls));
    let region = SolidRegion::new(&discretisation, balls, Ramp::new(STEP), &PointMatrices::new(1));
    let solid = region.touched_nodes(&discretisation.velocity, balls);
    let space = VelocitySpace::new(&discretisation, balls, &solid);
    let system = StokesSystem::new(space, 1.0);
    let nodes = &discretisation.velocity;
    let mut lift: Vec<f64> =
        (0..nodes.node_count()).flat_map(|n| couette(&nodes.point(n)).data.0[0]).collect();
    lift.resize(system.velocity_dim(), 0.0);
    system.space.expand(&mut lift);
    let (mut b, mut x) = (vec![0.0; system.dim()], vec![0.0; system.dim()]);
    system.residual(&lift, &vec![0.0; system.pressure.dim()], &mut b);
    let mut solver = DirectSolver::default();
    solver.factorise(&system).unwrap();
    solver.solve(&system, &b, &mut x, 1e-12).unwrap();
    (0..balls.len()).map(|body| system.space.twist(&x, body)).collect()
}

/// A ramp so thin that the solid fraction at a cell's centre, the only quadrature point, is 0 or 1.
const STEP: f64 = 1e-12;

fn penalised_cells_become_rigid<const D: usize>(balls: &[Ball<D>], level: u8) {
    let rigid = twists_of_rigid_cells(balls, level);
    let cell = 0.5f64.powi(level.into());
    let errors = [1e2, 1e3, 1e4].map(|viscosity_ratio| {
        let ramp = STEP / cell;
        let cells = PaperParams { viscosity_ratio, ramp, quadrature: 1, ..PaperParams::default() };
        let params = params(Formulation::Paper(cells), SolverKind::Direct, 1e-12);
        twist_distance(&solve(params, mesh(&bands(level), balls), balls, &couette).twists, &rigid)
    });
    let ratios = [errors[0] / errors[1], errors[1] / errors[2]];
    assert!((7.0..11.0).contains(&ratios[0]) && (9.0..11.0).contains(&ratios[1]), "{D}D: {errors:?}");
}

/// With the same cells solid in both, the penalised motion tends to that of the eliminated bodies as `1/r`.
#[test]
fn penalised_cells_move_as_rigid_ones_up_to_the_inverse_of_the_viscosity_ratio() {
    penalised_cells_become_rigid(&pair(), 6);
    penalised_cells_become_rigid(&[Ball::new(Vector::<3>::new(0.45, 0.56, 0.52), 0.2)], 4);
}

/// A step of size `rho` leaves `1 - rho / 2` of the strain, since the form carries `2 eta_s` and the
/// multiplier `eta_s`.
#[test]
fn every_uzawa_step_makes_the_body_more_rigid() {
    let after = |rho: f64, uzawa_steps: usize| {
        let params = PaperParams { viscosity_ratio: 1e2, uzawa_steps, rho, ..PaperParams::default() };
        strain(&flow(Formulation::Paper(params)))
    };
    let strains = [1, 2, 4, 8].map(|steps| after(1.0, steps));
    let contraction = strains[1] / strains[0];
    assert!((0.48..0.6).contains(&contraction), "{strains:?}");
    assert!(strains[2] < 0.4 * strains[1] && strains[3] < 0.25 * strains[2], "{strains:?}");
    assert!(after(2.0, 4) < 0.2 * strains[2], "rho = 2: {}", after(2.0, 4));
    assert!(after(3.5, 12) < after(3.5, 4), "rho = 3.5 converges, if slowly");
}

/// Soft as the ball is, it cannot tell one side from the other: in the middle of the shear both readings of
/// its motion are rest and half the shear rate.
fn at_the_middle_both_velocities_agree<const D: usize>(level: u8) {
    let ball = [Ball::new(Vector::<D>::repeat(0.5), 0.2)];
    let motion = |formulation: Formulation| {
        let params = params(formulation, SolverKind::Direct, 1e-11);
        solve(params, mesh(&bands(level), &ball), &ball, &couette).twists[0]
    };
    for twist in [paper(1e2, 1), paper_at_center(1e2, 1)].map(motion) {
        assert!(twist.velocity.amax() < 1e-9, "{twist:?}");
        assert!((twist.spin[Dim::<D>::ROT - 1] + 0.5).abs() < 1e-9, "{twist:?}");
    }
}

#[test]
fn mean_and_central_velocity_agree_in_the_middle_of_the_shear() {
    at_the_middle_both_velocities_agree::<2>(6);
    at_the_middle_both_velocities_agree::<3>(4);
}

/// Off the middle they are readings of the same nearly rigid motion, and become one as the body hardens.
#[test]
fn mean_and_central_velocity_become_one_as_the_body_hardens() {
    let apart = |ratio: f64, steps: usize| {
        let [mean, center] = [paper(ratio, steps), paper_at_center(ratio, steps)].map(|f| flow(f).twists);
        twist_distance(&mean, &center)
    };
    let [soft, hard, multiplied] = [apart(1e2, 1), apart(1e4, 1), apart(1e2, 6)];
    assert!(soft > 1e-5 && hard < 0.02 * soft && multiplied < 0.1 * soft, "{soft} {hard} {multiplied}");
}

#[test]
fn both_formulations_describe_the_same_flow() {
    let [unfitted, soft] = [UNFITTED, paper(1e3, 1)].map(|f| pair_motion(&pair(), &flow(f).twists));
    assert!((soft.normal_speed / unfitted.normal_speed - 1.0).abs() < 0.2, "{unfitted:?} {soft:?}");
    assert!((soft.line_rotation - unfitted.line_rotation).abs() < 6.5e-3, "{unfitted:?} {soft:?}");
    assert!((0..2).all(|k| (soft.spins[k] - unfitted.spins[k]).abs() < 1.5e-2), "{unfitted:?} {soft:?}");
}
