//! Simple shear for ever: boxes whose images slide along each other (Lees and Edwards 1972).

use gluey_contact::{
    Contact, ContactLaw, ContactModel, ContactParams, ContactState, Domain, GammaUpdate, PairContact,
    PairKey, PairState, SolverKind, StepGeometry,
};
use gluey_geom::{Lattice, Particle, Twist, Vector};
use gluey_motion::{BackgroundFlow, Configuration, Hydrodynamics, Integrator, LinearFlow, Scheme};
use gluey_testkit::cpu_seconds;
use gluey_testkit::packing::Packing;

const RADIUS: f64 = 0.5;
/// Shear rate.
const RATE: f64 = 1.0;

fn tuning(law: ContactLaw) -> ContactParams {
    ContactParams {
        law,
        exact_gap: true,
        gamma_update: GammaUpdate::Consistent,
        solver: SolverKind::ActiveSet,
        ..Default::default()
    }
}

/// Discs or spheres that drift with the shear `u = rate y` as if each were alone, but for their contacts.
struct Suspension<const D: usize> {
    particles: Vec<Particle<D>>,
    radii: Vec<f64>,
    /// Velocities of the last step.
    twists: Vec<Twist<D>>,
    domain: Domain<D>,
    /// 1, or -1 when the shear is reversed.
    sense: f64,
    flow: BackgroundFlow<D>,
    contact: PairContact<D>,
    integrator: Integrator<D>,
}

impl<const D: usize> Suspension<D> {
    fn new(positions: &[Vector<D>], lengths: &Vector<D>, tilt: f64, params: ContactParams) -> Self {
        let mut domain = Domain::periodic(lengths);
        domain.set_sliding(tilt, 0.0);
        Self {
            particles: positions.iter().map(|x| Particle::new(*x, RADIUS)).collect(),
            radii: vec![RADIUS; positions.len()],
            twists: vec![Twist::default(); positions.len()],
            sense: 1.0,
            flow: BackgroundFlow::new(LinearFlow::shear(RATE, 0.0)),
            contact: PairContact::new(params).within(domain.clone()),
            integrator: Integrator::new(Scheme::AdamsBashforth2),
            domain,
        }
    }

    fn of(packing: &Packing<D>, tilt: f64, law: ContactLaw) -> Self {
        Self::new(&packing.positions, &Vector::repeat(packing.side), tilt, tuning(law))
    }

    fn positions(&self) -> Vec<Vector<D>> {
        self.particles.iter().map(|particle| particle.pose.position).collect()
    }

    fn velocities(&self) -> Vec<Vector<D>> {
        self.twists.iter().map(|twist| twist.velocity).collect()
    }

    /// A step; returns the sum of what contact changed, and of its absolute values.
    fn step(&mut self, dt: f64) -> (Vector<D>, f64) {
        let now = Configuration { shear_factor: self.sense, ..Configuration::at(0.0, &self.particles) };
        self.twists = self.flow.predict(&now).expect("no forces").twists;
        let (positions, predicted) = (self.positions(), self.velocities());
        let mut drift = vec![Vector::zeros(); positions.len()];
        self.integrator.drift(dt, &mut drift);
        let velocity_weight = self.integrator.velocity_weight(dt);
        let step =
            StepGeometry { positions: &positions, radii: &self.radii, drift: &drift, velocity_weight, dt };
        let (tilt, height) = (self.domain.lattice.tilt(), self.domain.lattice.periods()[1].unwrap_or(0.0));
        let tilt_step = self.sense * RATE * height * dt;
        self.contact.set_sliding(tilt, tilt_step);
        self.contact.correct(&step, &mut self.twists).expect("feasible");
        self.integrator.advance(dt, &mut self.particles, &self.twists);
        self.domain.set_sliding(tilt + tilt_step, 0.0);
        let changes = self.twists.iter().zip(&predicted).map(|(twist, old)| (twist.velocity - old) * RADIUS);
        changes.fold((Vector::zeros(), 0.0), |(sum, size), change| (sum + change, size + change.norm()))
    }

    fn reverse(&mut self) {
        self.sense = -self.sense;
        self.integrator.reverse();
        self.contact.reverse();
    }

