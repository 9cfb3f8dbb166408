//! A cloud of particles squeezed into a jammed cluster by `u = -x`, then pulled apart by `u = x`.

use gluey_contact::{
    ContactLaw, ContactModel, ContactParams, GammaUpdate, PairContact, SolverKind, StepGeometry,
};
use gluey_geom::{Matrix, Particle, Vector};
use gluey_motion::{BackgroundFlow, Configuration, Hydrodynamics, Integrator, LinearFlow, Scheme};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

struct Outcome {
    /// Smallest gap, in radii.
    smallest_gap: f64,
    /// Most contacts at a time.
    contact_count: usize,
    /// Farthest distance from the start at the end, in radii.
    miss: f64,
}

/// `step_count` steps of squeezing over the time `push`, and as many of release.
fn squeeze_and_release<const D: usize>(
    side: usize,
    push: f64,
    step_count: usize,
    params: ContactParams,
) -> Outcome {
    let dt = push / step_count as f64;
    let mut random = ChaCha8Rng::seed_from_u64(42);
    let mut jitter = || Vector::<D>::from_fn(|_, _| random.random_range(-0.25..0.25));
    let site = |i: usize| Vector::<D>::from_fn(|d, _| (i / side.pow(d as u32) % side) as f64);
    let centre = Vector::<D>::repeat(0.5 * (side - 1) as f64);
    let count = side.pow(D as u32);
    let mut particles: Vec<Particle<D>> =
        (0..count).map(|i| Particle::new((site(i) - centre) * 2.6 + jitter(), 1.0)).collect();
    let start = particles.clone();

    let sink = LinearFlow { gradient: -Matrix::<D>::identity(), origin: Vector::zeros() };
    let (mut flow, mut integrator) = (BackgroundFlow::new(sink), Integrator::new(Scheme::AdamsBashforth2));
    let mut contact = PairContact::<D>::new(params);
    let (radii, mut drift) = (vec![1.0; count], vec![Vector::zeros(); count]);
    let mut outcome = Outcome { smallest_gap: f64::INFINITY, contact_count: 0, miss: 0.0 };
    for shear_factor in [1.0, -1.0] {
        for _ in 0..step_count {
            let now = Configuration { shear_factor, ..Configuration::at(0.0, &particles) };
            let mut twists = flow.predict(&now).expect("no forces").twists;
            integrator.drift(dt, &mut drift);
            let positions: Vec<_> = particles.iter().map(|particle| particle.pose.position).collect();
            let velocity_weight = integrator.velocity_weight(dt);
            let step =
                StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight, dt };
            contact.correct(&step, &mut twists).expect("feasible");
            integrator.advance(dt, &mut particles, &twists);
            outcome.contact_count = outcome.contact_count.max(contact.contacts().len());
            assert!(contact.contacts().iter().all(|contact| contact.gamma <= 0.0));
            for (i, particle) in particles.iter().enumerate() {
                let gaps = particles[..i].iter().map(|other| particle.gap(other));
                outcome.smallest_gap = gaps.fold(outcome.smallest_gap, f64::min);
            }
        }
        integrator.reverse();
        contact.reverse();
    }
    let misses = particles.iter().zip(&start);
    outcome.miss =
        misses.map(|(now, then)| (now.pose.position - then.pose.position).norm()).fold(0.0, f64::max);
    outcome
}

fn check<const D: usize>(side: usize, push: f64, step_count: usize, miss: f64) {
    let tuning = |law| ContactParams {
        law,
        exact_gap: true,
        gamma_update: GammaUpdate::Consistent,
        solver: SolverKind::ActiveSet,
        tolerance: 1e-11,
        ..Default::default()
    };
    let gluey = squeeze_and_release::<D>(side, push, step_count, tuning(ContactLaw::Gluey));
    println!("{D}D: {} contacts", gluey.contact_count);
    assert!(2 * gluey.contact_count > side.pow(D as u32), "{} contacts", gluey.contact_count);
    assert!(gluey.smallest_gap >= -1e-10, "{:e}", gluey.smallest_gap);
    println!("{D}D: gluey misses by {:.2e}", gluey.miss);
    assert!(gluey.miss < miss, "{}", gluey.miss);
    let inelastic = squeeze_and_release::<D>(side, push, step_count, tuning(ContactLaw::Inelastic));
    assert!(inelastic.smallest_gap >= -1e-10, "{:e}", inelastic.smallest_gap);
    assert!(inelastic.miss > 100.0 * miss, "{}", inelastic.miss);
}

#[test]
fn a_gluey_cluster_comes_apart_as_it_came_together() {
    check::<2>(6, 1.0, 100, 5e-3);
    check::<3>(3, 1.0, 100, 5e-3);
}

#[test]
fn two_hundred_particles_come_back_to_a_thousandth_of_a_radius() {
    check::<2>(15, 0.3, 400, 1e-3);
    check::<3>(6, 0.3, 400, 1e-3);
}
