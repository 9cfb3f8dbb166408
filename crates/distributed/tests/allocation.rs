//! What a rank allocates shrinks with the number of ranks: no array is as large as the mesh.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

use gluey_distributed::{BoxFlow, SharedSuspension};
use gluey_geom::{Aabb, Vector};
use gluey_motion::Configuration;
use gluey_parallel::{Ranks, Threads};
use gluey_stokes::{Lubrication, Refinement, Suspension};
use gluey_testkit::allocation::{CountingAllocator, largest_in_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const RANKS: usize = 16;

/// The most bytes of one allocation of a rank, among all.
fn largest<const D: usize>(lubrication: Lubrication, level: u8, ranks: usize) -> usize {
    // Libraries take what they need once in each thread, whatever the mesh.
    let [small, whole] = [4, level].map(|level| suspension::<D>(lubrication, level));
    // They nearly touch, so that there is a gap.
    let places = [[0.3, 0.4, 0.5], [0.651, 0.4, 0.5]].map(|x| Vector::<D>::from_fn(|d, _| x[d]));
    let particles = small.suspension.particles(&places);
    let solve = |suspension: &SharedSuspension<D>, ranks: &Ranks| {
        suspension.solve(ranks, &Configuration::at(0.0, &particles)).unwrap().flow.iteration_count
    };
    let found = Threads::run(ranks, |ranks| {
        solve(&small, ranks);
        largest_in_thread(|| solve(&whole, ranks)).1
    });
    found.unwrap().into_iter().max().unwrap()
}

/// Two bodies among cells of one level.
fn suspension<const D: usize>(lubrication: Lubrication, level: u8) -> SharedSuspension<D> {
    let flow = BoxFlow { viscosity: 1.0, tolerance: 1e-3, max_iterations: 50 };
    let suspension = Suspension {
        domain: Aabb::unit(),
        roots: [1; D],
        periods: [None; D],
        refinement: Refinement { coarsest: level, ..Refinement::to_level(level) },
        lubrication,
        radii: vec![0.2, 0.15],
        wrenches: Vec::new(),
        given: Vec::new(),
        force_density: None,
        shear_rate: 1.0,
        shear_stress: None,
    };
    SharedSuspension { flow, suspension }
}

/// A rank holds its part of the whole and what is around it.
fn allocations_shrink<const D: usize>(lubrication: Lubrication, level: u8, share: f64) {
    let (alone, shared) = (largest::<D>(lubrication, level, 1), largest::<D>(lubrication, level, RANKS));
    let nodes = ((1usize << (level + 1)) + 1).pow(D as u32);
    assert!(alone >= nodes * D * size_of::<f32>(), "one rank has vectors of all velocities: {alone}");
    println!("{alone} and {shared}");
    assert!((shared as f64) < share * alone as f64, "{shared} of {alone}");
}

/// In 2D; in 3D the coarsest level and blocks of dense products are as large as a mesh that tests have time
/// for.
#[test]
fn no_rank_allocates_an_array_as_large_as_the_mesh() {
    allocations_shrink::<2>(Lubrication::None, 9, 0.2);
    allocations_shrink::<2>(Lubrication::Deficit, 9, 0.2);
}
