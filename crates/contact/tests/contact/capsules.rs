//! Capsules against closed forms, and against discs and spheres.

use std::f64::consts::PI;

use gluey_contact::shape::{Capsule, Shape, ShapeContact, displaced, gap};
use gluey_contact::{
    BodyStep, ContactError, ContactLaw, ContactModel, ContactParams, GammaUpdate, PairContact, PairKey,
    SolverKind, StepGeometry, WithFixed,
};
use gluey_geom::{Dim, Particle, Pose, Spin, Twist, Vector};
use gluey_motion::{BackgroundFlow, Configuration, Hydrodynamics, Integrator, LinearFlow, Scheme};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn exact(law: ContactLaw) -> ContactParams {
    ContactParams {
        law,
        exact_gap: true,
        gamma_update: GammaUpdate::Consistent,
        solver: SolverKind::ActiveSet,
        ..Default::default()
    }
}

/// Steps bodies by explicit Euler.
struct World<const D: usize, S, M> {
    poses: Vec<Pose<D>>,
    contact: ShapeContact<D, S, M>,
    dt: f64,
}

impl<const D: usize, S: Shape<D>, M: gluey_contact::Mobility<D>> World<D, S, M> {
    fn step(&mut self, predict: impl Fn(&Pose<D>) -> Twist<D>) -> Vec<Twist<D>> {
        let mut twists: Vec<Twist<D>> = self.poses.iter().map(predict).collect();
        let drift = vec![Twist::default(); twists.len()];
        let (poses, dt) = (&self.poses, self.dt);
        let step = BodyStep { poses, radii: &[], drift: &drift, velocity_weight: dt, dt };
        self.contact.correct_bodies(&step, &mut twists).unwrap_or_else(|error| panic!("{error}"));
        for (pose, twist) in self.poses.iter_mut().zip(&twists) {
            *pose = displaced(pose, &(*twist * dt));
        }
        twists
    }

    fn smallest_gap(&self) -> f64 {
        let mut smallest = f64::INFINITY;
        for j in 1..self.poses.len() {
            for i in 0..j {
                let shapes = [i, j].map(|body| &self.contact.shapes()[body]);
                let gap = gap(shapes, [&self.poses[i], &self.poses[j]]).expect("cores apart");
                smallest = smallest.min(gap);
            }
        }
        smallest
    }
}

/// A cloud squeezed together, then pulled apart: capsules of no length and round particles.
fn check_round<const D: usize>(params: ContactParams) {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let count = 3usize.pow(D as u32);
    let positions: Vec<Vector<D>> = (0..count)
        .map(|i| {
            Vector::from_fn(|d, _| {
                2.5 * (i / 3usize.pow(d as u32) % 3) as f64 + random.random_range(-0.2..0.2)
            })
        })
        .collect();
    let radii: Vec<f64> = (0..count).map(|_| random.random_range(0.7..1.0)).collect();
    let centre = Vector::<D>::repeat(2.5);
    let dt = 0.05;
    let shapes = radii.iter().map(|&radius| Capsule::new(Vector::<D>::zeros(), radius)).collect();
    let mut world = World {
        poses: positions.iter().map(|x| Pose::at(*x)).collect(),
        contact: ShapeContact::new(params.clone(), shapes),
        dt,
    };
    let (mut round, mut positions) = (PairContact::new(params), positions);
    let drift = vec![Vector::zeros(); count];
    let mut most = 0;
    for n in 0..20 {
        let sign = if n < 10 { -1.0 } else { 1.0 };
        let flow = |x: &Vector<D>| Twist { velocity: (x - centre) * sign, ..Twist::default() };
        let mut twists: Vec<Twist<D>> = positions.iter().map(flow).collect();
        let step =
            StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight: dt, dt };
        round.correct(&step, &mut twists).expect("a good step");
        positions.iter_mut().zip(&twists).for_each(|(x, twist)| *x += twist.velocity * dt);

        let others = world.step(|pose| flow(&pose.position));
        for (one, other) in twists.iter().zip(&others) {
            assert!((one.velocity - other.velocity).norm() < 1e-9, "step {n}: {one:?} {other:?}");
            assert!(Dim::<D>::spin_slice(&other.spin).iter().all(|w| w.abs() < 1e-12), "{other:?}");
        }
        assert_eq!(round.contacts().len(), world.contact.contacts().len());
        for (one, other) in round.contacts().iter().zip(world.contact.contacts()) {
            assert_eq!(one.pair, other.pair);
            assert!((one.gamma - other.gamma).abs() < 1e-8, "step {n}: {one:?} {other:?}");
        }
        most = most.max(round.contacts().len());
    }
    assert!(most > count, "{most} contacts");
}

