//! Walls, fixed bodies and periodic borders.

use gluey_contact::{
    ContactError, ContactLaw, ContactModel, ContactParams, Domain, PairContact, PairKey, StepGeometry, Wall,
    WithFixed,
};
use gluey_geom::{Aabb, Twist, Vector};

const RATE: f64 = 0.1;

fn inelastic() -> ContactParams {
    ContactParams { law: ContactLaw::Inelastic, ..Default::default() }
}

fn correct<M: gluey_contact::Mobility<2>>(
    contact: &mut PairContact<2, M>,
    positions: &[Vector<2>],
    radii: &[f64],
    velocities: &[Vector<2>],
) -> Result<Vec<Vector<2>>, ContactError> {
    let mut twists: Vec<Twist<2>> =
        velocities.iter().map(|&velocity| Twist { velocity, ..Twist::default() }).collect();
    let drift = vec![Vector::zeros(); radii.len()];
    let step = StepGeometry { positions, radii, drift: &drift, velocity_weight: RATE, dt: RATE };
    contact.correct(&step, &mut twists)?;
    Ok(twists.iter().map(|twist| twist.velocity).collect())
}

fn at(x: f64, y: f64) -> Vector<2> {
    Vector::<2>::new(x, y)
}

#[test]
fn a_corner_stops_a_disc() {
    let mut contact = PairContact::new(inelastic()).within(Domain::inside(&Aabb::unit()));
    let after = correct(&mut contact, &[at(0.25, 0.3)], &[0.2], &[at(-3.0, -2.0)]).expect("feasible");
    // It may come as near as its radius to both walls, and no nearer.
    assert!((after[0] - at(-0.5, -1.0)).norm() < 1e-13, "{after:?}");
    let walls: Vec<_> = contact.contacts().iter().map(|contact| (contact.pair, contact.lambda)).collect();
    assert_eq!(
        walls.iter().map(|wall| wall.0).collect::<Vec<_>>(),
        [PairKey::wall(0, 0), PairKey::wall(0, 2)]
    );
    // lambda = a (u - u*).
    assert!((walls[0].1 - 0.2 * 2.5).abs() < 1e-13 && (walls[1].1 - 0.2 * 1.0).abs() < 1e-13);
}

#[test]
fn a_wall_that_moves_pushes_a_row_of_discs() {
    let wall = Wall { speed: 4.0, ..Wall::new(&at(0.0, 0.0), &at(1.0, 0.0)) };
    let mut contact = PairContact::new(inelastic()).within(Domain::default().with_wall(wall));
    let positions = [at(1.1, 0.0), at(3.2, 0.0), at(9.0, 0.0)];
    let after = correct(&mut contact, &positions, &[1.0; 3], &[at(0.0, 0.0); 3]).expect("feasible");
    // The wall goes 0.4, of which 0.1 and then 0.1 are gaps.
    assert!(
        (after[0] - at(3.0, 0.0)).norm() < 1e-11 && (after[1] - at(2.0, 0.0)).norm() < 1e-11,
        "{after:?}"
    );
    assert_eq!(after[2], at(0.0, 0.0));
}

#[test]
fn a_fixed_disc_is_not_pushed() {
    let mut contact = PairContact::with_mobility(inelastic(), WithFixed::new([0]));
    let positions = [at(0.0, 0.0), at(2.1, 0.0), at(-2.1, 0.0)];
    let after = correct(&mut contact, &positions, &[1.0; 3], &[at(0.0, 0.5), at(-5.0, 0.0), at(1.5, 0.0)]);
    let after = after.expect("feasible");
    assert_eq!(after[0], at(0.0, 0.5));
    assert!((after[1].x + 1.0).abs() < 1e-12 && (after[2].x - 1.0).abs() < 1e-12, "{after:?}");
}

