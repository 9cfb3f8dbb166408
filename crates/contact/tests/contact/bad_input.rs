//! Errors of a contact step, and that they say which particles they mean.

use gluey_contact::{
    ContactError, ContactLaw, ContactModel, ContactParams, ContactState, PairContact, PairKey, PairState,
    SolverKind, StepGeometry,
};
use gluey_geom::{Twist, Vector};

struct Input {
    positions: Vec<Vector<2>>,
    radii: Vec<f64>,
    drift: Vec<Vector<2>>,
    twists: Vec<Twist<2>>,
    rate: f64,
    state: ContactState,
    params: ContactParams,
}

/// Three discs in a row, the outer ones running at the middle one.
fn input() -> Input {
    let run = |x| Twist { velocity: Vector::<2>::new(x, 0.0), ..Twist::default() };
    Input {
        positions: [0.0, 2.1, 4.2].map(|x| Vector::<2>::new(x, 0.0)).to_vec(),
        radii: vec![1.0; 3],
        drift: vec![Vector::zeros(); 3],
        twists: vec![run(2.0), run(0.0), run(-2.0)],
        rate: 0.1,
        state: ContactState::default(),
        params: ContactParams::default(),
    }
}

/// The error, having checked that velocities and memory are untouched.
fn refuse(change: impl FnOnce(&mut Input)) -> ContactError {
    let mut input = input();
    change(&mut input);
    let mut contact = PairContact::new(input.params);
    contact.resume(input.state).expect("a memory");
    let before = contact.checkpoint();
    let mut twists = input.twists.clone();
    let step = StepGeometry {
        positions: &input.positions,
        radii: &input.radii,
        drift: &input.drift,
        velocity_weight: input.rate,
        dt: 0.1,
    };
    let error = contact.correct(&step, &mut twists).expect_err("must be refused");
    assert_eq!(format!("{twists:?}"), format!("{:?}", input.twists));
    assert_eq!(contact.checkpoint(), before);
    error
}

#[test]
fn particles_are_named() {
    let nan = Vector::<2>::new(0.0, f64::NAN);
    for law in ContactLaw::ALL {
        let refuse = |change: fn(&mut Input)| {
            refuse(|input| {
                input.params.law = law;
                change(input);
            })
        };
        assert_eq!(refuse(|i| i.radii[1] = 0.0), ContactError::BadRadius { particle: 1, radius: 0.0 });
        assert_eq!(refuse(|i| i.radii[2] = -1.0), ContactError::BadRadius { particle: 2, radius: -1.0 });
        assert!(matches!(refuse(|i| i.radii[0] = f64::NAN), ContactError::BadRadius { particle: 0, .. }));
        assert!(matches!(refuse(|i| i.rate = 0.0), ContactError::BadStep { .. }));
        let mismatch = ContactError::LengthMismatch { positions: 3, radii: 2, drifts: 3, twists: 3 };
        assert_eq!(refuse(|i| i.radii.truncate(2)), mismatch);
    }
    let not_finite =
        |particle, quantity: &str| ContactError::NotFinite { particle, quantity: quantity.to_owned() };
    assert_eq!(refuse(|i| i.positions[2] = nan), not_finite(2, "position"));
    assert_eq!(refuse(|i| i.twists[1].velocity = nan), not_finite(1, "velocity"));
    assert_eq!(refuse(|i| i.drift[0].x = f64::INFINITY), not_finite(0, "drift"));
}

/// Indices in errors are from 0, numbers in messages from 1, as in case files.
#[test]
fn messages_count_from_one() {
    let message = |error: ContactError| error.to_string();
    let pair = PairKey::new(0, 6);
    for (text, expected) in [
        (message(ContactError::BadRadius { particle: 0, radius: -1.0 }), "particle 1 has the radius -1"),
        (
            message(ContactError::NotFinite { particle: 2, quantity: "drift".to_owned() }),
            "particle 3: its drift",
        ),
        (message(ContactError::BadWall { wall: 1 }), "wall 2 needs"),
        (message(ContactError::BadPeriod { direction: 2, period: 0.0 }), "the period 0 along z"),
        (
            message(ContactError::ParticleTooLarge { particle: 0, radius: 1.0, direction: 0, period: 2.0 }),
            "particle 1 of radius 1 is too large for the period 2 along x",
        ),
        (message(ContactError::TooFast { particle: 9, displacement: 3.0, period: 2.0 }), "particle 10 moves"),
        (message(ContactError::Entangled { pair }), "the cores of particles 1 and 7"),
        (message(ContactError::Wrapped { pair, gap: 3.0 }), "the gap of particles 1 and 7"),
        (PairKey::across(0, 1, [1, 0, 0]).to_string(), "particles 1 and 2 (its image [1, 0, 0])"),
        (PairKey::wall(3, 0).to_string(), "particle 4 and wall 1"),
    ] {
        assert!(text.starts_with(expected), "{text}");
    }
}

