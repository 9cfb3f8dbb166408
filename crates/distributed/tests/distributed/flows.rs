//! Flows on several ranks: those of one rank, and those of the serial solver.

use gluey_distributed::{BoxFlow, LocalFlow, equal_cuts, weighted_cuts};
use gluey_fem::{Cell, Cuts, ImplicitTree};
use gluey_geom::{Aabb, Vector};
use gluey_parallel::Ranks;
use gluey_stokes::StokesError;

use crate::support::{largest_difference, on_ranks};

/// Of velocities and pressures, over the largest.
const LIMITS: [f64; 2] = [1.6e-11, 1.7e-10];
const FLOW: BoxFlow = BoxFlow { viscosity: 1.7, tolerance: 1e-11, max_iterations: 120 };

#[derive(Clone, Copy)]
struct Example {
    level: u8,
    is_adaptive: bool,
    /// In the first direction.
    is_periodic: bool,
}

const UNIFORM: Example = Example { level: 4, is_adaptive: false, is_periodic: false };
const ADAPTIVE: Example = Example { level: 5, is_adaptive: true, is_periodic: false };
const PERIODIC: Example = Example { level: 4, is_adaptive: true, is_periodic: true };

impl Example {
    fn periodic<const D: usize>(self) -> [bool; D] {
        std::array::from_fn(|d| self.is_periodic && d == 0)
    }

    /// Around a sphere, unless uniform.
    fn wants<const D: usize>(self) -> impl Fn(&Vector<D>, f64, u8) -> bool + Sync {
        move |lower, h, level| {
            let distance = (lower + Vector::repeat(0.5 * h) - Vector::repeat(0.45)).norm() - 0.3;
            !self.is_adaptive || level < 2 || distance.abs() < h
        }
    }

    fn solve<const D: usize>(self, ranks: &Ranks) -> LocalFlow<D> {
        let wants = self.wants::<D>();
        let mut tree = ImplicitTree::new(Aabb::unit(), [1; D], self.periodic(), self.level, &wants).unwrap();
        let cuts = equal_cuts(&tree, ranks);
        FLOW.solve(&mut tree, &cuts, ranks, &walls).unwrap()
    }
}

/// A velocity on the walls that lets as much in as out, has the period of the box and needs a pressure.
fn walls<const D: usize>(x: &Vector<D>) -> Vector<D> {
    let mut u = Vector::zeros();
    u[0] = x[1] * (0.3 + x[D - 1]) - 0.2;
    u[1] = (2.0 * std::f64::consts::TAU * x[0]).sin() * (1.0 + 0.5 * x[1]);
    u
}

/// Velocities and pressures of all ranks, one after the other.
fn joined<const D: usize>(parts: &[LocalFlow<D>]) -> (Vec<Vector<D>>, Vec<f64>) {
    let velocity = parts.iter().flat_map(LocalFlow::velocity).collect();
    (velocity, parts.iter().flat_map(|part| part.pressure().iter().copied()).collect())
}

/// Velocities and pressures are those of one rank but for these limits.
fn ranks_find_the_flow_of_one<const D: usize>(example: Example, limits: [f64; 2]) {
    let alone = example.solve::<D>(&Ranks::alone());
    assert!(alone.flow.residual < 1e-11);
    for size in [2, 3, 4, 8] {
        let run = || on_ranks(size, |ranks| example.solve::<D>(ranks)).unwrap();
        let parts = run();
        let (velocity, pressure) = joined(&parts);
        let difference = largest_difference(&alone.velocity(), &velocity);
        let iterations = [alone.flow.iteration_count, parts[0].flow.iteration_count];
        println!("{size} ranks: {difference:.1e}, iterations {iterations:?}");
        assert!(difference < limits[0], "{size} ranks: {difference:e}");
        let scale = alone.pressure().iter().fold(0.0f64, |m, p| m.max(p.abs()));
        let pressures = alone.pressure().iter().zip(&pressure);
        let difference = pressures.fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / scale;
        println!("{size} ranks: pressures {difference:.1e}");
        assert!(difference < limits[1], "{size} ranks: pressures {difference:e}");
        let iterations: Vec<usize> = parts.iter().map(|part| part.flow.iteration_count).collect();
        assert!(
            iterations.iter().all(|&n| n == iterations[0] && n.abs_diff(alone.flow.iteration_count) <= 1)
        );
        assert_eq!(joined(&run()), (velocity, pressure), "the same bits on every run");
    }
}

#[test]
fn ranks_find_the_flow_of_one_in_2d() {
    ranks_find_the_flow_of_one::<2>(UNIFORM, LIMITS);
    ranks_find_the_flow_of_one::<2>(ADAPTIVE, LIMITS);
    // One rank ends an iteration apart from several, all of them at the tolerance.
    ranks_find_the_flow_of_one::<2>(PERIODIC, [1.8e-10, 1.2e-9]);
}

