//! Contacts whose forces act in the flow, here in the drag that each particle has alone.

use std::f64::consts::PI;

use gluey_geom::{Dim, Pose, Spin, Twist, Vector};

use super::coulomb::{Coulomb, PairForce};
use super::newton;
use super::sweeps::Sweeps;
use super::touch::Touch;
use super::{FlowContact, FlowContactParams, Friction, NormalLaw};
use crate::{
    BodyStep, ContactForce, ContactLaw, ContactModel, ContactParams, Domain, FlowForces, GammaUpdate,
    LoneDrag, PairContact, Repulsion, TwistMobility, Wall,
};

const DT: f64 = 1e-3;
const RADII: [f64; 2] = [1.0, 2.0];

fn rough(coefficient: f64) -> FlowContactParams {
    FlowContactParams {
        law: NormalLaw::Rough { roughness: 0.01 },
        friction: Friction { coefficient, load: 0.0 },
        ..FlowContactParams::default()
    }
}

/// Two spheres at the roughness on the x axis that run at each other, past each other and turn.
struct Encounter {
    poses: [Pose<3>; 2],
    twists: [Twist<3>; 2],
    drift: [Twist<3>; 2],
}

impl Encounter {
    fn new() -> Self {
        let at = |x: f64| Pose::at(Vector::<3>::new(x, 0.0, 0.0));
        let twist = |velocity: [f64; 3], spin: [f64; 3]| Twist {
            velocity: velocity.into(),
            spin: Spin::<3>::new(spin[0], spin[1], spin[2]),
        };
        Self {
            poses: [at(0.0), at(3.0 + 0.015)],
            twists: [twist([0.3, 0.1, 0.0], [0.1, 0.2, 0.3]), twist([-0.2, -0.3, 0.4], [0.0, -0.5, 0.2])],
            drift: [Twist::default(); 2],
        }
    }

    fn step(&self) -> BodyStep<'_, 3> {
        BodyStep { poses: &self.poses, radii: &RADII, drift: &self.drift, velocity_weight: DT, dt: DT }
    }

    /// The model after a correction, and the motions.
    fn corrected(&self, params: FlowContactParams) -> (FlowContact<3>, [Twist<3>; 2]) {
        let mut contact = FlowContact::new(params, Domain::default());
        let mut twists = self.twists;
        let mut drag = LoneDrag { viscosity: 1.0, radii: &RADII, is_held: &[] };
        contact.correct(&self.step(), &mut drag, &mut twists).expect("forces");
        contact.finish();
        (contact, twists)
    }
}

/// Relative velocity of the surfaces in the middle of the gap.
fn slip(twists: &[Twist<3>; 2]) -> Vector<3> {
    let arms = [Vector::<3>::new(1.0075, 0.0, 0.0), Vector::<3>::new(-2.0075, 0.0, 0.0)];
    twists[1].velocity_at(&arms[1]) - twists[0].velocity_at(&arms[0])
}

/// What sticks turns as one body and what slips is held back by `mu F_n`, against the slip; the normal force
/// is that of two drags in a row.
#[test]
fn surfaces_stick_or_slip() {
    let encounter = Encounter::new();
    let approach = 0.5;
    let normal = approach * 6.0 * PI / (1.0 / RADII[0] + 1.0 / RADII[1]);
    for coefficient in [0.0, 0.05, f64::INFINITY] {
        let (contact, twists) = encounter.corrected(rough(coefficient));
        let [force] = contact.forces() else { panic!("one contact") };
        // The pair turns while it moves: the gap at the end has a part of second order.
        assert!((force.pressing() / normal - 1.0).abs() < 2.0 * DT, "{}", force.pressing());
        let [tangential, slip] = [force.tangential(), slip(&twists)];
        let across = Vector::<3>::new(0.0, slip.y, slip.z);
        match coefficient {
            0.0 => assert_eq!(tangential.norm(), 0.0),
            f64::INFINITY => assert!(across.norm() < 1e-9 && tangential.norm() > 1.0, "{across}"),
            _ => {
                let along = tangential.dot(&across) / (tangential.norm() * across.norm());
                assert!((tangential.norm() / (coefficient * force.pressing()) - 1.0).abs() < 1e-12);
                assert!(across.norm() > 0.1 && (along + 1.0).abs() < 1e-9, "{along}");
            }
        }
        assert!((force.gap - 0.015).abs() < 1e-12, "{}", force.gap);
    }
}

