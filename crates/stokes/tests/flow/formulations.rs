//! How the penalised formulation tends to rigidity, and what both say of one flow.

use gluey_geom::Vector;
use gluey_levelset::Ball;
use gluey_stokes::{Flow, Formulation, PaperParams, SolverKind};

use crate::support::{
    RIGID, bands, couette, mesh, pair_at, pair_motion, paper, params, solve, strain_inside, twist_distance,
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

/// Slower than the strain: the ramp's outermost layer becomes part of the solid as it stiffens.
#[test]
fn motions_tend_to_a_limit_as_the_viscosity_ratio_rises() {
    let motions = [1e2, 1e3, 1e4, 1e5].map(|r| flow(paper(r, 1)).twists);
    let steps: Vec<f64> = motions.windows(2).map(|m| twist_distance(&m[0], &m[1])).collect();
    assert!(steps.windows(2).all(|s| s[1] < 0.6 * s[0]), "{steps:?}");
}

/// A step of size `rho` leaves `1 - rho / 2` of the strain, since the form carries `2 eta_s` and the multiplier `eta_s`.
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

#[test]
fn eliminated_bodies_do_not_strain_at_all() {
    assert!(strain(&flow(RIGID)) < 1e-14);
}

#[test]
fn both_formulations_describe_the_same_flow() {
    let [rigid, soft] = [RIGID, paper(1e3, 1)].map(|f| pair_motion(&pair(), &flow(f).twists));
    assert!((soft.normal_speed / rigid.normal_speed - 1.0).abs() < 0.2, "{rigid:?} {soft:?}");
    assert!((soft.line_rotation - rigid.line_rotation).abs() < 0.01, "{rigid:?} {soft:?}");
    assert!((0..2).all(|k| (soft.spins[k] - rigid.spins[k]).abs() < 0.02), "{rigid:?} {soft:?}");
}