    /// The smallest gap of all pairs, found without the crate.
    fn smallest_gap(&self) -> f64 {
        let (positions, lattice) = (self.positions(), &self.domain.lattice);
        let mut smallest = f64::INFINITY;
        for (i, x) in positions.iter().enumerate() {
            for y in &positions[..i] {
                let (nearest, _) = lattice.nearest(&(y - x));
                for j in -1..=1 {
                    // A row up or down, the nearest in it.
                    let row = nearest + lattice.shift(&std::array::from_fn(|d| if d == 1 { j } else { 0 }));
                    let along =
                        Lattice::<D>::new(std::array::from_fn(|d| lattice.periods()[d].filter(|_| d == 0)));
                    smallest = smallest.min(along.nearest(&row).0.norm() - 2.0 * RADIUS);
                }
            }
        }
        smallest
    }

    /// The contacts' gaps, sorted.
    fn gaps(&self) -> Vec<f64> {
        let mut gaps: Vec<f64> = self.contact.contacts().iter().map(|contact| contact.gap).collect();
        gaps.sort_unstable_by(f64::total_cmp);
        gaps
    }
}

/// The largest difference.
fn difference<const D: usize>(one: &[Vector<D>], other: &[Vector<D>]) -> f64 {
    assert_eq!(one.len(), other.len());
    one.iter().zip(other).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// A dense suspension.
fn packing<const D: usize>() -> Packing<D> {
    if D == 2 { Packing::fluid(60, 0.6, 3) } else { Packing::fluid(108, 0.45, 3) }
}

fn tilts_that_differ_by_a_period_are_the_same<const D: usize>() {
    let packing = packing::<D>();
    let run = |turns: f64, law| {
        let mut suspension = Suspension::of(&packing, (0.3 + turns) * packing.side, law);
        (0..60).for_each(|_| _ = suspension.step(0.01));
        suspension
    };
    for law in [ContactLaw::Gluey, ContactLaw::Inelastic, ContactLaw::VelocityCorrection] {
        let straight = run(0.0, law);
        assert!(straight.contact.contacts().len() > 20, "{}", straight.contact.contacts().len());
        for turns in [1.0, -2.0] {
            let other = run(turns, law);
            let velocity = difference(&straight.velocities(), &other.velocities());
            let [gaps, others] = [straight.gaps(), other.gaps()];
            assert_eq!(gaps.len(), others.len());
            let gap = gaps.iter().zip(&others).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{D}D {law}, {turns} periods: velocities {velocity:e}, gaps {gap:e}");
            assert!(velocity < 1.5e-11 && gap < 2.5e-13, "{velocity:e} {gap:e}");
        }
    }
}

#[test]
fn tilts_by_a_period_change_nothing() {
    tilts_that_differ_by_a_period_are_the_same::<2>();
    tilts_that_differ_by_a_period_are_the_same::<3>();
}

fn copies_move_alike<const D: usize>(axis: usize, params: &ContactParams) {
    let packing = packing::<D>();
    let side = Vector::repeat(packing.side);
    let mut one = Suspension::new(&packing.positions, &side, 0.3 * packing.side, params.clone());
    let shift = one.domain.lattice.shift(&std::array::from_fn(|d| i32::from(d == axis)));
    let positions: Vec<_> = [Vector::zeros(), shift]
        .iter()
        .flat_map(|shift| packing.positions.iter().map(move |x| x + shift))
        .collect();
    let lengths = Vector::from_fn(|d, _| packing.side * if d == axis { 2.0 } else { 1.0 });
    let tilt = one.domain.lattice.tilt() * if axis == 1 { 2.0 } else { 1.0 };
    let mut two = Suspension::new(&positions, &lengths, tilt, params.clone());
    for n in 0..90 {
        if n == 60 {
            one.reverse();
            two.reverse();
        }
        one.step(0.01);
        two.step(0.01);
    }
    assert!(one.contact.contacts().len() > 20);
    assert_eq!(two.contact.contacts().len(), 2 * one.contact.contacts().len());
    let mut slide = Vector::<D>::zeros();
    slide[0] = one.sense * RATE * shift[1];
    let velocities = two.velocities();
    let (first, second) = velocities.split_at(packing.positions.len());
    let second: Vec<_> = second.iter().map(|velocity| velocity - slide).collect();
    let off = difference(&one.velocities(), first).max(difference(&one.velocities(), &second));
    println!("{D}D, copies along axis {axis}: velocities differ by {off:e}");
    assert!(off < 1.5e-11, "{off:e}");
}

#[test]
fn a_box_and_two_copies_of_it_move_alike() {
    let exact = tuning(ContactLaw::Gluey);
    let linear = ContactParams { exact_gap: false, ..exact.clone() };
    for (axis, params) in [(0, &exact), (1, &exact), (1, &linear)] {
        copies_move_alike::<2>(axis, params);
        copies_move_alike::<3>(axis, params);
    }
}

fn translations_change_nothing<const D: usize>() {
    let packing = packing::<D>();
    let mut here = Suspension::of(&packing, 0.3 * packing.side, ContactLaw::Gluey);
    let along = Vector::<D>::from_fn(|d, _| packing.side * [0.4, -1.7, 0.9][d]);
    let moved: Vec<_> = packing.positions.iter().map(|x| x + along).collect();
    let mut there =
        Suspension::new(&moved, &Vector::repeat(packing.side), 0.3 * packing.side, tuning(ContactLaw::Gluey));
    there.flow = BackgroundFlow::new(LinearFlow::shear(RATE, along[1]));
    for _ in 0..60 {
        here.step(0.01);
        there.step(0.01);
    }
    let off = difference(&here.velocities(), &there.velocities());
    println!("{D}D: velocities differ by {off:e} when all are moved");
    assert!(off < 1.5e-11, "{off:e}");
}

#[test]
fn moving_all_changes_nothing() {
    translations_change_nothing::<2>();
    translations_change_nothing::<3>();
}

#[test]
fn threads_change_no_bit() {
    let packing = Packing::<3>::fluid(2000, 0.48, 4);
    let on = |count: usize| -> (Vec<Vector<3>>, Vec<Contact>) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("threads");
        pool.install(|| {
            let mut suspension = Suspension::of(&packing, 2.2 * packing.side, ContactLaw::Gluey);
            (0..12).for_each(|_| _ = suspension.step(0.02));
            (suspension.positions(), suspension.contact.contacts().to_vec())
        })
    };
    let one = on(1);
    assert!(one.1.len() > 500, "{}", one.1.len());
    assert!(on(2) == one);
}