/// Forces are opposite, and their torques balance about any point.
#[test]
fn forces_are_in_balance() {
    let encounter = Encounter::new();
    let (mut contact, _) = encounter.corrected(rough(0.5));
    let [first, second] = contact.loads(&encounter.step()).expect("loads")[..] else { panic!("two loads") };
    assert!((first.force + second.force).norm() < 1e-14);
    let arm = encounter.poses[1].position;
    let about_first = first.torque + second.torque + Dim::<3>::moment(&arm, &second.force);
    assert!(Dim::<3>::spin_slice(&about_first).iter().all(|torque| torque.abs() < 1e-13));
}

/// Below the critical load there is no friction, above it the excess counts.
#[test]
fn friction_begins_at_the_critical_load() {
    let encounter = Encounter::new();
    let with_load = |load: f64| {
        let params = FlowContactParams { friction: Friction { coefficient: 0.05, load }, ..rough(0.05) };
        let (contact, _) = encounter.corrected(params);
        (contact.forces()[0].pressing(), contact.forces()[0].tangential().norm())
    };
    let (pressing, tangential) = with_load(3.0);
    assert!((tangential - 0.05 * (pressing - 3.0)).abs() < 1e-12);
    assert_eq!(with_load(2.0 * pressing).1, 0.0);
}

/// Smooth surfaces have the forces and the memory of the model that corrects velocities after the flow.
#[test]
fn smooth_surfaces_are_those_of_the_projection() {
    for law in [ContactLaw::Inelastic, ContactLaw::Gluey] {
        let gluey = ContactParams {
            law,
            exact_gap: true,
            gamma_update: GammaUpdate::Consistent,
            ..ContactParams::default()
        };
        let params = FlowContactParams { law: NormalLaw::Smooth(gluey.clone()), ..rough(0.0) };
        let (mut ours, mut theirs) = (FlowContact::new(params, Domain::default()), PairContact::new(gluey));
        let mut encounter = Encounter::new();
        encounter.poses[1].position.x = 3.0 + 1e-4;
        let mut seen = 0;
        for n in 0..6 {
            // Pressed together, then pulled apart.
            let sign = if n < 3 { 1.0 } else { -1.0 };
            let [mut a, mut b] = [encounter.twists.map(|twist| twist * sign); 2];
            ours.correct_bodies(&encounter.step(), &mut a).expect("forces");
            theirs.correct_bodies(&encounter.step(), &mut b).expect("forces");
            for (a, b) in a.iter().zip(&b) {
                assert!((a.velocity - b.velocity).norm() < 1e-9, "{law} {n}: {} {}", a.velocity, b.velocity);
            }
            for (a, b) in ours.contacts().iter().zip(theirs.contacts()) {
                assert!((a.lambda - b.lambda).abs() + (a.gamma - b.gamma).abs() < 1e-9, "{a:?} {b:?}");
                seen += 1;
            }
            for (pose, twist) in encounter.poses.iter_mut().zip(&a) {
                pose.position += twist.velocity * DT;
            }
        }
        assert!(seen >= 2, "{law}: {seen}");
    }
}

/// A sphere on a wall that moves along itself is dragged along, and rolls if it does not slip.
#[test]
fn walls_drag_what_they_touch() {
    let floor = Wall::new(&Vector::<3>::zeros(), &Vector::<3>::y());
    let poses = [Pose::at(Vector::<3>::new(0.0, 1.01, 0.0))];
    let drift = [Twist::default()];
    let step = BodyStep { poses: &poses, radii: &[1.0], drift: &drift, velocity_weight: DT, dt: DT };
    let mut drag = LoneDrag { viscosity: 1.0, radii: &[1.0], is_held: &[] };
    let mut contact = FlowContact::new(rough(f64::INFINITY), Domain::default().with_wall(floor))
        .with_walls_along(vec![Vector::<3>::new(0.7, 0.0, 0.0)]);
    for factor in [1.0, -1.0] {
        contact.set_surroundings(0.0, 0.0, factor);
        let mut twists = [Twist { velocity: Vector::<3>::new(0.0, -0.2, 0.0), ..Twist::default() }];
        contact.correct(&step, &mut drag, &mut twists).expect("forces");
        let at_wall = twists[0].velocity_at(&Vector::<3>::new(0.0, -1.005, 0.0));
        assert!((at_wall - Vector::<3>::new(0.7 * factor, 0.0, 0.0)).norm() < 1e-9, "{at_wall}");
        assert!(twists[0].velocity.x * factor > 0.1);
        contact.reverse();
    }
}

