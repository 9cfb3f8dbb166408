//! Initial configurations: random, in equilibrium, or on a lattice.

mod arrangement;
mod crystal;
mod error;
mod growth;
mod monte_carlo;
mod params;
mod separate;
mod sizes;

use gluey_geom::Vector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub use arrangement::{Arrangement, DEFAULT_SWEEPS};
pub use error::PackingError;
pub use params::{Amount, PackingParams};
pub use sizes::{LargeShare, Sizes};

use crate::{Container, for_each_pair};
use gluey_geom::ball_volume;
use params::mean;

/// Sweeps of the whole for each one after a stage of growth.
const SWEEPS_PER_STAGE_SWEEP: usize = 50;

/// Particles in a box.
#[derive(Clone, Debug, PartialEq)]
pub struct Packing<const D: usize> {
    /// Centres, inside the box.
    pub positions: Vec<Vector<D>>,
    /// Radii.
    pub radii: Vec<f64>,
}

/// Largest fraction of random arrangements, gaps included.
pub fn most_random<const D: usize>() -> f64 {
    if D == 2 { 0.78 } else { 0.57 }
}

impl<const D: usize> Packing<D> {
    /// Places particles in a container. The same parameters give the same particles, bit for bit.
    ///
    /// Above the fraction of freezing (0.49 in 3D, 0.70 in 2D) what comes out of the Monte Carlo moves is a
    /// fluid that has not frozen, and relaxes slowly.
    ///
    /// ```
    /// use gluey_geom::Vector;
    /// use gluey_suspension::{Container, packing::{Amount, Arrangement, Packing, PackingParams}};
    /// let container = Container::<3>::periodic(&Vector::<3>::repeat(1.0));
    /// let params = PackingParams {
    ///     arrangement: Arrangement::Random,
    ///     ..PackingParams::new(Amount::Count { fraction: 0.3, count: 50 })
    /// };
    /// let packing = Packing::new(&container, &params)?;
    /// assert!((packing.fraction(&container) - 0.3).abs() < 1e-12);
    /// assert!(packing.smallest_gap(&container) >= 0.0);
    /// # Ok::<(), gluey_suspension::packing::PackingError>(())
    /// ```
    pub fn new(container: &Container<D>, params: &PackingParams) -> Result<Self, PackingError> {
        params::check(container, params)?;
        let mut random = ChaCha8Rng::seed_from_u64(params.seed);
        let count = params::count(container, params)?;
        let radii = radii(container, params, params.sizes.sample::<D>(count, &mut random));
        if params.arrangement.is_lattice() {
            crystalline(container, params, radii, &mut random)
        } else {
            random_in(container, params, radii, &mut random)
        }
    }

    /// Volume of the particles over that of the container.
    pub fn fraction(&self, container: &Container<D>) -> f64 {
        fraction(container, &self.radii)
    }

    /// The smallest gap between two surfaces, or a surface and a wall; infinite for one particle without
    /// walls whose images are far.
    pub fn smallest_gap(&self, container: &Container<D>) -> f64 {
        self.pair_gap(container).min(self.wall_gap(container))
    }

    fn pair_gap(&self, container: &Container<D>) -> f64 {
        let largest = self.radii.iter().copied().fold(0.0, f64::max);
        let spacing = (container.volume() / self.radii.len() as f64).powf(1.0 / D as f64);
        let mut smallest = f64::INFINITY;
        for_each_pair(container, &self.positions, 2.0 * largest.max(spacing), |pair| {
            let touching = self.radii[pair.first] + self.radii[pair.second];
            smallest = smallest.min(pair.arm.norm() - touching);
        });
        smallest
    }

    fn wall_gap(&self, container: &Container<D>) -> f64 {
        let bounds = container.bounds();
        let walled: Vec<usize> = (0..D).filter(|&d| container.is_walled(d)).collect();
        let gap = |(x, radius): (&Vector<D>, &f64)| {
            let distance = |&d: &usize| (x[d] - bounds.lower[d]).min(bounds.upper[d] - x[d]);
            walled.iter().map(distance).fold(f64::INFINITY, f64::min) - radius
        };
        self.positions.iter().zip(&self.radii).map(gap).fold(f64::INFINITY, f64::min)
    }
}