/// Two balls in a shear flow, stepped by Adams-Bashforth 2 as a simulation does; where they end.
fn encounter<const D: usize>(mut contact: impl ContactModel<D>) -> [Pose<D>; 2] {
    let at = |x: f64, y: f64| Vector::<D>::from_fn(|d, _| [x, y, 0.0][d]);
    let mut particles = [Particle::new(at(-2.0, 0.3), 1.0), Particle::new(at(2.0, -0.3), 1.0)];
    let mut flow = BackgroundFlow::new(LinearFlow::shear(1.0, 0.0));
    let mut integrator = Integrator::new(Scheme::AdamsBashforth2);
    let (mut contact_count, dt) = (0, 0.05);
    for step in 0..120 {
        let now = Configuration::at(step as f64 * dt, &particles);
        let mut twists = flow.predict(&now).expect("no forces").twists;
        let corrected =
            integrator.with_step(dt, &particles, |step| contact.correct_bodies(step, &mut twists));
        corrected.expect("a good step");
        contact_count += contact.contacts().len();
        integrator.advance(dt, &mut particles, &twists);
    }
    assert!(contact_count > 20, "{contact_count}");
    particles.map(|particle| particle.pose)
}

#[test]
fn every_model_takes_the_steps_of_a_simulation() {
    fn check<const D: usize>() {
        let ball = Capsule::new(Vector::<D>::zeros(), 1.0);
        let [round, capsules] = [
            encounter(PairContact::<D>::new(exact(ContactLaw::Gluey))),
            encounter(ShapeContact::new(exact(ContactLaw::Gluey), vec![ball; 2])),
        ];
        for (one, other) in round.iter().zip(&capsules) {
            assert!((one.position - other.position).norm() < 1e-10, "{one:?} {other:?}");
        }
    }
    check::<2>();
    check::<3>();
}

#[test]
fn capsules_of_no_length_are_round() {
    for law in [ContactLaw::Inelastic, ContactLaw::Gluey] {
        for exact_gap in [false, true] {
            check_round::<2>(ContactParams { exact_gap, ..exact(law) });
            check_round::<3>(ContactParams { exact_gap, ..exact(law) });
        }
    }
}

/// An oblique capsule falls with `u = -e_y` on a long fixed one along x: the tip is held, the rest falls on.
fn check_fall<const D: usize>() {
    let (half, radius, angle, dt) = (1.5, 0.5, 0.4f64, 1e-3);
    let axis =
        |length: f64, angle: f64| Vector::<D>::from_fn(|d, _| length * [angle.cos(), angle.sin(), 0.0][d]);
    let lowest = 2.0 * radius + half * angle.sin();
    let shapes = [Capsule::new(axis(half, angle), radius), Capsule::new(axis(20.0, 0.0), radius)];
    let start = 2e-4;
    let at = |height: f64| Vector::<D>::from_fn(|d, _| if d == 1 { height } else { 0.0 });
    let poses = [Pose::at(at(lowest + start)), Pose::at(Vector::zeros())];
    let mut twists = [Twist { velocity: at(-1.0), ..Twist::default() }, Twist::default()];
    let drift = [Twist::default(); 2];
    let step = BodyStep { poses: &poses, radii: &[], drift: &drift, velocity_weight: dt, dt };
    let params = ContactParams { exact_gap: false, ..exact(ContactLaw::Gluey) };
    let mut contact = ShapeContact::with_mobility(params, shapes.to_vec(), WithFixed::new([1]));
    contact.correct_bodies(&step, &mut twists).expect("a good step");

    // The tip is at -half (cos, sin); the normal from capsule 0 to 1 is -e_y; (r x n) = half cos.
    let a = shapes[0].drag_radius();
    let arm = half * angle.cos();
    let compliance = 1.0 / a + arm * arm * 3.0 / (4.0 * a.powi(3));
    let lambda = -(start - dt) / (dt * compliance);
    assert!((contact.contacts()[0].lambda - lambda).abs() < 1e-10, "{:?} {lambda}", contact.contacts());
    assert!((twists[0].velocity - at(-1.0 + lambda / a)).norm() < 1e-10);
    // The held end is at -x, so that the other goes down: clockwise.
    let spin = -lambda * arm * 3.0 / (4.0 * a.powi(3));
    let found = *Dim::<D>::spin_slice(&twists[0].spin).last().expect("a spin");
    assert!(spin < 0.0 && (found - spin).abs() < 1e-10, "{found} {spin}");
    assert_eq!(twists[1], Twist::default());
}

