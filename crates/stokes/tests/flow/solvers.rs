//! The linear solvers: they agree, they repeat themselves to the bit, and their effort does not grow.

use gluey_fem::TreeMesh;
use gluey_geom::{Aabb, Dim, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Flow, FlowSolver, Formulation, Lubrication, SolverKind};

use crate::support::{
    RADIUS, SOLVERS, UNFITTED, balls, bands, bump, couette, doublet, flow_solver, graded, mesh, pair_at,
    paper, params, solve, twist_distance,
};

#[test]
fn direct_and_multigrid_agree() {
    for formulation in [UNFITTED, paper(1e3, 2)] {
        for (gap, refinement) in [(1.0, bands(6)), (0.2, bands(7)), (0.2, bands(6))] {
            let pair = pair_at(Vector::<2>::new(0.503, 0.497), gap, 30.0);
            let [direct, multigrid] = SOLVERS
                .map(|s| solve(params(formulation, s, 1e-11), mesh(&refinement, &pair), &pair, &couette));
            let difference = twist_distance(&direct.twists, &multigrid.twists);
            assert!(difference < 1e-8, "{formulation:?}, gap {gap}: {difference:e}");
            // Two solves in `paper`. Rounding in single precision must not hold up the steps.
            let count = multigrid.iteration_count;
            assert!(count <= 60, "{formulation:?}, gap {gap}: {count}");
        }
    }
}

/// The two discs that nearly touch, on cells far larger than their gap.
#[test]
fn direct_and_multigrid_agree_on_the_doublet() {
    for formulation in [UNFITTED, paper(1e3, 1)] {
        let uniform = || TreeMesh::uniform(Aabb::unit(), [1; 2], [false; 2], 6).unwrap();
        let [direct, multigrid] =
            SOLVERS.map(|s| solve(params(formulation, s, 3e-12), uniform(), &doublet(), &couette));
        let difference = twist_distance(&direct.twists, &multigrid.twists);
        assert!(difference < 1e-8, "{formulation:?}: twists {difference:e}");
        let fields = direct.velocity.iter().zip(&multigrid.velocity);
        let difference = fields.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(difference < 1e-8, "{formulation:?}: nodes {difference:e}");
    }
}

fn iterations<const D: usize>(formulation: Formulation, balls: &[Ball<D>], levels: &[u8]) -> Vec<usize> {
    let count = |&level| {
        let params = params(formulation, SolverKind::Multigrid, 1e-8);
        solve(params, mesh(&bands(level), balls), balls, &couette).iteration_count
    };
    levels.iter().map(count).collect()
}

/// Each iteration applies the operator once, and in its V-cycle as often as both sweeps and the residual
/// between them need it; the residuals before and after a solve are two more. Where the
/// finest cells cover a part of the box only, so do the smoothing sweeps.
#[test]
fn applications_on_the_finest_mesh_are_counted() {
    let count = |mesh: TreeMesh<2>| {
        let start = |x: &Vector<2>| couette(x) + bump(x);
        let flow = solve(params(UNFITTED, SolverKind::Multigrid, 1e-8), mesh, &[], &start);
        let iterations = flow.iteration_count as f64;
        (flow.fine_operator_applications - 2.0 - iterations) / iterations
    };
    let uniform = TreeMesh::uniform(Aabb::unit(), [1; 2], [false; 2], 5).unwrap();
    let in_a_cycle = count(uniform);
    assert!(in_a_cycle >= 3.0 && in_a_cycle.fract() == 0.0, "{in_a_cycle}");
    let shared = count(graded(4)) / in_a_cycle;
    assert!((0.4..0.9).contains(&shared), "{shared}");
}

/// Discs on a lattice of `n` by `n`, moved off the lattice so that no two meet the mesh in the same way.
fn lattice(n: usize) -> Vec<Ball<2>> {
    let center = |k: usize| {
        let (i, j) = ((k % n) as f64, (k / n) as f64);
        let jitter = Vector::<2>::new((7.3 * i + 1.1 * j).sin(), (2.7 * i - 5.9 * j).sin()) * 0.01;
        Vector::<2>::new(i + 0.5, j + 0.5) / n as f64 + jitter
    };
    balls(&(0..n * n).map(center).collect::<Vec<_>>())
}

