//! Everything the particles did, step by step.

use gluey_geom::{Dim, Particle, Space, Spin, Twist, Vector};
use gluey_levelset::nearest_image;
use serde::{Deserialize, Serialize};

use crate::interpolate::cubic;

/// Positions and spins of all particles at the start of every step and at the end of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Trajectory<const D: usize>
where
    Dim<D>: Space<D>,
{
    radii: Vec<f64>,
    /// Length of the period in each direction that has one.
    periods: Vec<Option<f64>>,
    times: Vec<f64>,
    positions: Vec<Vector<D>>,
    spins: Vec<Spin<D>>,
}

/// One instant of a [`Trajectory`].
#[derive(Clone, Copy, Debug)]
pub struct Row<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Time.
    pub time: f64,
    /// Radii, one a particle.
    pub radii: &'a [f64],
    /// Length of the period in each direction that has one.
    pub periods: &'a [Option<f64>],
    /// Centres, one a particle; they are not brought back into the period.
    pub positions: &'a [Vector<D>],
    /// Spins, one a particle.
    pub spins: &'a [Spin<D>],
}

impl<const D: usize> Row<'_, D>
where
    Dim<D>: Space<D>,
{
    /// Gap between the surfaces of two particles, of their nearest images (Verdon et al. 2010, eq. 14).
    pub fn gap(&self, first: usize, second: usize) -> f64 {
        let direct = self.positions[second] - self.positions[first];
        let nearest = Vector::<D>::from_fn(|d, _| nearest_image(direct[d], self.periods[d]));
        nearest.norm() - (self.radii[first] + self.radii[second])
    }

    /// All pairs, `(0, 1), (0, 2), (1, 2), ...` in the order 12, 13, ..., 23, ... of the output.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<D> {
        let count = self.radii.len();
        (0..count).flat_map(move |first| (first + 1..count).map(move |second| (first, second)))
    }

    /// The smallest gap of all pairs; `None` for fewer than two particles.
    pub fn smallest_gap(&self) -> Option<f64> {
        self.pairs().map(|(first, second)| self.gap(first, second)).reduce(f64::min)
    }
}

impl<const D: usize> Trajectory<D>
where
    Dim<D>: Space<D>,
{
    /// No rows yet, for particles of these radii in a space of these periods.
    pub fn new(radii: Vec<f64>, periods: [Option<f64>; D]) -> Self {
        Self { radii, periods: periods.to_vec(), times: Vec::new(), positions: Vec::new(), spins: Vec::new() }
    }

    /// Adds the state at `time`, later than all before.
    pub fn push(&mut self, time: f64, particles: &[Particle<D>], twists: &[Twist<D>]) {
        self.times.push(time);
        self.positions.extend(particles.iter().map(|particle| particle.pose.position));
        self.spins.extend(twists.iter().map(|twist| twist.spin));
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Number of particles.
    pub fn particle_count(&self) -> usize {
        self.radii.len()
    }

    /// Times of all rows, ascending.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Mean radius of the particles.
    pub fn mean_radius(&self) -> f64 {
        self.radii.iter().sum::<f64>() / self.radii.len() as f64
    }

    /// Row `index`, from 0.
    pub fn row(&self, index: usize) -> Row<'_, D> {
        let count = self.radii.len();
        let range = index * count..(index + 1) * count;
        Row {
            time: self.times[index],
            radii: &self.radii,
            periods: &self.periods,
            positions: &self.positions[range.clone()],
            spins: &self.spins[range],
        }
    }

    /// All rows in order.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_, D>> {
        (0..self.len()).map(|index| self.row(index))
    }

    /// Gap of a pair at time `t`, interpolated between rows.
    pub fn gap_at(&self, first: usize, second: usize, t: f64) -> Option<f64> {
        cubic(&self.times, |index| self.row(index).gap(first, second), t)
    }

    /// Whether the parts fit together, as they do unless they came from a damaged file.
    pub fn is_consistent(&self) -> bool {
        let entries = self.times.len().checked_mul(self.radii.len());
        entries == Some(self.positions.len()) && entries == Some(self.spins.len()) && self.periods.len() == D
    }
}
