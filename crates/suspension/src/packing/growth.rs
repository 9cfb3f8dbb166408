//! Random arrangements by growth: random points become particles whose radii grow in stages; after each the
//! contact model pushes apart what overlaps, and Monte Carlo moves even out the density while there is room.

use gluey_contact::{ContactError, ContactLaw, ContactParams, Domain, PairContact};
use gluey_contact::{StepGeometry, Wall};
use gluey_geom::{Twist, Vector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::separate::{self, Crowded};
use super::{PackingError, monte_carlo};
use crate::Container;
use gluey_geom::ball_volume;

/// Fraction at which points become particles: most do not meet.
const FIRST_FRACTION: f64 = 0.05;
/// Width of the scatter of even points, in mean distances of neighbours.
const SCATTER: f64 = 1.0;
/// Growth of the radii in a stage, at most.
const STAGE: f64 = 1.05;
/// Overlap that stages leave, relative to the radii.
const ROUGH: f64 = 1e-2;
/// Overlap that the last stage leaves, relative to the smallest radius; as much is added to the radii before.
/// With less, dense arrangements take a hundred times as long.
const FINE: f64 = 1e-3;
/// Sweeps over all pairs that a stage may take.
const SWEEP_LIMIT: usize = 50_000;

/// Centres of balls of these radii, in random places of the container, that do not overlap; with so many
/// Monte Carlo moves of each ball after every stage.
pub(super) fn grow<const D: usize>(
    container: &Container<D>,
    radii: &[f64],
    sweep_count: usize,
    random: &mut ChaCha8Rng,
) -> Result<Vec<Vector<D>>, PackingError> {
    let mut positions = points(container, radii, random);
    let enlarged: Vec<f64> = radii.iter().map(|radius| radius * (1.0 + FINE)).collect();
    let stages = stages::<D>(container, radii);
    for (stage, &scale) in stages.iter().enumerate() {
        let is_last = stage + 1 == stages.len();
        let radii: Vec<f64> = enlarged.iter().map(|radius| radius * scale).collect();
        separate(container, &mut positions, &radii, if is_last { FINE } else { ROUGH })
            .map_err(|source| PackingError::NotSettled { reached: scale, source })?;
        if !is_last {
            let apart: Vec<f64> = radii.iter().map(|radius| radius * (1.0 - ROUGH)).collect();
            monte_carlo::equilibrate(container, &mut positions, &apart, sweep_count, random);
        }
    }
    Ok(positions)
}

/// Centres of balls of these radii that do not overlap, without Monte Carlo moves. Points are spread evenly
/// before they grow: what is crowded over long distances would have to be pushed all the way, which takes
/// more time for each ball the more there are.
pub(super) fn grow_evenly<const D: usize>(
    container: &Container<D>,
    radii: &[f64],
    random: &mut ChaCha8Rng,
) -> Result<Vec<Vector<D>>, PackingError> {
    let mut positions = even_points(container, radii, random);
    let stages = stages::<D>(container, radii);
    for (stage, &scale) in stages.iter().enumerate() {
        let radii: Vec<f64> = radii.iter().map(|radius| radius * (1.0 + FINE) * scale).collect();
        let tolerance = if stage + 1 == stages.len() { FINE } else { ROUGH };
        separate::separate(container, &mut positions, &radii, tolerance)
            .map_err(|Crowded { overlap }| PackingError::Crowded { reached: scale, overlap })?;
    }
    Ok(positions)
}

/// Points of the sequence R_D (Roberts 2018), which is even for any number of them, scattered by about the
/// distance of neighbours; balls keep clear of the walls there.
fn even_points<const D: usize>(
    container: &Container<D>,
    radii: &[f64],
    random: &mut ChaCha8Rng,
) -> Vec<Vector<D>> {
    // The root of x^(D+1) = x + 1: its powers fill the axes.
    let root = (0..64).fold(2.0, |x: f64, _| (1.0 + x).powf(1.0 / (D as f64 + 1.0)));
    let bounds = container.bounds();
    let spacing = (container.volume() / radii.len() as f64).powf(1.0 / D as f64);
    let start = Vector::<D>::from_fn(|_, _| random.random_range(0.0..1.0));
    let point = |(number, radius): (usize, &f64)| {
        Vector::from_fn(|d, _| {
            let margin = if container.is_walled(d) { *radius } else { 0.0 };
            let room = bounds.upper[d] - bounds.lower[d] - 2.0 * margin;
            let even = start[d] + (number as f64 + 1.0) * root.powi(-1 - d as i32);
            let scattered = even + SCATTER * spacing / room * random.random_range(-0.5..0.5);
            bounds.lower[d] + margin + room * scattered.rem_euclid(1.0)
        })
    };
    radii.iter().enumerate().map(point).collect()
}

/// Points where balls keep clear of the walls.
fn points<const D: usize>(
    container: &Container<D>,
    radii: &[f64],
    random: &mut ChaCha8Rng,
) -> Vec<Vector<D>> {
    let bounds = container.bounds();
    let point = |radius: &f64| {
        Vector::from_fn(|d, _| {
            let margin = if container.is_walled(d) { *radius } else { 0.0 };
            let room = bounds.upper[d] - bounds.lower[d] - 2.0 * margin;
            bounds.lower[d] + margin + room * random.random_range(0.0..1.0)
        })
    };
    radii.iter().map(point).collect()
}

/// Factors of the radii, up to 1.
fn stages<const D: usize>(container: &Container<D>, radii: &[f64]) -> Vec<f64> {
    let fraction = radii.iter().map(|&a| ball_volume::<D>(a)).sum::<f64>() / container.volume();
    let first = (FIRST_FRACTION / fraction).powf(1.0 / D as f64).min(1.0);
    let count = (-first.ln() / STAGE.ln()).ceil().max(1.0);
    let mut stages: Vec<f64> = (0..count as usize).map(|k| first.powf(1.0 - k as f64 / count)).collect();
    stages.push(1.0);
    stages
}

/// Pushes particles apart until they overlap by no more than `tolerance` smallest radii.
fn separate<const D: usize>(
    container: &Container<D>,
    positions: &mut [Vector<D>],
    radii: &[f64],
    tolerance: f64,
) -> Result<(), ContactError> {
    let params = ContactParams {
        law: ContactLaw::VelocityCorrection,
        threshold: 0.0,
        tolerance,
        iteration_limit: SWEEP_LIMIT,
        ..ContactParams::default()
    };
    let drift = vec![Vector::zeros(); positions.len()];
    let mut moves = vec![Twist::default(); positions.len()];
    let step = StepGeometry { positions, radii, drift: &drift, velocity_weight: 1.0, dt: 1.0 };
    PairContact::new(params).within(domain(container)).correct(&step, &mut moves)?;
    positions.iter_mut().zip(&moves).for_each(|(x, twist)| *x += twist.velocity);
    Ok(())
}

/// The container as surroundings of contacts.
fn domain<const D: usize>(container: &Container<D>) -> Domain<D> {
    let bounds = container.bounds();
    (0..D).fold(Domain::default(), |domain, d| match container.lattice().periods()[d] {
        Some(period) => domain.with_period(d, period),
        None => {
            let inwards = Vector::<D>::from_fn(|k, _| f64::from(u8::from(k == d)));
            domain
                .with_wall(Wall::new(&bounds.lower, &inwards))
                .with_wall(Wall::new(&bounds.upper, &-inwards))
        }
    })
}