/// Shears for so many steps, by 0.01 each.
fn sheared_for_long<const D: usize>(packing: &Packing<D>, law: ContactLaw, step_count: usize) {
    let dt = 0.01;
    // One thread, whose CPU time is that of the step.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut suspension = Suspension::of(packing, 0.0, law);
    let (mut contact_count, mut smallest, mut imbalance, mut off) = (0, 0f64, 0f64, 0f64);
    let mut quarters = [0.0; 4];
    for n in 0..step_count {
        let (sum, size) = pool.install(|| {
            let start = cpu_seconds();
            let forces = suspension.step(dt);
            quarters[4 * n / step_count] += cpu_seconds() - start;
            forces
        });
        imbalance = imbalance.max(sum.norm() / size.max(RADIUS));
        contact_count = contact_count.max(suspension.contact.contacts().len());
        let positions = suspension.positions();
        for contact in suspension.contact.contacts() {
            let branch = contact.pair.branch(&positions, &suspension.domain).expect("known");
            off = off.max((branch.norm() - 2.0 * RADIUS - contact.gap).abs());
        }
        if n % 20 == 0 {
            smallest = smallest.min(suspension.smallest_gap());
        }
    }
    println!(
        "{D}D {law}: {contact_count} contacts at most, smallest gap {:e} a, forces off balance by \
         {imbalance:e}, gaps off by {off:e}, seconds {quarters:?}",
        smallest / RADIUS
    );
    assert!(contact_count > packing.positions.len() / 2);
    assert!(smallest >= -4e-11 * RADIUS, "{smallest:e}");
    assert!(imbalance < 4e-15 && off < 1.7e-13, "{imbalance:e} {off:e}");
    assert!(quarters[3] < 3.0 * quarters[1], "{quarters:?}");
}

