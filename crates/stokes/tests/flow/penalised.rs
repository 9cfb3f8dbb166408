//! The multigrid solver of the penalised formulation: effort and answers do not depend on the viscosity
//! ratio, the mesh or the number of particles.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Vector};
use gluey_levelset::Ball;
use gluey_stokes::SolverKind;

use crate::support::{SOLVERS, balls, bands, couette, doublet, mesh, paper, params, solve, twist_distance};

/// Iterations to 1e-8 of one penalised solve.
fn iterations<const D: usize>(viscosity_ratio: f64, balls: &[Ball<D>], mesh: TreeMesh<D>) -> usize {
    let params = params(paper(viscosity_ratio, 1), SolverKind::Multigrid, 1e-8);
    solve(params, mesh, balls, &couette).iteration_count
}

fn uniform<const D: usize>(level: u8) -> TreeMesh<D> {
    TreeMesh::uniform(Aabb::unit(), [1; D], [false; D], level).unwrap()
}

/// A pair a little less than a radius apart, on no symmetry line of the mesh.
fn pair<const D: usize>() -> Vec<Ball<D>> {
    let at = |x: f64, y: f64| Vector::from_fn(|d, _| [x, y, 0.5][d]);
    balls(&[at(0.451, 0.51), at(0.549, 0.49)])
}

/// Nine discs that fill a quarter of the box.
fn nine() -> Vec<Ball<2>> {
    let center = |k: usize| Vector::<2>::new(0.18 + (k % 3) as f64 / 3.0, 0.174 + (k / 3) as f64 / 3.0);
    (0..9).map(|k| Ball::new(center(k), 0.1)).collect()
}

#[test]
fn iterations_do_not_grow_with_resolution_or_the_number_of_discs() {
    let counts = [6, 7, 8].map(|level| iterations(1e3, &pair::<2>(), uniform(level)));
    assert!(counts.iter().all(|&c| c <= 22), "{counts:?}");
    let counts = [6, 7, 8].map(|level| iterations(1e3, &pair::<2>(), mesh(&bands(level), &pair::<2>())));
    assert!(counts.iter().all(|&c| c <= 24), "adaptive: {counts:?}");
    let counts = [6, 7].map(|level| iterations(1e3, &nine(), uniform(level)));
    assert!(counts.iter().all(|&c| c <= 30), "nine discs: {counts:?}");
    let counts = [6, 7].map(|level| iterations(1e3, &doublet(), mesh(&bands(level), &doublet())));
    assert!(counts.iter().all(|&c| c <= 30), "touching: {counts:?}");
}

#[test]
fn iterations_do_not_grow_with_the_viscosity_ratio() {
    let counts = [1e3, 1e2, 1e4, 1e6].map(|r| iterations(r, &nine(), uniform(6)));
    assert!(counts.iter().all(|&c| 2 * c <= 3 * counts[0]), "{counts:?}");
    let counts = [1e3, 1e2, 1e4, 1e6].map(|r| iterations(r, &pair::<2>(), mesh(&bands(7), &pair::<2>())));
    assert!(counts.iter().all(|&c| 2 * c <= 3 * counts[0]), "{counts:?}");
}

#[test]
fn iterations_stay_bounded_for_spheres() {
    let spheres = pair::<3>();
    let counts = [5, 6].map(|level| iterations(1e3, &spheres, mesh(&bands(level), &spheres)));
    assert!(counts.iter().all(|&c| c <= 34), "{counts:?}");
    let counts = [1e2, 1e4, 1e6].map(|r| iterations(r, &spheres, mesh(&bands(5), &spheres)));
    assert!(counts.iter().all(|&c| c <= 34), "{counts:?}");
}

/// To 1e-8 at a ratio of 100. The direct solver's fluid is compressible by 1e-9 of the pressure, which grows
/// with the ratio.
#[test]
fn direct_and_multigrid_agree_at_every_viscosity_ratio() {
    for (ratio, balls) in [(1e2, pair::<2>()), (1e3, nine()), (1e4, nine()), (1e6, pair::<2>())] {
        let [direct, multigrid] =
            SOLVERS.map(|s| solve(params(paper(ratio, 1), s, 1e-12), uniform(6), &balls, &couette));
        let difference = twist_distance(&direct.twists, &multigrid.twists);
        assert!(difference < 1e-10 * ratio, "ratio {ratio:e}: {difference:e}");
    }
}

/// The ramp's weak outermost layer stiffens with the ratio, so the limit is that of the touched nodes made
/// rigid.
#[test]
fn spheres_stiffen_as_the_viscosity_ratio_rises() {
    let spheres = pair::<3>();
    let twists = [1e2, 1e3, 1e4, 1e5].map(|r| {
        let params = params(paper(r, 1), SolverKind::Multigrid, 1e-10);
        solve(params, mesh(&bands(5), &spheres), &spheres, &couette).twists
    });
    let steps: Vec<f64> = twists.windows(2).map(|t| twist_distance(&t[0], &t[1])).collect();
    assert!(steps.windows(2).all(|s| s[1] < 0.6 * s[0]), "{steps:?}");
}