#[test]
fn an_oblique_capsule_turns_as_it_lands() {
    check_fall::<2>();
    check_fall::<3>();
}

#[test]
fn a_landing_capsule_comes_to_lie_flat() {
    let shapes = vec![
        Capsule::new(Vector::<2>::new(1.5 * 0.4f64.cos(), 1.5 * 0.4f64.sin()), 0.5),
        Capsule::new(Vector::<2>::new(20.0, 0.0), 0.5),
    ];
    let poses = vec![Pose::at(Vector::<2>::new(0.3, 1.7)), Pose::at(Vector::zeros())];
    let contact = ShapeContact::with_mobility(exact(ContactLaw::Inelastic), shapes, WithFixed::new([1]));
    let mut world = World { poses, contact, dt: 0.02 };
    for n in 0..300 {
        world.step(|pose| match pose.position.y > 0.5 {
            true => Twist { velocity: -Vector::<2>::y(), ..Twist::default() },
            false => Twist::default(),
        });
        assert!(world.smallest_gap() > -1e-11, "step {n}: {:e}", world.smallest_gap());
    }
    let start = Dim::<2>::advance(&Dim::<2>::identity(), &Spin::<2>::new(-0.4), 1.0);
    let angle = world.poses[0].orientation.angle_to(&start);
    assert!(angle < 1e-9, "{angle:e}");
    assert!((world.poses[0].position.y - 1.0).abs() < 1e-9);
}

/// Two crossed capsules, off centre so that they turn, pushed together and pulled apart again as long.
fn push_and_pull(params: ContactParams, step_count: usize) -> f64 {
    let half = [Vector::<3>::new(2.0, 0.0, 0.3), Vector::<3>::new(0.2, 2.0, 0.0)];
    let start = [Vector::<3>::new(0.4, 0.3, -0.7), Vector::<3>::new(0.0, 0.0, 0.7)].map(Pose::at);
    let mut world = World {
        poses: start.to_vec(),
        contact: ShapeContact::new(params, half.map(|half| Capsule::new(half, 0.5)).to_vec()),
        dt: 1.0 / step_count as f64,
    };
    let mut deepest = 0.0f64;
    for n in 0..2 * step_count {
        let sign = if n < step_count { 1.0 } else { -1.0 };
        let twists: Vec<_> = [1.0, -1.0]
            .map(|side| Twist { velocity: Vector::<3>::z() * (sign * side), ..Twist::default() })
            .to_vec();
        let next = std::cell::Cell::new(0);
        world.step(|_| twists[next.replace(next.get() + 1)]);
        assert!(world.smallest_gap() > -1e-11, "step {n}: {:e}", world.smallest_gap());
        deepest = world.contact.contacts().iter().map(|contact| contact.gamma).fold(deepest, f64::min);
    }
    assert!(deepest < -0.1 || params_inelastic(&world.contact), "no contact: {deepest}");
    let miss = |(pose, start): (&Pose<3>, &Pose<3>)| {
        (pose.position - start.position).norm() + pose.orientation.angle_to(&start.orientation)
    };
    world.poses.iter().zip(&start).map(miss).fold(0.0, f64::max)
}

/// Inelastic contacts remember nothing.
fn params_inelastic(contact: &ShapeContact<3, Capsule<3>>) -> bool {
    contact.checkpoint().pairs.iter().all(|pair| pair.gamma == 0.0)
}

#[test]
fn gluey_capsules_come_apart_as_they_came_together() {
    let errors = [50, 100, 200, 400].map(|count| push_and_pull(exact(ContactLaw::Gluey), count));
    println!("{errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[1] < 0.6 * pair[0], "first order in dt: {errors:?}");
    }
    assert!(errors[3] < 5e-3, "{errors:?}");
    let inelastic = push_and_pull(exact(ContactLaw::Inelastic), 200);
    assert!(inelastic > 0.1, "{inelastic}");
}