#[test]
fn iterations_do_not_grow_with_resolution_or_the_number_of_discs() {
    let apart = pair_at(Vector::<2>::new(0.503, 0.497), 1.0, 30.0);
    let counts = iterations(UNFITTED, &apart, &[6, 7, 8, 9]);
    assert!(counts.iter().all(|&c| c <= 17), "{counts:?}");
    let counts = [2, 3, 5].map(|n| iterations(UNFITTED, &lattice(n), &[7])[0]);
    assert!(counts.iter().all(|&c| c <= 22), "{counts:?}");
}

/// Discs that nearly touch, with a film much thinner than a cell.
#[test]
fn iterations_do_not_grow_where_discs_touch() {
    let counts = iterations(UNFITTED, &doublet(), &[6, 7, 8, 9]);
    assert!(counts.iter().all(|&c| c <= 27), "{counts:?}");
}

#[test]
fn iterations_do_not_grow_with_resolution_or_the_number_of_spheres() {
    for x in [[0.3, 0.525], [0.45, 0.51]] {
        let spheres =
            balls(&[Vector::<3>::new(x[0], x[1], 0.5), Vector::<3>::new(1.0 - x[0], 1.0 - x[1], 0.5)]);
        let counts = iterations(UNFITTED, &spheres, &[5, 6]);
        assert!(counts.iter().all(|&c| c <= 22), "{counts:?}");
    }
    let center = |k: usize| {
        let place = [k % 3, k / 3 % 3, k / 9].map(|i| (1.0 + 2.0 * i as f64) / 6.0);
        Vector::from_fn(|d, _| place[d] + 0.03 * (7.3 * k as f64 + 2.9 * d as f64).sin())
    };
    let lattice: Vec<Ball<3>> = (0..27).map(|k| Ball::new(center(k), 0.1)).collect();
    let uniform = TreeMesh::uniform(Aabb::unit(), [1; 3], [false; 3], 4).unwrap();
    let flow = solve(params(UNFITTED, SolverKind::Multigrid, 1e-8), uniform, &lattice, &couette);
    assert!(flow.iteration_count <= 29, "{}", flow.iteration_count);
}

/// A crowd at a fraction of 0.27 with films as thick as a cell between all neighbours: 66 iterations on
/// levels of the fluid's viscosity.
#[test]
fn iterations_are_bounded_in_a_crowd() {
    let center = |k: usize| {
        let place = [k % 5, k / 5 % 5, k / 25].map(|i| (1.0 + 2.0 * i as f64) / 10.0);
        Vector::from_fn(|d, _| place[d] + 0.015 * (7.3 * k as f64 + 2.9 * d as f64).sin())
    };
    let crowd: Vec<Ball<3>> = (0..125).map(|k| Ball::new(center(k), 0.08)).collect();
    let uniform = TreeMesh::uniform(Aabb::unit(), [1; 3], [false; 3], 4).unwrap();
    let flow = solve(params(UNFITTED, SolverKind::Multigrid, 1e-8), uniform, &crowd, &couette);
    assert!(flow.iteration_count <= 53, "{}", flow.iteration_count);
}

/// A cluster of eight spheres that touch, at a/h = 1.6: without forces of films the solver sees slabs, not
/// films. With them counts grow with the twelve stiff modes of the cluster, whose slabs are half a cell
/// thick.
#[test]
fn iterations_are_bounded_where_spheres_touch() {
    for (lubrication, most) in [(Lubrication::Deficit, [24, 38, 64, 120]), (Lubrication::None, [38; 4])] {
        let count = |gap: f64| {
            let place = |k: usize, d: usize| 0.1 * (1.0 + 0.5 * gap) * ((k >> d & 1) as f64 * 2.0 - 1.0);
            let offset = [0.503, 0.517, 0.489];
            let ball = |k: usize| Ball::new(Vector::<3>::from_fn(|d, _| offset[d] + place(k, d)), 0.1);
            let balls: Vec<Ball<3>> = (0..8).map(ball).collect();
            let uniform = TreeMesh::uniform(Aabb::unit(), [1; 3], [false; 3], 4).unwrap();
            let params = params(Formulation::Unfitted { lubrication }, SolverKind::Multigrid, 1e-8);
            solve(params, uniform, &balls, &couette).iteration_count
        };
        let counts = [0.4, 0.1, 1e-2, 1e-6].map(count);
        assert!(counts.iter().zip(&most).all(|(count, most)| count <= most), "{lubrication:?}: {counts:?}");
    }
}

