//! Dense suspensions: nothing ever overlaps, and neither threads nor numbering change a bit.

use gluey_contact::{
    Contact, ContactLaw, ContactModel, ContactParams, Domain, GammaUpdate, PairContact, SolverKind,
    StepGeometry,
};
use gluey_geom::{Twist, Vector};
use gluey_testkit::packing::Packing;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

const RADIUS: f64 = 0.5;

/// Spheres in a periodic box under the shear `u* = (sin(2 pi y / L) L / (2 pi), 0, 0)`, whose largest rate is
/// 1.
struct Suspension {
    positions: Vec<Vector<3>>,
    radii: Vec<f64>,
    side: f64,
    contact: PairContact<3>,
}

impl Suspension {
    fn new(packing: &Packing<3>, params: ContactParams) -> Self {
        let domain = Domain::periodic(&Vector::repeat(packing.side));
        Self {
            positions: packing.positions.clone(),
            radii: vec![RADIUS; packing.positions.len()],
            side: packing.side,
            contact: PairContact::new(params).within(domain),
        }
    }

    fn step(&mut self, dt: f64) {
        let wave = std::f64::consts::TAU / self.side;
        let flow = |x: &Vector<3>| Vector::<3>::new((wave * x.y).sin() / wave, 0.0, 0.0);
        let mut twists: Vec<Twist<3>> =
            self.positions.iter().map(|x| Twist { velocity: flow(x), ..Twist::default() }).collect();
        let drift = vec![Vector::zeros(); twists.len()];
        let step = StepGeometry {
            positions: &self.positions,
            radii: &self.radii,
            drift: &drift,
            velocity_weight: dt,
            dt,
        };
        self.contact.correct(&step, &mut twists).expect("feasible");
        for (x, twist) in self.positions.iter_mut().zip(&twists) {
            *x += twist.velocity * dt;
        }
    }

    /// The smallest gap of all pairs, found without the crate.
    fn smallest_gap(&self) -> f64 {
        let mut smallest = f64::INFINITY;
        for (i, x) in self.positions.iter().enumerate() {
            for y in &self.positions[..i] {
                let apart = (y - x).map(|s| s - self.side * (s / self.side).round());
                smallest = smallest.min(apart.norm() - 2.0 * RADIUS);
            }
        }
        smallest
    }
}

fn tuning(law: ContactLaw) -> ContactParams {
    ContactParams {
        law,
        exact_gap: true,
        gamma_update: GammaUpdate::Consistent,
        solver: SolverKind::ActiveSet,
        ..Default::default()
    }
}

#[test]
fn five_hundred_spheres_never_overlap() {
    let packing = Packing::<3>::fluid(500, 0.5, 3);
    let mut suspension = Suspension::new(&packing, tuning(ContactLaw::Gluey));
    let mut contact_count = 0;
    for n in 0..2000 {
        suspension.step(5e-4);
        let contacts = suspension.contact.contacts();
        contact_count = contact_count.max(contacts.len());
        for Contact { pair, gamma, gap, lambda } in contacts {
            assert!(*gap >= -1e-10 * RADIUS, "step {n}, {pair}: gap {gap:e}");
            assert!(*gamma <= 0.0 && lambda.is_finite(), "step {n}, {pair}: gamma {gamma}, lambda {lambda}");
        }
        if n % 100 == 99 {
            let smallest = suspension.smallest_gap();
            assert!(smallest >= -1e-10 * RADIUS, "step {n}: {smallest:e}");
        }
    }
    println!("{contact_count} contacts at most");
    assert!(contact_count > 800);
}

/// Positions and contacts after some steps.
fn run(packing: &Packing<3>, law: ContactLaw) -> (Vec<Vector<3>>, Vec<Contact>) {
    let mut suspension = Suspension::new(packing, tuning(law));
    (0..6).for_each(|_| suspension.step(0.04));
    (suspension.positions, suspension.contact.contacts().to_vec())
}

#[test]
fn threads_change_no_bit() {
    let packing = Packing::<3>::fluid(3000, 0.48, 4);
    for law in [ContactLaw::Gluey, ContactLaw::Inelastic, ContactLaw::VelocityCorrection] {
        let on = |count: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("threads");
            pool.install(|| run(&packing, law))
        };
        let one = on(1);
        assert!(one.1.len() > 500, "{}", one.1.len());
        assert!(on(2) == one && on(4) == one, "{law}");
    }
}

#[test]
fn numbering_changes_no_bit_over_steps() {
    let packing = Packing::<3>::fluid(1000, 0.48, 6);
    let mut order: Vec<usize> = (0..1000).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(8));
    let shuffled = Packing { positions: order.iter().map(|&i| packing.positions[i]).collect(), ..packing };
    for law in [ContactLaw::Gluey, ContactLaw::Inelastic] {
        let (straight, contacts) = run(&packing, law);
        let (other, others) = run(&shuffled, law);
        assert!(order.iter().zip(&other).all(|(&i, x)| straight[i] == *x), "{law}");
        let mut forces = [contacts, others]
            .map(|contacts| contacts.iter().map(|contact| contact.lambda.to_bits()).collect::<Vec<u64>>());
        forces.iter_mut().for_each(|forces| forces.sort_unstable());
        assert_eq!(forces[0], forces[1], "{law}");
    }
}

/// A resumed model has searched anew; one that went on has not.
#[test]
fn a_resumed_run_goes_on_bit_for_bit() {
    let packing = Packing::<3>::fluid(1000, 0.48, 9);
    let mut straight = Suspension::new(&packing, tuning(ContactLaw::Gluey));
    (0..10).for_each(|_| straight.step(0.02));
    let state = straight.contact.checkpoint();
    let middle = Packing { positions: straight.positions.clone(), side: packing.side };
    let mut resumed = Suspension::new(&middle, tuning(ContactLaw::Gluey));
    resumed.contact.resume(state).expect("a memory");
    for _ in 0..10 {
        straight.step(0.002);
        resumed.step(0.002);
    }
    assert!(straight.contact.contacts().len() > 100);
    assert_eq!(straight.positions, resumed.positions);
    assert_eq!(straight.contact.contacts(), resumed.contact.contacts());
}
