//! Random clusters of particles with films of 1e-4 to 1 radii between them, at walls and at sides through
//! which the flow comes in: every step is solved, nothing touches, nothing moves faster than the flow.

use gluey::case::ParticleSpec;
use gluey::{Case, RunOptions, Silent};
use gluey_geom::Vector;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::runs::{centers, run};

/// Time step, and how many.
const STEP: f64 = 0.01;
const STEPS: usize = 2;
/// Largest speed of the flow, `u = y - 1/2` in the unit box.
const FASTEST: f64 = 0.5;
/// Least distance from a side through which the flow goes out, after which a particle may leave the box.
const ROOM: f64 = 2.0 * FASTEST * STEP * STEPS as f64;
/// Least gap, in radii.
const LEAST: f64 = 5e-5;

/// A particle: centre and radius.
type Particle<const D: usize> = (Vector<D>, f64);

/// Up to `count` particles in the unit box, most of them near a wall, an inflow or each other.
fn cluster<const D: usize>(random: &mut ChaCha8Rng, count: usize, is_periodic: bool) -> Vec<Particle<D>> {
    let mut particles: Vec<Particle<D>> = Vec::new();
    let smallest = if D == 2 { 0.05 } else { 0.08 };
    for _ in 0..20 * count {
        if particles.len() == count {
            break;
        }
        let radius = smallest * [1.0, 1.0, 1.4, 2.0].choose(random).expect("not empty");
        let gap = |random: &mut ChaCha8Rng, radius: f64| radius * 10f64.powf(random.random_range(-4.0..0.0));
        let center = match particles.choose(random) {
            Some((other, own)) if random.random_bool(0.8) => {
                let distance = own + radius + gap(random, own.min(radius));
                other + direction(random) * distance
            }
            _ => {
                let mut center = Vector::<D>::from_fn(|_, _| random.random_range(radius..1.0 - radius));
                let at_side = radius + gap(random, radius);
                let is_upper = center[1] > 0.5;
                match random.random_range(0..4) {
                    0 => {}
                    // The side through which the flow comes in at this height.
                    1 if !is_periodic => center[0] = if is_upper { at_side } else { 1.0 - at_side },
                    // A wall.
                    _ => center[1] = if is_upper { 1.0 - at_side } else { at_side },
                }
                center
            }
        };
        if has_room(&particles, &center, radius) {
            particles.push((center, radius));
        }
    }
    particles
}

/// A direction in no preferred one.
fn direction<const D: usize>(random: &mut ChaCha8Rng) -> Vector<D> {
    loop {
        let arm = Vector::<D>::from_fn(|_, _| random.random_range(-1.0..1.0));
        if (0.1..1.0).contains(&arm.norm()) {
            return arm.normalize();
        }
    }
}

/// Whether a particle is in the box, overlaps no other, and is not about to leave the box.
fn has_room<const D: usize>(particles: &[Particle<D>], center: &Vector<D>, radius: f64) -> bool {
    let least = LEAST * radius;
    let in_box = center.iter().all(|x| (radius + least..1.0 - radius - least).contains(x));
    let goes_right = center[1] > 0.5;
    let ahead = if goes_right { 1.0 - center[0] } else { center[0] };
    let is_apart =
        |(other, own): &Particle<D>| (other - center).norm() > own + radius + LEAST * own.min(radius);
    in_box && ahead > radius + ROOM && particles.iter().all(is_apart)
}

/// The case of a seed.
fn case<const D: usize>(seed: u64) -> Case {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let is_periodic = random.random_bool(0.4);
    let count = random.random_range(if D == 2 { 2..12 } else { 2..5 });
    let particles = cluster::<D>(random, count, is_periodic);
    let boundary = if is_periodic { "periodic" } else { "couette" };
    let cells = *[1.3, 1.6, 3.2][..if D == 2 { 3 } else { 2 }].choose(random).expect("not empty");
    let center = particles[0].0.as_slice();
    let text = format!(
        "name = \"films\"\ndimension = {D}\n\
         particles = [{{ position = {center:?}, radius = {} }}]\n\
         domain.boundary = \"{boundary}\"\n\
         time = {{ step = {STEP}, end = {} }}\n\
         contact.strategy = \"none\"\n\
         flow = {{ formulation = \"unfitted\", mesh = {{ cells_per_radius = {cells}, root_cells = 1 }} }}\n",
        particles[0].1,
        STEP * STEPS as f64
    );
    let mut case = Case::parse(&text, "films.toml").expect("a good case");
    let spec = |(center, radius): &Particle<D>| ParticleSpec::new(center.as_slice().to_vec(), *radius);
    case.particles = particles.iter().map(spec).collect();
    case
}

/// Runs the case of a seed, and returns its smallest gap in radii.
fn smallest_gap<const D: usize>(seed: u64) -> f64 {
    let case = case::<D>(seed);
    let folder = tempfile::TempDir::new().expect("a folder");
    let csv = folder.path().join("out.csv");
    let report = run(&case, &RunOptions::csv(&csv), &Silent)
        .unwrap_or_else(|error| panic!("seed {seed}: {error}\n{:?}", case.particles));
    let gap = report.min_gap_over_a.unwrap_or(f64::INFINITY);
    assert!(gap > 0.0, "seed {seed}: {report}");
    let places = centers::<D>(&csv, case.particles.len());
    let most = FASTEST * STEP * STEPS as f64;
    for (particle, (from, to)) in places[0].iter().zip(&places[places.len() - 1]).enumerate() {
        let mut way = to - from;
        // Across the border of a periodic box.
        way[0] -= way[0].round();
        let way = way.norm();
        assert!(way < most, "seed {seed}: particle {} moved by {way}, the flow by {most}", particle + 1);
    }
    gap
}

#[test]
fn clusters_of_discs() {
    let gaps = (0..24).map(smallest_gap::<2>);
    let smallest = gaps.fold(f64::INFINITY, f64::min);
    assert!(smallest < 1e-3, "no thin film was tried: {smallest}");
}

#[test]
fn clusters_of_spheres() {
    let gaps = (100..108).map(smallest_gap::<3>);
    let smallest = gaps.fold(f64::INFINITY, f64::min);
    assert!(smallest < 1e-2, "no thin film was tried: {smallest}");
}