#[test]
fn ranks_find_the_flow_of_one_in_3d() {
    let [uniform, adaptive, periodic] =
        [UNIFORM, ADAPTIVE, PERIODIC].map(|e| Example { level: e.level - 1, ..e });
    [uniform, adaptive].into_iter().for_each(|e| ranks_find_the_flow_of_one::<3>(e, LIMITS));
    // As many iterations on any number of ranks, whose last ones leave this between two at the tolerance.
    ranks_find_the_flow_of_one::<3>(periodic, [6e-11, 2.6e-10]);
}

#[test]
fn cuts_are_those_of_one_rank_that_counts_everything() {
    for example in [UNIFORM, ADAPTIVE, PERIODIC] {
        for size in [1, 2, 3, 5, 8, 64] {
            let wants = example.wants::<2>();
            let tree = || {
                ImplicitTree::new(Aabb::unit(), [1; 2], example.periodic(), example.level, &wants).unwrap()
            };
            let want = Cuts::equal(&mut tree(), size);
            let found = on_ranks(size, |ranks| equal_cuts(&tree(), ranks)).unwrap();
            assert!(found.iter().all(|cuts| *cuts == want));
        }
    }
}

/// Leaves of unlike weights: each rank has its share, but for one leaf at each end, and none is cut in two.
#[test]
fn cuts_share_work() {
    let wants = ADAPTIVE.wants::<2>();
    let tree = || ImplicitTree::new(Aabb::unit(), [1; 2], [false; 2], ADAPTIVE.level, &wants).unwrap();
    let weight = |cell: &Cell<2>| if cell.coords[0].is_multiple_of(3) { 9 } else { 2 };
    let all = tree().weigh_leaves(&(0..tree().end()), &weight);
    for size in [1, 2, 3, 8, 40] {
        let found = on_ranks(size, |ranks| weighted_cuts(&tree(), ranks, &weight)).unwrap();
        assert!(found.iter().all(|cuts| *cuts == found[0]));
        let work = |rank: usize| tree().weigh_leaves(&found[0].of(rank), &weight);
        assert_eq!((0..size).map(work).sum::<u64>(), all);
        assert!((0..size).all(|rank| work(rank).abs_diff(all / size as u64) <= 10), "{size}");
        let mut tree = tree();
        let starts = (0..size).map(|rank| found[0].of(rank).start);
        assert!(starts.into_iter().all(|start| tree.end_of_leaf(start) == start), "{size}");
    }
}

/// More ranks than cells of the coarse levels, and ranks with few cells of the finest.
#[test]
fn ranks_without_cells_take_part() {
    let example = Example { level: 3, ..UNIFORM };
    let alone = example.solve::<2>(&Ranks::alone());
    let parts = on_ranks(40, |ranks| example.solve::<2>(ranks)).unwrap();
    assert!(parts.iter().any(|part| part.levels[0].cells == 0));
    let difference = largest_difference(&alone.velocity(), &joined(&parts).0);
    assert!(difference < 1e-9, "{difference:e}");
}

/// What a rank holds of a mesh shrinks with the number of ranks, on all levels but the coarsest.
#[test]
fn no_rank_holds_arrays_of_the_size_of_the_mesh() {
    let example = Example { level: 7, ..UNIFORM };
    let parts = on_ranks(16, |ranks| {
        let wants = example.wants::<2>();
        let mut tree = ImplicitTree::new(Aabb::unit(), [1; 2], [false; 2], example.level, &wants).unwrap();
        let cuts = equal_cuts(&tree, ranks);
        let levels =
            BoxFlow { tolerance: 1e-2, ..FLOW }.solve(&mut tree, &cuts, ranks, &walls).unwrap().levels;
        (levels, tree.known_count())
    })
    .unwrap();
    let cells = 1 << 14;
    for (levels, known) in &parts {
        let finest = levels[levels.len() - 1];
        assert_eq!(finest.cells, cells / 16);
        assert!(finest.cells + finest.ghost_cells < 1200, "{finest:?}");
        assert!(finest.ghost_nodes < 300, "{finest:?}");
        assert!(*known < cells / 4, "{known}");
    }
}

#[test]
fn a_box_without_walls_is_an_error_on_all_ranks() {
    let errors = on_ranks(3, |ranks| {
        let wants = |_: &Vector<2>, _: f64, _: u8| true;
        let mut tree = ImplicitTree::new(Aabb::unit(), [1; 2], [true; 2], 3, &wants).unwrap();
        let cuts = equal_cuts(&tree, ranks);
        FLOW.solve(&mut tree, &cuts, ranks, &walls).err()
    });
    assert_eq!(errors.unwrap(), [(); 3].map(|()| Some(StokesError::NoWall)));
}
