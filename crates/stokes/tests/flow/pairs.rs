//! Two particles near contact against the reference data.

use gluey_geom::Vector;
use gluey_levelset::Ball;
use gluey_stokes::{Refinement, SolverKind};
use gluey_testkit::reference::pair_2d_velocities;

use crate::support::{
    PairMotion, RADIUS, UNFITTED, balls, bands, couette, mesh, pair_at, pair_motion, params, solve,
};

fn motion<const D: usize>(balls: &[Ball<D>], refinement: &Refinement, solver: SolverKind) -> PairMotion {
    let flow = solve(params(UNFITTED, solver, 1e-8), mesh(refinement, balls), balls, &couette);
    pair_motion(balls, &flow.twists)
}

/// The exact motion at a gap (in radii) and an angle.
fn exact(gap: f64, degrees: f64) -> PairMotion {
    let table = pair_2d_velocities().unwrap();
    let column = |name: &str| table.column(name).unwrap();
    let row = (0..table.row_count())
        .find(|&r| column("xi")[r] == gap && column("theta_deg")[r] == degrees)
        .expect("the reference has this gap and angle");
    PairMotion {
        normal_speed: column("vn")[row],
        line_rotation: column("rot")[row],
        spins: [column("omega1")[row], column("omega2")[row]],
    }
}

/// Largest errors of the motion from the exact one: normal speed (relative, where it is not zero by
/// symmetry), line rotation and spins.
fn errors(found: &PairMotion, exact: &PairMotion, degrees: f64) -> [f64; 3] {
    let speed = match degrees == 0.0 {
        true => found.normal_speed / RADIUS,
        false => found.normal_speed / exact.normal_speed - 1.0,
    };
    let spin = |body: usize| (found.spins[body] - exact.spins[body]).abs();
    [speed.abs(), (found.line_rotation - exact.line_rotation).abs(), spin(0).max(spin(1))]
}

/// A mesh that locks would miss the normal speed by all of it, and the spins by 0.3 at the smallest gap.
#[test]
fn two_discs_move_as_the_reference_says_down_to_a_hundredth_of_a_radius() {
    for (gap, tolerance) in [(1.0, 2.8e-4), (0.2, 1.7e-4), (0.01, 1.8e-3)] {
        for degrees in [0.0, 45.0] {
            let pair = pair_at(Vector::<2>::new(0.503, 0.4985), gap, degrees);
            let found = motion(&pair, &bands(8), SolverKind::Direct);
            let exact = exact(gap, degrees);
            let [speed, rotation, spin] = errors(&found, &exact, degrees);
            let bound = if degrees == 0.0 { 1.6e-6 } else { tolerance };
            assert!(speed < bound, "gap {gap}, {degrees} degrees: {found:?} and {exact:?}");
            assert!(rotation < 4e-4, "gap {gap}, {degrees} degrees: {found:?} and {exact:?}");
            assert!(spin < 2e-4, "gap {gap}, {degrees} degrees: {found:?} and {exact:?}");
        }
    }
}

#[test]
fn rotation_and_spins_are_right_at_all_gaps_of_the_reference() {
    for gap in [1.0, 0.2, 0.1, 0.01] {
        for degrees in [0.0, 45.0] {
            let pair = pair_at(Vector::<2>::new(0.503, 0.4985), gap, degrees);
            let found = motion(&pair, &bands(8), SolverKind::Direct);
            let [_, rotation, spin] = errors(&found, &exact(gap, degrees), degrees);
            assert!(rotation < 4e-4 && spin < 2e-4, "gap {gap}, {degrees} degrees: {rotation:e}, {spin:e}");
        }
    }
}

/// At the start of the paper's figure 7, in the box.
#[test]
fn two_spheres_approach_as_the_reference_says() {
    let pair = balls(&[Vector::<3>::new(0.3, 0.525, 0.5), Vector::<3>::new(0.7, 0.475, 0.5)]);
    let found = motion(&pair, &bands(7), SolverKind::Multigrid);
    assert!((found.normal_speed / -0.049445 - 1.0).abs() < 3.2e-5, "{found:?}");
    assert!((found.line_rotation / -0.01255 - 1.0).abs() < 5e-4, "{found:?}");
    assert!((found.spins[0] - found.spins[1]).abs() < 1e-8, "{found:?}");
}