/// What is kept of the forces is enough to go on with.
#[test]
fn forces_survive_a_checkpoint() {
    let encounter = Encounter::new();
    let (mut contact, _) = encounter.corrected(rough(0.5));
    let mut other = FlowContact::new(rough(0.5), Domain::default());
    other.resume(contact.checkpoint()).expect("a state");
    other.begin(&encounter.step()).expect("known pairs");
    let [a, b] = [&mut contact, &mut other].map(|contact| contact.loads(&encounter.step()).expect("loads"));
    assert!(a.iter().zip(&b).all(|(a, b)| (a.force - b.force).norm() < 1e-14));
    let mut state = contact.checkpoint();
    state.in_flow[0].force[1] = f64::NAN;
    assert!(other.resume(state).is_err());
}

/// Two spheres that run at each other are held apart by repulsion with the gap at the end, or, where it is
/// too weak, by it and the contact.
#[test]
fn repulsion_and_contact_share_a_push() {
    let mut encounter = Encounter::new();
    encounter.poses[1].position.x = 3.05;
    let push = 0.5 * 6.0 * PI / (1.0 / RADII[0] + 1.0 / RADII[1]);
    // Between these radii the law has 4/3 of its force.
    for (force, is_enough) in [(10.0 * push, true), (0.3 * push, false)] {
        let law = Repulsion { force, range: 0.02, radius: 1.0 };
        let mut contact = FlowContact::new(rough(0.0), Domain::default());
        contact.set_repulsion(law);
        let mut twists = encounter.twists;
        let step = BodyStep { velocity_weight: 0.1, dt: 0.1, ..encounter.step() };
        let mut drag = LoneDrag { viscosity: 1.0, radii: &RADII, is_held: &[] };
        contact.begin(&step).expect("a step");
        contact.correct(&step, &mut drag, &mut twists).expect("forces");
        contact.measure_gaps(&step, &twists).expect("gaps");
        contact.finish();
        let [position, other] = [0, 1].map(|k| encounter.poses[k].position + twists[k].velocity * step.dt);
        let gap = (other - position).norm() - 3.0;
        let [ContactForce { force, gap: measured, .. }] = contact.forces() else {
            assert!(is_enough && gap > 0.01 * 1.5, "{gap}");
            // The first step has no history: the force is that of its end.
            let moved = twists[1].velocity.x - encounter.twists[1].velocity.x;
            let found = moved * 6.0 * PI * RADII[1] + law.at::<3>(0.05, RADII);
            assert!((found / law.at::<3>(gap, RADII) - 1.0).abs() < 1e-9, "{found} {gap}");
            continue;
        };
        assert!(!is_enough && (measured - 0.015).abs() < 1e-12 && (gap - 0.015).abs() < 1e-12, "{gap}");
        // The flow alone would close the gap. The pair turns while it moves, which takes a part of the push.
        let excess = law.at::<3>(0.015, RADII) - law.at::<3>(0.05, RADII);
        assert!((force.norm() + excess - 0.3 * push).abs() < 0.02 * push, "{force} {excess} {push}");
    }
}

