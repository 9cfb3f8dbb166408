//! Runs with many contacts, compared bit for bit with what they gave when they were recorded: a change of the
//! code that is not meant to change results changes none of these numbers. Who changes results on purpose
//! replaces those that fail.
//!
//! The cases use no functions but those that IEEE 754 fixes (no sine, no power), so that they are the same on
//! all machines.

use gluey_contact::{
    ContactLaw, ContactModel, ContactParams, Domain, GammaUpdate, Mobility, PairContact, SolverKind,
    StepGeometry, StokesDrag, Wall, WithFixed,
};
use gluey_geom::{Particle, Twist, Vector};
use gluey_motion::{Integrator, Scheme};

/// The sum of Fowler, Noll and Vo (FNV-1a) over the bits of numbers.
struct Fingerprint(u64);

impl Fingerprint {
    fn add(&mut self, bits: u64) {
        for byte in bits.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }
}

/// A number in `0..1` without a pattern.
fn noise(i: usize) -> f64 {
    let mut state = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((state ^ (state >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Every particle moves every other a little, and so do forces on it.
struct Coupled;

impl<const D: usize> Mobility<D> for Coupled {
    const COUPLED: bool = true;

    fn own(&self, _particle: usize, radius: f64) -> f64 {
        1.0 / radius
    }

    fn apply(&self, radii: &[f64], forces: &[Vector<D>], velocities: &mut [Vector<D>]) {
        let mean = forces.iter().sum::<Vector<D>>() / (10.0 * forces.len() as f64);
        for (velocity, (force, radius)) in velocities.iter_mut().zip(forces.iter().zip(radii)) {
            *velocity = (force * 0.9 + mean) / *radius;
        }
    }
}

/// Discs or spheres on a lattice out of order, periodic along x, between a floor and a ceiling, squeezed and
/// sheared there and back. Returns the most contacts of a step, and the fingerprint of forces, memories and
/// positions.
fn run<const D: usize, M: Mobility<D>>(params: ContactParams, mobility: M, side: usize) -> (usize, u64) {
    let spacing = 2.05;
    let length = spacing * side as f64;
    let index = |i: usize, d: usize| i / side.pow(d as u32) % side;
    let count = side.pow(D as u32);
    let site = |i: usize| {
        Vector::<D>::from_fn(|d, _| spacing * (index(i, d) as f64 + 0.5) + 0.1 * (noise(D * i + d) - 0.5))
    };
    let mut particles: Vec<Particle<D>> =
        (0..count).map(|i| Particle::new(site(i), 0.85 + 0.15 * noise(7 * count + i))).collect();
    let radii: Vec<f64> = particles.iter().map(|particle| particle.radius).collect();
    let up = Vector::<D>::from_fn(|d, _| if d == 1 { 1.0 } else { 0.0 });
    let ceiling = Wall { speed: 0.02, ..Wall::new(&(up * length), &-up) };
    let domain = Domain::default()
        .with_period(0, length)
        .with_wall(Wall::new(&Vector::zeros(), &up))
        .with_wall(ceiling);
    let mut contact = PairContact::with_mobility(params, mobility).within(domain);
    let mut integrator = Integrator::<D>::new(Scheme::AdamsBashforth2);
    let (dt, middle) = (0.05, 0.5 * length);
    let mut drift = vec![Vector::zeros(); count];
    let (mut most, mut fingerprint) = (0, Fingerprint(0xcbf2_9ce4_8422_2325));
    for n in 0..24 {
        let sign = if n < 14 { 1.0 } else { -1.0 };
        if n == 14 {
            integrator.reverse();
            contact.reverse();
        }
        let flow = |particle: &Particle<D>| {
            let x = particle.pose.position;
            let squeeze =
                Vector::<D>::from_fn(|d, _| if d == 0 { x[1] - middle } else { 0.4 * (middle - x[d]) });
            Twist { velocity: squeeze * sign, ..Twist::default() }
        };
        let mut twists: Vec<Twist<D>> = particles.iter().map(flow).collect();
        integrator.drift(dt, &mut drift);
        let positions: Vec<Vector<D>> = particles.iter().map(|particle| particle.pose.position).collect();
        let step = StepGeometry {
            positions: &positions,
            radii: &radii,
            drift: &drift,
            velocity_weight: integrator.velocity_weight(dt),
            dt,
        };
        let report = contact.correct(&step, &mut twists).unwrap_or_else(|error| panic!("step {n}: {error}"));
        fingerprint.add(report.iterations as u64);
        fingerprint.add(report.passes as u64);
        fingerprint.add(report.residual.to_bits());
        for pair in contact.contacts() {
            [pair.lambda, pair.gamma, pair.gap].iter().for_each(|x| fingerprint.add(x.to_bits()));
        }
        integrator.advance(dt, &mut particles, &twists);
        particles
            .iter()
            .for_each(|particle| particle.pose.position.iter().for_each(|x| fingerprint.add(x.to_bits())));
        most = most.max(contact.contacts().len());
    }
    (most, fingerprint.0)
}

fn params(law: ContactLaw, gamma_update: GammaUpdate, solver: SolverKind) -> ContactParams {
    ContactParams { law, gamma_update, solver, exact_gap: true, tolerance: 1e-9, ..ContactParams::default() }
}

#[test]
fn laws_and_solvers_give_the_recorded_bits() {
    use ContactLaw::{Gluey, Inelastic, VelocityCorrection};
    use GammaUpdate::{Consistent, Paper};
    use SolverKind::{Accelerated, ActiveSet, Auto, Uzawa};
    for (law, gamma_update, solver, disc_bits, sphere_bits) in [
        (Gluey, Consistent, Auto, 0xe7ef_0812_d767_db2a, 0xbd1c_5f5f_5b6f_70be),
        (Gluey, Consistent, ActiveSet, 0xcf90_7cef_6a09_252f, 0x739d_348d_7736_57fb),
        (Gluey, Consistent, Accelerated, 0x50c5_0edc_2815_e273, 0x6cd3_686f_b4bd_886a),
        (Inelastic, Paper, Uzawa, 0xdbb0_1fca_8a9e_a823, 0x0653_d63b_ff45_81fe),
        (Inelastic, Paper, Auto, 0xab2e_6980_bee1_c9f7, 0x4a81_7c46_cf8f_dffe),
        (VelocityCorrection, Paper, Auto, 0xc61f_a736_d923_0d7c, 0x99e2_7dba_4309_8444),
    ] {
        let params = params(law, gamma_update, solver);
        let (disc_contacts, discs) = run::<2, _>(params.clone(), StokesDrag, 12);
        let (sphere_contacts, spheres) = run::<3, _>(params, StokesDrag, 5);
        assert!(disc_contacts > 180 && sphere_contacts > 210, "{disc_contacts} {sphere_contacts}");
        assert_eq!([discs, spheres], [disc_bits, sphere_bits], "{law} {solver}: {discs:x} {spheres:x}");
    }
}

#[test]
fn mobilities_give_the_recorded_bits() {
    let params = || params(ContactLaw::Gluey, GammaUpdate::Consistent, SolverKind::ActiveSet);
    let fixed = || WithFixed::new([3, 40]);
    let found = [run::<2, _>(params(), fixed(), 12), run::<3, _>(params(), fixed(), 5)];
    assert_eq!(found, [(0x106, 0xf5e2_c5c9_95ae_052d), (0xf4, 0xb779_1b74_7931_4589)], "{found:x?}");
    let found = [run::<2, _>(params(), Coupled, 8), run::<3, _>(params(), Coupled, 4)];
    assert_eq!(found, [(0x4e, 0x32e4_9b9a_5a94_9d42), (0x6f, 0x9e93_c090_e8eb_f338)], "{found:x?}");
}

#[test]
fn the_paper_s_first_order_law_gives_the_recorded_bits() {
    let params = || ContactParams {
        exact_gap: false,
        ..params(ContactLaw::Gluey, GammaUpdate::Paper, SolverKind::ActiveSet)
    };
    let found = [run::<2, _>(params(), StokesDrag, 6), run::<3, _>(params(), StokesDrag, 3)];
    assert_eq!(found, [(0x21, 0x7082_2cc7_5baf_3e76), (0x24, 0xd3c5_115b_6de1_cca5)], "{found:x?}");
}
