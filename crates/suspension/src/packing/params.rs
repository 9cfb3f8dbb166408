//! What to make: how many particles of which sizes.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::crystal::fitting_counts;
use super::{Arrangement, PackingError, Sizes};
use crate::Container;
use gluey_geom::ball_volume;

/// Radii that are drawn to know the mean volume of particles of several sizes.
const SAMPLE_COUNT: usize = 1000;

/// Two of the volume fraction (in 2D the area fraction), the number of particles and their mean radius; the
/// third follows from the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Amount {
    /// So many particles; their radii follow.
    Count {
        /// Volume of the particles over that of the box.
        fraction: f64,
        /// Number of particles.
        count: usize,
    },
    /// As many particles of this mean radius as come nearest to the fraction, which is then met exactly:
    /// radii differ a little from those asked for.
    Radius {
        /// Volume of the particles over that of the box.
        fraction: f64,
        /// Mean radius.
        radius: f64,
    },
    /// So many particles of this mean radius; the fraction follows.
    CountAndRadius {
        /// Number of particles.
        count: usize,
        /// Mean radius.
        radius: f64,
    },
}

/// The particles to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackingParams {
    /// How many particles of which size.
    pub amount: Amount,
    /// Distribution of the radii; lattices have equal ones.
    pub sizes: Sizes,
    /// How they are arranged.
    pub arrangement: Arrangement,
    /// Smallest gap between surfaces, in mean radii; between particles and walls it is the same.
    pub min_gap: f64,
    /// Displacements of particles from the sites of a lattice, relative to the largest that leave the
    /// smallest gap whatever the others do: from 0 to 1.
    pub jitter: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl PackingParams {
    /// Equal particles in equilibrium that may touch.
    pub fn new(amount: Amount) -> Self {
        Self {
            amount,
            sizes: Sizes::Equal,
            arrangement: Arrangement::default(),
            min_gap: 0.0,
            jitter: 0.0,
            seed: 1,
        }
    }
}

/// Whether the parameters are in their ranges.
pub(super) fn check<const D: usize>(
    container: &Container<D>,
    params: &PackingParams,
) -> Result<(), PackingError> {
    let tilt = container.lattice().tilt();
    if tilt != 0.0 {
        return Err(PackingError::Tilted { tilt });
    }
    let (fraction, count, radius) = match params.amount {
        Amount::Count { fraction, count } => (Some(fraction), Some(count), None),
        Amount::Radius { fraction, radius } => (Some(fraction), None, Some(radius)),
        Amount::CountAndRadius { count, radius } => (None, Some(count), Some(radius)),
    };
    fraction.map_or(Ok(()), |f| within("the volume fraction", f, f > 0.0 && f < 1.0, "between 0 and 1"))?;
    count.map_or(Ok(()), |n| {
        let is_right = (1..1 << 31).contains(&n);
        within("the number of particles", n as f64, is_right, "from 1 to 2^31 - 1")
    })?;
    radius.map_or(Ok(()), |a| within("the radius", a, a > 0.0 && a.is_finite(), "positive"))?;
    let (gap, jitter) = (params.min_gap, params.jitter);
    within("the smallest gap", gap, (0.0..=1.0).contains(&gap), "from 0 to 1 mean radii")?;
    within("the jitter", jitter, (0.0..=1.0).contains(&jitter), "from 0 to 1")?;
    params.sizes.check()
}

/// Number of particles.
pub(super) fn count<const D: usize>(
    container: &Container<D>,
    params: &PackingParams,
) -> Result<usize, PackingError> {
    match params.amount {
        Amount::Count { count, .. } | Amount::CountAndRadius { count, .. } => Ok(count),
        Amount::Radius { fraction, radius } => {
            let volume = ball_volume::<D>(radius) * spread::<D>(params);
            let wanted = fraction * container.volume() / volume;
            let is_right = wanted < f64::from(i32::MAX);
            within("the radius", radius, is_right, "so large that there are fewer than 2^31 particles")?;
            nearest_count(container, params, (wanted.round() as usize).max(1))
        }
    }
}

/// Mean volume of particles over the volume of one of the mean radius.
fn spread<const D: usize>(params: &PackingParams) -> f64 {
    let sample = params.sizes.sample::<D>(SAMPLE_COUNT, &mut ChaCha8Rng::seed_from_u64(params.seed));
    let mean = mean(&sample);
    sample.iter().map(|a| (a / mean).powi(D as i32)).sum::<f64>() / SAMPLE_COUNT as f64
}

/// The number of particles nearest to `count` that the arrangement can have.
fn nearest_count<const D: usize>(
    container: &Container<D>,
    params: &PackingParams,
    count: usize,
) -> Result<usize, PackingError> {
    if !params.arrangement.is_lattice() {
        return Ok(count);
    }
    let fitting = fitting_counts(params.arrangement, container, count)?;
    Ok(fitting.into_iter().min_by_key(|&fitting| fitting.abs_diff(count)).unwrap_or(count))
}

fn within(name: &'static str, value: f64, is_right: bool, wanted: &'static str) -> Result<(), PackingError> {
    if is_right { Ok(()) } else { Err(PackingError::OutOfRange { name, value, wanted }) }
}

/// Mean radius.
pub(super) fn mean(radii: &[f64]) -> f64 {
    radii.iter().sum::<f64>() / radii.len() as f64
}