/// A heap of capsules in all directions squeezed together by `u = -x` never overlaps.
fn check_heap<const D: usize>(side: usize, law: ContactLaw, solver: SolverKind) {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut direction = || loop {
        let v = Vector::<D>::from_fn(|_, _| random.random_range(-1.0..1.0));
        if v.norm() > 0.1 && v.norm() < 1.0 {
            return v.normalize();
        }
    };
    let count = side.pow(D as u32);
    let site = |i: usize| Vector::<D>::from_fn(|d, _| (i / side.pow(d as u32) % side) as f64);
    let centre = Vector::<D>::repeat(0.5 * (side - 1) as f64);
    let shapes: Vec<_> = (0..count).map(|_| Capsule::new(direction(), 0.5)).collect();
    let poses = (0..count).map(|i| Pose::at((site(i) - centre) * 3.2 + direction() * 0.05)).collect();
    let params = ContactParams { tolerance: 1e-11, solver, ..exact(law) };
    let mut world = World { poses, contact: ShapeContact::new(params, shapes), dt: 0.02 };
    let (mut smallest, mut most) = (f64::INFINITY, 0);
    for _ in 0..60 {
        world.step(|pose| Twist { velocity: -pose.position, ..Twist::default() });
        smallest = smallest.min(world.smallest_gap());
        most = most.max(world.contact.contacts().len());
    }
    println!("{D}D {law}: gap {smallest:e}, {most} contacts of {count} capsules");
    assert!(smallest > -2e-11, "{smallest:e}");
    assert!(most > count, "{most} contacts");
}

#[test]
fn squeezed_capsules_do_not_overlap() {
    for law in [ContactLaw::Inelastic, ContactLaw::Gluey] {
        check_heap::<2>(6, law, SolverKind::ActiveSet);
        check_heap::<3>(3, law, SolverKind::Auto);
    }
}

/// A box with round edges: any convex core does.
#[derive(Clone)]
struct RoundBox(Vector<3>);

impl Shape<3> for RoundBox {
    fn rounding(&self) -> f64 {
        0.1
    }

    fn reach(&self) -> f64 {
        self.0.norm() + 0.1
    }

    fn drag_radius(&self) -> f64 {
        1.0
    }

    fn core_support(&self, direction: &Vector<3>) -> Vector<3> {
        self.0.zip_map(direction, |half, along| half.copysign(along))
    }
}

#[test]
fn boxes_keep_their_distance() {
    // Edge over edge, at right angles: the edges (after a turn by 45 degrees about y and x) point at each
    // other.
    let boxes = [RoundBox(Vector::<3>::new(1.0, 2.0, 1.0)), RoundBox(Vector::<3>::new(2.0, 1.0, 1.0))];
    let turned = |axis: Vector<3>, height: f64| {
        let orientation = Dim::<3>::advance(&Dim::<3>::identity(), &Spin::<3>::from(axis * (0.25 * PI)), 1.0);
        Pose { position: Vector::<3>::new(0.0, 0.0, height), orientation }
    };
    let poses = [turned(Vector::<3>::y(), 0.0), turned(Vector::<3>::x(), 3.1)];
    let found = gap([&boxes[0], &boxes[1]], [&poses[0], &poses[1]]).expect("apart");
    assert!((found - (3.1 - 2.0 * 2f64.sqrt() - 0.2)).abs() < 1e-7, "{found}");

    let mut twists = [1.0, -1.0].map(|v| Twist { velocity: Vector::<3>::z() * v, ..Twist::default() });
    let drift = [Twist::default(); 2];
    let step = BodyStep { poses: &poses, radii: &[], drift: &drift, velocity_weight: 0.1, dt: 0.1 };
    let params = ContactParams { tolerance: 1e-6, ..exact(ContactLaw::Inelastic) };
    ShapeContact::new(params, boxes.to_vec()).correct_bodies(&step, &mut twists).expect("a good step");
    assert!((twists[0].velocity.z - 0.5 * found / 0.1).abs() < 1e-6, "{twists:?}");
}

