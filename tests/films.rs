//! Random clusters of particles with films of 1e-4 to 1 radii between them, at walls and at sides through
//! which the flow comes in: every step is solved, nothing touches, nothing moves faster than the flow.

use gluey::case::ParticleSpec;
use gluey::{Case, RunOptions, Silent, run};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

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
type Particle = (Vec<f64>, f64);

/// Up to `count` particles in the unit box, most of them near a wall, an inflow or each other.
fn cluster(random: &mut ChaCha8Rng, dimension: usize, count: usize, is_periodic: bool) -> Vec<Particle> {
    let mut particles: Vec<Particle> = Vec::new();
    let smallest = if dimension == 2 { 0.05 } else { 0.08 };
    for _ in 0..20 * count {
        if particles.len() == count {
            break;
        }
        let radius = smallest * [1.0, 1.0, 1.4, 2.0].choose(random).expect("not empty");
        let gap = |random: &mut ChaCha8Rng, radius: f64| radius * 10f64.powf(random.random_range(-4.0..0.0));
        let center: Vec<f64> = match particles.choose(random) {
            Some((other, own)) if random.random_bool(0.8) => {
                let distance = own + radius + gap(random, own.min(radius));
                let arm = direction(random, dimension);
                other.iter().zip(arm).map(|(x, n)| x + distance * n).collect()
            }
            _ => {
                let mut center: Vec<f64> =
                    (0..dimension).map(|_| random.random_range(radius..1.0 - radius)).collect();
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
fn direction(random: &mut ChaCha8Rng, dimension: usize) -> Vec<f64> {
    loop {
        let arm: Vec<f64> = (0..dimension).map(|_| random.random_range(-1.0..1.0)).collect();
        let length = arm.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (0.1..1.0).contains(&length) {
            return arm.iter().map(|x| x / length).collect();
        }
    }
}

/// Whether a particle is in the box, overlaps no other, and is not about to leave the box.
fn has_room(particles: &[Particle], center: &[f64], radius: f64) -> bool {
    let least = LEAST * radius;
    let in_box = center.iter().all(|x| (radius + least..1.0 - radius - least).contains(x));
    let goes_right = center[1] > 0.5;
    let ahead = if goes_right { 1.0 - center[0] } else { center[0] };
    let is_apart = |(other, own): &Particle| {
        let square: f64 = other.iter().zip(center).map(|(a, b)| (a - b).powi(2)).sum();
        square.sqrt() > own + radius + LEAST * own.min(radius)
    };
    in_box && ahead > radius + ROOM && particles.iter().all(is_apart)
}

/// The case of a seed.
fn case(dimension: usize, seed: u64) -> Case {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let is_periodic = random.random_bool(0.4);
    let count = random.random_range(if dimension == 2 { 2..12 } else { 2..5 });
    let particles = cluster(random, dimension, count, is_periodic);
    let boundary = if is_periodic { "periodic" } else { "couette" };
    let cells = *[1.3, 1.6, 3.2][..if dimension == 2 { 3 } else { 2 }].choose(random).expect("not empty");
    let center = &particles[0].0;
    let text = format!(
        "name = \"films\"\ndimension = {dimension}\n\
         particles = [{{ position = {center:?}, radius = {} }}]\n\
         domain.boundary = \"{boundary}\"\n\
         time = {{ step = {STEP}, end = {} }}\n\
         contact.strategy = \"none\"\n\
         flow = {{ formulation = \"unfitted\", mesh.cells_per_radius = {cells} }}\n",
        particles[0].1,
        STEP * STEPS as f64
    );
    let mut case = Case::parse(&text, "films.toml").expect("a good case");
    case.particles =
        particles.into_iter().map(|(center, radius)| ParticleSpec::new(center, radius)).collect();
    case
}

/// Runs the case of a seed, and returns its smallest gap in radii.
fn runs(dimension: usize, seed: u64) -> f64 {
    let case = case(dimension, seed);
    let folder = tempfile::TempDir::new().expect("a folder");
    let csv = folder.path().join("out.csv");
    let report = run(&case, &RunOptions::csv(&csv), &Silent)
        .unwrap_or_else(|error| panic!("seed {seed}: {error}\n{:?}", case.particles));
    let gap = report.min_gap_over_a.unwrap_or(f64::INFINITY);
    assert!(gap > 0.0, "seed {seed}: {report}");
    let text = std::fs::read_to_string(csv).expect("a trajectory");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let row = |k: usize, name: &str| -> f64 {
        let column = header.iter().position(|column| *column == name).expect("a column");
        rows[k][column].parse().expect("a number")
    };
    for particle in 1..=case.particles.len() {
        let moved = ["x", "y", "z"][..dimension].iter().map(|axis| {
            let name = format!("{axis}{particle}");
            let way = row(rows.len() - 1, &name) - row(0, &name);
            // Across the border of a periodic box.
            if *axis == "x" { way - way.round() } else { way }
        });
        let way = moved.map(|x| x * x).sum::<f64>().sqrt();
        let most = FASTEST * STEP * STEPS as f64;
        assert!(way < most, "seed {seed}: particle {particle} moved by {way}, the flow by {most}");
    }
    gap
}

#[test]
fn clusters_of_discs() {
    let gaps = (0..24).map(|seed| runs(2, seed));
    let smallest = gaps.fold(f64::INFINITY, f64::min);
    assert!(smallest < 1e-3, "no thin film was tried: {smallest}");
}

#[test]
fn clusters_of_spheres() {
    let gaps = (100..108).map(|seed| runs(3, seed));
    let smallest = gaps.fold(f64::INFINITY, f64::min);
    assert!(smallest < 1e-2, "no thin film was tried: {smallest}");
}
