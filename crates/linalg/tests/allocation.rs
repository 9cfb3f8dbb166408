//! After their first use the methods allocate nothing.

mod support;

use std::sync::Arc;

use gluey_linalg::{
    Chebyshev, DirectIndefinite, DirectSpd, Gcr, GcrParams, Guess, Identity, IndefiniteParams, Jacobi,
    Ordering, Reference, RefinementParams, SpectralInterval, Symbolic,
};
use gluey_testkit::allocation::{CountingAllocator, count_in_thread};
use support::{Rounded, laplacian_2d, pseudo_random};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Allocations of the first and of the second run.
fn first_and_second(mut work: impl FnMut()) -> (usize, usize) {
    (count_in_thread(&mut work).1, count_in_thread(&mut work).1)
}

#[test]
fn iterative_methods_reuse_their_workspace() {
    let mut a = laplacian_2d(20);
    let b = pseudo_random(1, 400);
    let mut x = vec![0.0; 400];
    let mut jacobi = Jacobi::new(&a.diagonal()).expect("positive");

    let mut gcr = Gcr::new(GcrParams::default());
    let (first, second) = first_and_second(|| {
        x.fill(0.0);
        gcr.solve(&mut a, &mut Identity, &b, &mut x, Reference::RightHandSide).expect("converges");
    });
    assert!(first > 0 && second == 0, "GCR: {first}, {second}");

    let mut narrow = Gcr::<f64, f32>::with_steps(GcrParams::default());
    let (mut wide_a, mut rounded) = (Rounded::new(400, a.clone()), Rounded::new(400, jacobi.clone()));
    let (first, second) = first_and_second(|| {
        x.fill(0.0);
        narrow.solve(&mut wide_a, &mut rounded, &b, &mut x, Reference::RightHandSide).expect("converges");
    });
    assert!(first > 0 && second == 0, "GCR in single precision: {first}, {second}");

    let mut chebyshev = Chebyshev::new(400, 4, SpectralInterval { lower: 0.1, upper: 2.0 });
    let (first, second) = first_and_second(|| {
        chebyshev.smooth(&mut a, &mut jacobi, &b, &mut x, Guess::Given);
    });
    assert_eq!((first, second), (0, 0), "all of it is there from the start");
}

#[test]
fn direct_solvers_allocate_when_they_are_made() {
    let a = laplacian_2d(20);
    let b = pseudo_random(1, 400);
    let mut x = vec![0.0; 400];
    let symbolic = Arc::new(Symbolic::new(a.pattern().clone(), Ordering::Amd).expect("symmetric"));
    let mut indefinite = DirectIndefinite::new(symbolic.clone(), IndefiniteParams::default()).expect("fits");
    let mut spd = DirectSpd::new(symbolic, RefinementParams::default()).expect("fits");
    let (_, second) = first_and_second(|| {
        indefinite.factorise(a.values()).expect("regular");
        indefinite.solve(&b, &mut x).expect("solvable");
        spd.factorise(a.values()).expect("positive definite");
        spd.solve(&b, &mut x).expect("solvable");
    });
    assert_eq!(second, 0);
}