/// Calls `check` with eight spheres at the corners of a cube that a flow presses together and shears, and the
/// motions that the accelerated iteration finds.
fn with_cube(check: impl FnOnce(Coulomb<'_, 3>, &[Twist<3>])) {
    let place = |k: usize| Vector::<3>::from_fn(|d, _| 2.01 * (k >> d & 1) as f64);
    let poses: Vec<Pose<3>> = (0..8).map(|k| Pose::at(place(k))).collect();
    let (radii, drift) = (vec![1.0; 8], vec![Twist::default(); 8]);
    let step = BodyStep { poses: &poses, radii: &radii, drift: &drift, velocity_weight: DT, dt: DT };
    let inward = |pose: &Pose<3>| Twist {
        velocity: Vector::<3>::repeat(1.005) - pose.position + Vector::<3>::x() * pose.position.y,
        spin: Spin::<3>::new(0.0, 0.2, -0.5),
    };
    let free: Vec<Twist<3>> = poses.iter().map(inward).collect();
    let params = rough(0.4);
    let mut contact = FlowContact::new(params.clone(), Domain::default());
    let mut drag = LoneDrag { viscosity: 1.0, radii: &radii, is_held: &[] };
    let mut accelerated = free.clone();
    contact.correct(&step, &mut drag, &mut accelerated).expect("forces");
    let touch = |force: &ContactForce<3>| {
        let mut touch = contact.touch(force.pair, &step).expect("a pair");
        touch.compliance = TwistMobility::<3>::of_pair(&drag, force.pair);
        touch
    };
    let touches: Vec<Touch<3>> = contact.forces().iter().map(touch).collect();
    assert_eq!(touches.len(), 12);
    let (rate, mobility) = (1.0, &mut drag);
    check(
        Coulomb { step: &step, touches: &touches, params: &params, rate, mobility, free: &free },
        &accelerated,
    );
}

/// Sweeps from nothing end, at the motions of the accelerated iteration.
#[test]
fn sweeps_find_the_forces_of_the_acceleration() {
    with_cube(|mut problem, accelerated| {
        let mut sweeps = Sweeps::new(&mut problem).expect("few pairs");
        let mut forces = vec![PairForce::of_contact(Vector::zeros()); problem.touches.len()];
        let mut residuals = Vec::new();
        for _ in 0..20 {
            let state = problem.state(&forces);
            residuals.push(state.residual);
            sweeps.improve(&problem, &mut forces, state.motions);
        }
        let last = problem.state(&forces);
        assert!(last.residual < 1e-10, "{residuals:?}");
        let off = last.twists.iter().zip(accelerated).map(|(a, b)| (*a - *b).velocity.amax());
        assert!(off.fold(0.0, f64::max) < 1e-8);
    });
}

/// What pairs ask for changes as its slopes say, whether they are apart, stick or slip; and Newton's method
/// with these ends at once from forces near the solution, but for what is not linear in the gaps.
#[test]
fn slopes_are_those_of_what_pairs_ask_for() {
    with_cube(|mut problem, _| {
        let mut forces = vec![PairForce::of_contact(Vector::zeros()); problem.touches.len()];
        let mut sweeps = Sweeps::new(&mut problem).expect("few pairs");
        for _ in 0..20 {
            let motions = problem.state(&forces).motions;
            sweeps.improve(&problem, &mut forces, motions);
        }
        let state = problem.state(&forces);
        let mut near = forces.clone();
        near.iter_mut().for_each(|force| force.contact *= 1.02);
        let motions = problem.state(&near).motions;
        newton::improve(&problem, &sweeps.blocks, &mut near, motions);
        assert!(problem.state(&near).residual < 1e-5, "{:e}", problem.state(&near).residual);
        let mut kinds = [0; 3];
        for (k, touch) in problem.touches.iter().enumerate() {
            let (mut force, mut motion) = (forces[k], state.motions[k]);
            // As they are, stuck, and apart.
            match k % 3 {
                0 => {}
                1 => {
                    motion.velocity = touch.normal * touch.normal.dot(&motion.velocity);
                    force.contact -= touch.across(&force.contact) * 0.5;
                }
                _ => motion.gap += 1.0,
            }
            let (change, velocity) =
                (Vector::<3>::new(0.3, -0.7, 0.2) * force.contact.norm(), Vector::<3>::new(0.1, 0.4, -0.6));
            let [along, across] = problem.slopes(touch, &force, &motion);
            let [of_gap, of_slip] = touch.compliance;
            let slope = (along + across) * change - (along / of_gap + across / of_slip) * velocity;
            let before = problem.asked(touch, &force, touch.compliance, &motion).contact;
            let size = 1e-6;
            force.contact += change * size;
            motion.add(touch, &(velocity * size), problem.step.velocity_weight);
            let after = problem.asked(touch, &force, touch.compliance, &motion).contact;
            let (found, scale) = ((after - before) / size, change.norm() + velocity.norm() / of_gap);
            assert!((found - slope).norm() < 1e-4 * scale, "{k}: {found} {slope}");
            let is_apart = before.norm() == 0.0;
            kinds[if is_apart { 0 } else { usize::from(across.norm_squared() > 1.9) + 1 }] += 1;
        }
        assert!(kinds.iter().all(|&count| count > 0), "apart, slipping, stuck: {kinds:?}");
    });
}