#[test]
fn coincident_centres_are_named() {
    for law in [ContactLaw::VelocityCorrection, ContactLaw::Inelastic, ContactLaw::Gluey] {
        let error = refuse(|input| {
            input.params.law = law;
            input.positions[2] = input.positions[0];
            input.twists[2] = input.twists[0];
        });
        assert_eq!(error, ContactError::Coincident { pair: PairKey::new(0, 2) }, "{law}");
        assert_eq!(error.to_string(), "the centres of particles 1 and 3 coincide");
    }
}

#[test]
fn a_memory_of_missing_particles_is_named() {
    let pair = PairKey::new(1, 7);
    let error = refuse(|input| input.state.pairs = vec![PairState { pair, gamma: -1.0, lambda: 0.0 }]);
    assert_eq!(error, ContactError::UnknownParticle { pair, count: 3 });
}

#[test]
fn too_few_iterations_are_told_with_the_way_there() {
    let error = refuse(|input| input.params.iteration_limit = 3);
    let ContactError::NotConverged { residual, tolerance, iterations, history, .. } = error else {
        panic!("not what was expected: {error}");
    };
    assert_eq!(iterations, 3);
    assert!(residual > tolerance && tolerance > 0.0);
    assert_eq!(history.entries.iter().map(|entry| entry.0).collect::<Vec<_>>(), [1, 2, 3]);
    assert_eq!(history.entries[2].1, residual);
}

#[test]
fn infeasible_contacts_end_with_an_error() {
    // The outer discs cannot be 2 away from the middle one and 2 from each other, all on a line.
    let pairs = [(0, 1), (1, 2), (0, 2)].map(|(i, j)| PairKey::new(i, j));
    for exact_gap in [false, true] {
        let error = refuse(|input| {
            input.params.exact_gap = exact_gap;
            input.params.iteration_limit = 2000;
            input.state.pairs =
                pairs.iter().map(|&pair| PairState { pair, gamma: -1.0, lambda: 0.0 }).collect();
        });
        assert_eq!(
            error,
            ContactError::Infeasible {
                pairs: vec![PairKey::new(0, 1), PairKey::new(0, 2), PairKey::new(1, 2)]
            }
        );
    }
}

#[test]
fn too_few_linearisations_are_told() {
    let error = refuse(|input| {
        input.params.exact_gap = true;
        input.params.pass_limit = 1;
        input.twists[1].velocity.y = 5.0;
    });
    assert!(matches!(error, ContactError::GapNotClosed { passes: 1, .. }), "{error}");
}

/// A memory that pulls, or is no number, came from elsewhere: resuming keeps what was there.
#[test]
fn memories_that_no_step_leaves_are_refused() {
    let pair = PairKey::new(0, 1);
    let good =
        ContactState { pairs: vec![PairState { pair, gamma: -1.0, lambda: 0.5 }], ..ContactState::default() };
    for (gamma, lambda) in
        [(1e-9, 0.0), (f64::NAN, 0.0), (f64::NEG_INFINITY, 0.0), (-1.0, f64::NAN), (0.0, f64::INFINITY)]
    {
        let mut contact = PairContact::<2>::new(ContactParams::default());
        contact.resume(good.clone()).expect("a memory");
        let bad = ContactState { pairs: vec![PairState { pair, gamma, lambda }], ..ContactState::default() };
        let error = contact.resume(bad).expect_err("must be refused");
        assert_eq!(error.pair, pair);
        assert!(error.to_string().contains("particles 1 and 2"), "{error}");
        assert_eq!(contact.checkpoint(), good);
    }
}

#[test]
fn nothing_is_no_error() {
    let mut contact = PairContact::<3>::new(ContactParams::default());
    let step = StepGeometry { positions: &[], radii: &[], drift: &[], velocity_weight: 0.1, dt: 0.1 };
    let report = contact.correct(&step, &mut []).expect("no particles, no contacts");
    assert_eq!(report.pair_count, 0);
    assert!(contact.contacts().is_empty());
}

#[test]
fn contact_laws_and_solvers_have_names() {
    for law in ContactLaw::ALL {
        assert_eq!(law.to_string().parse(), Ok(law));
    }
    assert!("sticky".parse::<ContactLaw>().is_err());
    for (solver, name) in SolverKind::ALL.into_iter().zip(SolverKind::NAMES) {
        assert_eq!((solver.to_string().as_str(), name.parse()), (name, Ok(solver)));
    }
    assert!("newton".parse::<SolverKind>().is_err());
}