/// Two fixed discs are told to meet, or one to go through a wall; no force can keep them from it.
#[test]
fn motions_that_are_given_may_not_make_discs_overlap() {
    let domain = Domain { walls: vec![Wall::new(&at(0.0, -1.0), &at(0.0, 1.0))], ..Domain::default() };
    let mut contact = PairContact::with_mobility(inelastic(), WithFixed::new([0, 1])).within(domain);
    let positions = [at(0.0, 0.5), at(2.5, 0.5), at(8.0, 0.5)];
    let still = at(0.0, 0.0);
    let mut told = |first: [f64; 2]| {
        let velocity = at(first[0], first[1]) / RATE;
        correct(&mut contact, &positions, &[1.0; 3], &[velocity, still, still])
    };
    assert!(told([0.4, -0.4]).is_ok());
    for (first, gap) in [([1.0, 0.0], -0.5), ([0.0, -1.0], -0.5)] {
        match told(first) {
            Err(ContactError::Given { pair, gap: found }) => {
                assert!(pair.particles().0 == 0 && (found - gap).abs() < 1e-12, "{pair} {found}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn discs_meet_across_the_border_and_their_memory_stays() {
    let domain = Domain::default().with_period(0, 6.0);
    let mut contact = PairContact::new(ContactParams::default()).within(domain);
    let mut positions = [at(0.9, 1.0), at(4.8, 1.0)];
    for step in 0..40 {
        // Towards each other across the border, then away; both drift over it meanwhile.
        let sign = if step < 20 { 1.0 } else { -1.0 };
        let velocities = [at(-sign + 2.0, 0.0), at(sign + 2.0, 0.0)];
        let after = correct(&mut contact, &positions, &[1.0; 2], &velocities).expect("feasible");
        (0..2).for_each(|i| positions[i] += after[i] * RATE);
        let gap = positions[0].x + 6.0 - positions[1].x - 2.0;
        assert!(gap > -1e-12, "step {step}: {gap}");
        if (2..=37).contains(&step) {
            assert_eq!(contact.contacts().len(), 1, "step {step}");
            assert_eq!(contact.contacts()[0].pair, PairKey::across(0, 1, [-1, 0, 0]));
        }
    }
    // Closed for as long in pull as in push: the gap of the start is there again, to a step.
    let gap = positions[0].x + 6.0 - positions[1].x - 2.0;
    assert!((gap - 0.1).abs() <= 2.0 * RATE + 1e-12, "{gap}");
}

#[test]
fn both_images_of_a_neighbour_push() {
    // Two discs in a period barely longer than two diameters: they touch on both sides.
    let domain = Domain::default().with_period(0, 4.02);
    let mut contact = PairContact::new(inelastic()).within(domain);
    let positions = [at(0.0, 0.0), at(2.015, 0.0)];
    let after =
        correct(&mut contact, &positions, &[1.0; 2], &[at(1.0, 0.0), at(0.0, 0.0)]).expect("feasible");
    let [left, right] = [after[0].x, after[1].x];
    assert!((RATE * (left - right) - 0.015).abs() < 1e-12, "{left} {right}");
    let back =
        correct(&mut contact, &positions, &[1.0; 2], &[at(-1.0, 0.0), at(0.0, 0.0)]).expect("feasible");
    assert!((RATE * (back[1].x - back[0].x) - 0.005).abs() < 1e-12, "{back:?}");
}

#[test]
fn a_disc_between_walls_that_close_is_named() {
    let closing = |point, direction| Wall { speed: 1.0, ..Wall::new(&point, &direction) };
    let domain = Domain::default()
        .with_wall(closing(at(0.0, 0.0), at(1.0, 0.0)))
        .with_wall(closing(at(2.1, 0.0), at(-1.0, 0.0)));
    for solver in [
        gluey_contact::SolverKind::Uzawa,
        gluey_contact::SolverKind::Accelerated,
        gluey_contact::SolverKind::ActiveSet,
    ] {
        let params = ContactParams { solver, ..inelastic() };
        let mut contact = PairContact::new(params).within(domain.clone());
        let positions = [at(0.5, 9.0), at(1.05, 0.0)];
        let error = correct(&mut contact, &positions, &[0.1, 1.0], &[at(0.0, 0.0); 2]).expect_err("squeezed");
        let pairs = vec![PairKey::wall(1, 0), PairKey::wall(1, 1)];
        assert_eq!(error, ContactError::Infeasible { pairs }, "{solver:?}");
        let text = "no velocities keep these contacts from overlapping: particle 2 and wall 1; particle 2 and wall 2";
        assert_eq!(error.to_string(), text);
    }
}

#[test]
fn bad_surroundings_are_refused() {
    let refuse = |domain: Domain<2>, x: f64, velocity: f64| {
        let mut contact = PairContact::new(inelastic()).within(domain);
        correct(&mut contact, &[at(x, 0.0), at(4.0, 0.0)], &[1.0; 2], &[at(velocity, 0.0), at(0.0, 0.0)])
            .expect_err("refused")
    };
    let periodic = |length| Domain::default().with_period(0, length);
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refuse(periodic(period), 0.0, 0.0), ContactError::BadPeriod { direction: 0, .. }));
    }
    let large = ContactError::ParticleTooLarge { particle: 0, radius: 1.0, direction: 0, period: 3.9 };
    assert_eq!(refuse(periodic(3.9), 0.0, 0.0), large);
    assert!(matches!(refuse(periodic(8.0), 0.0, 900.0), ContactError::TooFast { particle: 0, .. }));
    for (tilt, tilt_step) in [(f64::NAN, 0.0), (0.0, f64::NAN), (1e9, 0.0), (0.0, -4.1)] {
        let mut sheared = Domain::periodic(&at(8.0, 8.0));
        sheared.set_sliding(tilt, tilt_step);
        assert!(matches!(refuse(sheared, 0.0, 0.0), ContactError::BadTilt { .. }), "{tilt} {tilt_step}");
    }
    let mut wall = Wall::new(&at(0.0, 0.0), &at(1.0, 0.0));
    wall.normal *= 2.0;
    assert_eq!(refuse(Domain::default().with_wall(wall), 0.0, 0.0), ContactError::BadWall { wall: 0 });
}

#[test]
fn wrapped_positions_are_noticed() {
    let mut contact =
        PairContact::new(ContactParams::default()).within(Domain::default().with_period(0, 8.0));
    let radii = [1.0; 2];
    let pressed = [at(1.0, 0.0), at(-1.0, 0.0)];
    correct(&mut contact, &[at(3.0, 0.0), at(5.0, 0.0)], &radii, &pressed).expect("feasible");
    let error = correct(&mut contact, &[at(3.0, 0.0), at(-3.0, 0.0)], &radii, &pressed).expect_err("wrapped");
    let ContactError::Wrapped { pair, gap } = error else { panic!("{error}") };
    assert_eq!((pair, gap), (PairKey::new(0, 1), 4.0));
}

/// With the forces of two steps in the impulse a contact that was pulled open remembers a force that fades.
/// Meanwhile its particles go far, here beyond half of the period.
#[test]
fn a_contact_that_was_pulled_open_goes_its_way() {
    let mut contact =
        PairContact::new(ContactParams::default()).within(Domain::default().with_period(0, 8.0));
    let (dt, speed) = (0.1, 1.0);
    let mut positions = [at(2.0, 0.0), at(4.01, 0.0)];
    let mut last = [at(0.0, 0.0); 2];
    let mut farthest = 0.0_f64;
    for n in 0..40 {
        let predicted = if n < 4 { speed } else { -speed };
        let mut twists =
            [1.0, -1.0].map(|sign| Twist::<2> { velocity: at(sign * predicted, 0.0), ..Twist::default() });
        // Adams-Bashforth, after one step of Euler.
        let [now, before] = if n == 0 { [dt, 0.0] } else { [1.5 * dt, -0.5 * dt] };
        let drift = last.map(|velocity| velocity * before);
        let (radii, velocity_weight) = (&[1.0; 2], now);
        let step = StepGeometry { positions: &positions, radii, drift: &drift, velocity_weight, dt };
        contact.correct(&step, &mut twists).unwrap_or_else(|error| panic!("step {n}: {error}"));
        for (i, twist) in twists.iter().enumerate() {
            positions[i] += twist.velocity * now + drift[i];
            last[i] = twist.velocity;
        }
        if !contact.contacts().is_empty() {
            farthest = farthest.max(positions[1].x - positions[0].x - 2.0);
        }
    }
    assert!(farthest > 2.0, "nothing was remembered beyond a gap of {farthest}");
}