#[test]
fn a_hundred_discs_never_overlap_however_long_they_are_sheared() {
    let packing = Packing::<2>::fluid(100, 0.5, 5);
    for law in [ContactLaw::Gluey, ContactLaw::Inelastic] {
        sheared_for_long(&packing, law, 4000);
    }
}

#[test]
fn spheres_never_overlap_however_long_they_are_sheared() {
    sheared_for_long(&Packing::<3>::fluid(108, 0.4, 5), ContactLaw::Gluey, 1000);
}

/// A pair that is glued turns in the shear, and remembers, while its image passes by many boxes.
fn a_glued_pair_turns_across_the_border<const D: usize>() {
    let (side, dt) = (6.0, 0.01);
    let lengths = Vector::<D>::repeat(side);
    // The second is written one row of boxes too low.
    let tilt = 0.4 * side;
    let image = [0, 1, 0];
    let mut suspension = Suspension::new(&[Vector::zeros(); 2], &lengths, tilt, tuning(ContactLaw::Gluey));
    let mut branch = Vector::zeros();
    (branch[0], branch[1]) = (-0.8 * 2.0 * RADIUS, 0.6 * 2.0 * RADIUS);
    suspension.particles[1].pose.position = branch - suspension.domain.shift(&image);
    let pair = PairKey::across(0, 1, image);
    let start = -50.0;
    let state = ContactState {
        pairs: vec![PairState { pair, gamma: start, lambda: 0.0 }],
        ..ContactState::default()
    };
    suspension.contact.resume(state).expect("a memory");
    let (mut least, mut most) = (start, start);
    for n in 0..5000 {
        suspension.step(dt);
        let [contact] = suspension.contact.contacts() else { panic!("one contact in step {n}") };
        assert!(contact.pair == pair && contact.gap.abs() < 1e-12, "step {n}: {contact:?}");
        (least, most) = (least.min(contact.gamma), most.max(contact.gamma));
    }
    // Passed by fifty boxes, and pushed and pulled in turn.
    assert!((suspension.domain.lattice.tilt() / side - 50.4).abs() < 1e-9);
    println!("{D}D: gamma between {least} and {most}");
    assert!(least < start && most > start && most - least < 1.0, "{least} {most}");
}

#[test]
fn a_pair_remembers_while_images_slide() {
    a_glued_pair_turns_across_the_border::<2>();
    a_glued_pair_turns_across_the_border::<3>();
}

#[test]
fn a_memory_with_far_images_resumes_bit_for_bit() {
    let packing = Packing::<3>::fluid(256, 0.45, 9);
    // Particles written rows away from each other, in a lattice that has been sheared for long.
    let lattice = Lattice::new([Some(packing.side); 3]).tilted(2000.3 * packing.side);
    let far = |(i, x): (usize, &Vector<3>)| x + lattice.shift(&[-(i as i32) * 2000, i as i32 % 7 - 3, 0]);
    let positions: Vec<_> = packing.positions.iter().enumerate().map(far).collect();
    let lengths = Vector::repeat(packing.side);
    let mut straight = Suspension::new(&positions, &lengths, lattice.tilt(), tuning(ContactLaw::Gluey));
    (0..10).for_each(|_| _ = straight.step(0.02));
    let state = straight.contact.checkpoint();
    let bytes = postcard::to_stdvec(&state).expect("serialises");
    let read: ContactState = postcard::from_bytes(&bytes).expect("comes back");
    assert_eq!(read, state);

    let tilt = straight.domain.lattice.tilt();
    let mut resumed = Suspension::new(&straight.positions(), &lengths, tilt, tuning(ContactLaw::Gluey));
    resumed.integrator = straight.integrator.clone();
    resumed.contact.resume(read).expect("a memory");
    for _ in 0..10 {
        straight.step(0.002);
        resumed.step(0.002);
    }
    let farthest = |contact: &Contact| match contact.pair.second {
        gluey_contact::Partner::Particle { image, .. } => image[0].abs(),
        gluey_contact::Partner::Wall(_) => 0,
    };
    assert!(straight.contact.contacts().len() > 50);
    assert!(straight.contact.contacts().iter().map(farthest).max() > Some(100_000));
    assert_eq!(straight.positions(), resumed.positions());
    assert_eq!(straight.contact.contacts(), resumed.contact.contacts());
}