/// Half of the slab between two spheres lies on either side of a plane of the mesh: no cell in it has more
/// than 0.29 of fluid, four cells across. Where such cells had the unknowns of others, 200 iterations did
/// not do.
#[test]
fn films_that_two_layers_of_cells_share_are_solved_for() {
    let sphere =
        |side: f64| Ball::new(Vector::<3>::new(0.503, 0.5 + 0.5 * side * 2.0034 * RADIUS, 0.498), RADIUS);
    let spheres = [sphere(-1.0), sphere(1.0)];
    let flow =
        solve(params(UNFITTED, SolverKind::Multigrid, 1e-8), mesh(&bands(7), &spheres), &spheres, &couette);
    assert!(flow.iteration_count <= 32, "{}", flow.iteration_count);
}

/// Everything a flow is made of, as bits.
fn bits<const D: usize>(flow: &Flow<D>) -> Vec<u64> {
    let twists = flow.twists.iter().flat_map(|t| {
        t.velocity.iter().copied().chain(Dim::<D>::spin_slice(&t.spin).iter().copied()).collect::<Vec<_>>()
    });
    let fields = flow.velocity.iter().chain(&flow.pressure).chain(&flow.multiplier).copied();
    fields.chain(twists).map(f64::to_bits).collect()
}

fn runs_repeat<const D: usize>(balls: &[Ball<D>], level: u8, solvers: &[SolverKind]) {
    for formulation in [paper(1e3, 2), UNFITTED] {
        for &solver in solvers {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let params = params(formulation, solver, 1e-8);
                pool.install(|| bits(&solve(params, mesh(&bands(level), balls), balls, &couette)))
            };
            assert!(run(1) == run(2), "{D}D, {formulation:?}, {solver:?}: runs differ");
        }
    }
}

#[test]
fn the_same_input_gives_the_same_bits() {
    runs_repeat(&doublet(), 6, &SOLVERS);
    let spheres = [Ball::new(Vector::<3>::new(0.3, 0.52, 0.5), 0.15), Ball::new(Vector::repeat(0.66), 0.15)];
    runs_repeat(&spheres, 4, &[SolverKind::Multigrid]);
}

#[test]
fn the_last_flows_are_a_good_start_for_the_next() {
    for formulation in [UNFITTED, paper(1e3, 1)] {
        let centers = |x: f64| balls(&[Vector::<2>::new(x, 0.52), Vector::<2>::new(0.7, 0.47)]);
        let at = |step: i32| centers(0.3 + 0.0005 * f64::from(step));
        let parameters = params(formulation, SolverKind::Multigrid, 1e-10);
        let run = |solver: &mut FlowSolver<2>, step: i32| {
            solver.solve(mesh(&bands(7), &at(step)), &at(step), &couette).unwrap()
        };
        let mut solver = flow_solver::<2>(parameters);
        let [first, second] = [0, 1].map(|step| run(&mut solver, step).iteration_count);
        let (last, before) = solver.warm_start().map(|(l, b)| (l.clone(), b.cloned())).unwrap();
        let warm = run(&mut solver, 2);
        let cold = solve(parameters, mesh(&bands(7), &at(2)), &at(2), &couette);
        assert!(second.max(warm.iteration_count) < first, "{second}, {} and {first}", warm.iteration_count);
        assert!(twist_distance(&warm.twists, &cold.twists) < 1e-8);

        let mut resumed = flow_solver::<2>(parameters);
        let refused = resumed.set_warm_start(mesh(&bands(6), &at(1)), last.clone(), before.clone());
        assert_eq!(refused.unwrap_err().velocities, last.velocity.len());
        resumed.set_warm_start(mesh(&bands(7), &at(1)), last, before).unwrap();
        assert!(bits(&run(&mut resumed, 2)) == bits(&warm), "resumed and uninterrupted runs differ");
    }
}
