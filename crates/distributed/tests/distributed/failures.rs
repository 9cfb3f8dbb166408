//! A rank that fails, wherever it is: all ranks end, and say the same.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use gluey_contact::{ContactParams, Domain, PairContact, StepGeometry, WithFixed};
use gluey_distributed::{BoxFlow, SharedContact, SharedSuspension, SuspensionError};
use gluey_geom::{Twist, Vector, Wrench};
use gluey_motion::Configuration;
use gluey_parallel::Ranks;
use gluey_stokes::{Lubrication, Refinement, StokesError, Suspension};
use gluey_testkit::failing::{Failing, TOLD, within_a_minute};

use crate::support::{self, on_ranks};

const RANKS: usize = 3;
/// Agreements of one computation; nothing here takes as many.
const MANY: usize = 100;

/// What ranks say when one of them fails, at each of their agreements in turn, by the numbers of these.
fn fail_in_turn(
    what: &'static str,
    fewest: usize,
    work: impl Fn(&Ranks) -> Option<String> + Send + Sync + 'static,
) {
    let work = Arc::new(work);
    let on_ranks = |fault: (usize, usize)| {
        let work = work.clone();
        let run = move || {
            on_ranks(RANKS, |ranks| {
                let ranks = Failing::new(ranks, fault.0, fault.1);
                let agreements = ranks.agreements();
                (work(&Ranks::new(ranks)), agreements.load(Ordering::Relaxed))
            })
            .unwrap()
        };
        within_a_minute(what, run)
    };
    let sound = on_ranks((0, usize::MAX));
    let count = sound[0].1;
    println!("{what}: {count} agreements");
    assert!(sound.iter().all(|end| end == &(None, count)), "{what}: {sound:?}");
    assert!((fewest..MANY).contains(&count), "{what}: {count} agreements");
    for fault in (0..count).map(|at| (at % RANKS, at)) {
        let ends = on_ranks(fault);
        let said = |end: &(Option<String>, usize)| end.0.as_ref().is_some_and(|text| text.contains(TOLD));
        assert!(ends.iter().all(said), "{what}, rank and agreement {fault:?}: {ends:?}");
        assert!(ends.iter().all(|end| end.0 == ends[0].0), "{what}, {fault:?}: {ends:?}");
        assert!(ends.iter().all(|end| end.1 == fault.1 + 1), "{what}, {fault:?}: nobody goes on, {ends:?}");
    }
}

/// Two particles, between walls or in a box that is sheared for ever.
fn suspension<const D: usize>(lubrication: Lubrication, is_sheared: bool) -> Suspension<D> {
    let refinement = Refinement { coarsest: 3, surface: 4, band: 2.0 };
    Suspension {
        periods: std::array::from_fn(|d| (is_sheared || d == 0).then_some(1.0)),
        wrenches: vec![Wrench::default(); 2],
        ..support::suspension(refinement, lubrication, vec![0.14; 2])
    }
}

/// What its flow fails with, around particles at these heights.
fn failure<const D: usize>(
    suspension: &Suspension<D>,
    ranks: &Ranks,
    heights: [f64; 2],
) -> Option<SuspensionError> {
    let place = |k: usize| Vector::from_fn(|d, _| [[0.3, 0.7][k], heights[k], 0.5][d]);
    let particles = suspension.particles(&[place(0), place(1)]);
    let flow = BoxFlow { viscosity: 1.0, tolerance: 1e-6, max_iterations: 500 };
    let shared = SharedSuspension { flow, suspension: suspension.clone() };
    shared.solve(ranks, &Configuration::at(0.0, &particles)).err()
}

fn a_flow_fails_as_one<const D: usize>(what: &'static str, fewest: usize, of: Suspension<D>) {
    fail_in_turn(what, fewest, move |ranks| failure(&of, ranks, [0.55, 0.45]).map(|error| error.to_string()));
}

/// Levels, matrices of pressures, surfaces, data, what is measured of the flow.
#[test]
fn a_rank_that_fails_anywhere_in_a_flow_ends_all() {
    a_flow_fails_as_one("without films", 10, suspension::<2>(Lubrication::None, false));
    a_flow_fails_as_one("between walls", 10, suspension::<2>(Lubrication::Deficit, false));
    a_flow_fails_as_one("spheres", 10, suspension::<3>(Lubrication::Deficit, false));
    let stressed = Suspension { shear_stress: Some(1.0), ..suspension::<2>(Lubrication::Deficit, true) };
    a_flow_fails_as_one("at a given stress", 11, stressed);
    let held = vec![Some(Twist::default()), None];
    a_flow_fails_as_one(
        "held",
        17,
        Suspension { given: held, ..suspension::<2>(Lubrication::Deficit, true) },
    );
}

/// A line of discs that are pressed together.
#[test]
fn a_rank_that_fails_anywhere_in_contact_ends_all() {
    let positions: Vec<Vector<2>> =
        (0..30).map(|k| Vector::<2>::new(f64::from(k), 0.01 * f64::from(k).sin())).collect();
    fail_in_turn("contact", 3, move |ranks| {
        let contact = PairContact::with_mobility(ContactParams::default(), WithFixed::new([]));
        let mut shared = SharedContact::new(contact.within(Domain::default()), ranks);
        let (radii, drift) = (vec![0.5; 30], vec![Vector::zeros(); 30]);
        let toward = |x: &Vector<2>| Twist { velocity: -x * 0.1, ..Twist::default() };
        let mut twists: Vec<Twist<2>> = positions.iter().map(toward).collect();
        let step = StepGeometry {
            positions: &positions,
            radii: &radii,
            drift: &drift,
            velocity_weight: 0.05,
            dt: 0.05,
        };
        shared.correct(&step, &mut twists).err().map(|error| error.to_string())
    });
}

/// What follows from what all know is the same error on all.
#[test]
fn bodies_that_are_too_small_are_so_on_all_ranks() {
    let small = Suspension { radii: vec![0.001; 2], ..suspension::<2>(Lubrication::Deficit, false) };
    let run = move || on_ranks(RANKS, |ranks| failure(&small, ranks, [0.5; 2]).unwrap()).unwrap();
    let errors = within_a_minute("small bodies", run);
    assert!(errors.iter().all(|error| *error == errors[0]), "{errors:?}");
    assert!(matches!(errors[0], SuspensionError::Flow(StokesError::Unresolved { .. })), "{errors:?}");
}