fn fraction<const D: usize>(container: &Container<D>, radii: &[f64]) -> f64 {
    radii.iter().map(|&a| ball_volume::<D>(a)).sum::<f64>() / container.volume()
}

/// Radii of the wanted fraction, or of the wanted mean.
fn radii<const D: usize>(container: &Container<D>, params: &PackingParams, sample: Vec<f64>) -> Vec<f64> {
    let scale = match params.amount {
        Amount::Count { fraction: wanted, .. } | Amount::Radius { fraction: wanted, .. } => {
            (wanted / fraction(container, &sample)).powf(1.0 / D as f64)
        }
        Amount::CountAndRadius { radius, .. } => radius / mean(&sample),
    };
    sample.iter().map(|a| a * scale).collect()
}

fn crystalline<const D: usize>(
    container: &Container<D>,
    params: &PackingParams,
    radii: Vec<f64>,
    random: &mut ChaCha8Rng,
) -> Result<Packing<D>, PackingError> {
    let arrangement = params.arrangement;
    let positions = crystal::sites(arrangement, container, radii.len())?;
    let mut packing = Packing { positions, radii };
    let radius = mean(&packing.radii);
    let (least, pair_gap, wall_gap) =
        (params.min_gap * radius, packing.pair_gap(container), packing.wall_gap(container));
    if pair_gap.min(wall_gap) < least {
        let largest = ((2.0 * radius + pair_gap) / (2.0 + params.min_gap))
            .min((radius + wall_gap) / (1.0 + params.min_gap));
        let fraction = packing.fraction(container);
        let most = fraction * (largest / radius).powi(D as i32);
        return Err(PackingError::LatticeTooDense { arrangement, fraction, most });
    }
    // Both of a pair may move, walls do not.
    let room = (0.5 * (pair_gap - least)).min(wall_gap - least).min(radius);
    crystal::jitter(&mut packing.positions, params.jitter * room, random);
    Ok(packing)
}

fn random_in<const D: usize>(
    container: &Container<D>,
    params: &PackingParams,
    radii: Vec<f64>,
    random: &mut ChaCha8Rng,
) -> Result<Packing<D>, PackingError> {
    let gap = params.min_gap * mean(&radii);
    let enlarged: Vec<f64> = radii.iter().map(|a| a + 0.5 * gap).collect();
    let (with_gaps, most) = (fraction(container, &enlarged), most_random::<D>());
    if with_gaps > most {
        return Err(PackingError::TooDense { fraction: fraction(container, &radii), with_gaps, most });
    }
    check_room(container, &enlarged)?;
    let inner = inset(container, 0.5 * gap);
    let positions = match params.arrangement {
        Arrangement::Equilibrium { sweep_count } => {
            let in_stage = sweep_count / SWEEPS_PER_STAGE_SWEEP;
            let mut positions = growth::grow(&inner, &enlarged, in_stage, random)?;
            monte_carlo::equilibrate(&inner, &mut positions, &enlarged, sweep_count, random);
            positions
        }
        _ => growth::grow_evenly(&inner, &enlarged, random)?,
    };
    let positions = positions.iter().map(|x| container.wrapped(x)).collect();
    Ok(Packing { positions, radii })
}

/// The container with its walls moved inwards.
fn inset<const D: usize>(container: &Container<D>, by: f64) -> Container<D> {
    let mut bounds = *container.bounds();
    for d in (0..D).filter(|&d| container.is_walled(d)) {
        bounds.lower[d] += by;
        bounds.upper[d] -= by;
    }
    Container::new(bounds, std::array::from_fn(|d| !container.is_walled(d)))
}

/// Whether images of a particle are at least two particles apart, and walls one.
fn check_room<const D: usize>(container: &Container<D>, radii: &[f64]) -> Result<(), PackingError> {
    let radius = radii.iter().copied().fold(0.0, f64::max);
    let edges = container.bounds().extent();
    match (0..D).find(|&axis| edges[axis] < 4.0 * radius) {
        Some(axis) => Err(PackingError::ParticleTooLarge { radius, edge: edges[axis], axis }),
        None => Ok(()),
    }
}