/// A ball between a box and a capsule, both of which are fixed: all gaps along x are 0.05.
#[test]
fn shapes_of_different_kinds_touch() {
    let shapes: Vec<Box<dyn Shape<3>>> = vec![
        Box::new(RoundBox(Vector::<3>::new(1.0, 2.0, 2.0))),
        Box::new(Capsule::new(Vector::<3>::zeros(), 0.5)),
        Box::new(Capsule::new(Vector::<3>::y(), 0.5)),
    ];
    let poses = [0.0, 1.65, 2.7].map(|x| Pose::at(Vector::<3>::new(x, 0.1, 0.0)));
    let params = ContactParams { tolerance: 1e-6, ..exact(ContactLaw::Inelastic) };
    let mut contact = ShapeContact::with_mobility(params, shapes, WithFixed::new([0, 2]));
    for sign in [1.0, -1.0] {
        let mut twists = [Twist::<3>::default(); 3];
        twists[1].velocity.x = sign * 2.0;
        let drift = [Twist::default(); 3];
        let step = BodyStep { poses: &poses, radii: &[], drift: &drift, velocity_weight: 0.1, dt: 0.1 };
        let report = contact.correct_bodies(&step, &mut twists).expect("a good step");
        assert_eq!(report.active_count, 1);
        assert!((twists[1].velocity.x - 0.5 * sign).abs() < 1e-5, "{:?}", twists[1]);
    }
}

#[test]
fn closest_points_of_capsules_are_the_closest() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for case in 0..200 {
        let mut vector = |size: f64| Vector::<3>::from_fn(|_, _| random.random_range(-1.0..1.0) * size);
        // The smaller the second term, the more parallel; sizes are far from 1.
        let size = [1e-4, 1.0, 1e4][case % 3];
        let half = vector(1.0) * size;
        let other = half * 0.8 + vector([0.0, 1e-9, 1e-4, 1.0][case % 4]) * size;
        let shapes = [Capsule::new(half, 0.1 * size), Capsule::new(other, 0.1 * size)];
        let between = vector(3.0) * size;
        let Some(found) = gap([&shapes[0], &shapes[1]], [&Pose::at(Vector::zeros()), &Pose::at(between)])
        else {
            continue;
        };
        // A convex function of two variables: for every s its best t, by thirds.
        let best_t = |s: f64| (other.dot(&(half * s - between)) / other.norm_squared()).clamp(-1.0, 1.0);
        let distance = |s: f64| (between + other * best_t(s) - half * s).norm();
        let (mut low, mut high) = (-1.0, 1.0);
        for _ in 0..200 {
            let third = (high - low) / 3.0;
            match distance(low + third) < distance(high - third) {
                true => high -= third,
                false => low += third,
            }
        }
        let best = [low, -1.0, 1.0].map(distance).into_iter().fold(f64::INFINITY, f64::min) - 0.2 * size;
        assert!((found - best).abs() < 1e-12 * size, "case {case}: {found} {best}");
    }
}

#[test]
fn bad_shapes_are_named() {
    let good = Capsule::new(Vector::<2>::x(), 0.5);
    let correct = |shapes: [Capsule<2>; 2], at: f64, params: ContactParams, twist: Twist<2>| {
        let poses = [Pose::at(Vector::<2>::zeros()), Pose::at(Vector::<2>::new(0.0, at))];
        let drift = [Twist::default(); 2];
        let step = BodyStep { poses: &poses, radii: &[], drift: &drift, velocity_weight: 0.1, dt: 0.1 };
        ShapeContact::new(params, shapes.to_vec())
            .correct_bodies(&step, &mut [Twist::default(), twist])
            .expect_err("bad")
    };
    let tuning = || exact(ContactLaw::Gluey);
    let still = Twist::default();
    let flat = Capsule::new(Vector::<2>::x(), -0.5);
    assert_eq!(
        correct([good, flat], 2.0, tuning(), still),
        ContactError::BadRadius { particle: 1, radius: -0.5 }
    );
    let endless = Capsule::new(Vector::<2>::repeat(f64::INFINITY), 0.5);
    assert!(matches!(
        correct([endless, good], 2.0, tuning(), still),
        ContactError::BadRadius { particle: 0, .. }
    ));
    let pair = PairKey::new(0, 1);
    assert_eq!(correct([good, good], 0.0, tuning(), still), ContactError::Entangled { pair });
    let spinning = Twist { spin: Spin::<2>::new(f64::NAN), ..still };
    assert!(matches!(
        correct([good, good], 2.0, tuning(), spinning),
        ContactError::NotFinite { particle: 1, .. }
    ));
    let error = correct([good, good], 2.0, exact(ContactLaw::VelocityCorrection), still);
    assert_eq!(error, ContactError::NotForShapes { law: ContactLaw::VelocityCorrection });
}
