//! One instant of a run, and what of all instants the report needs.

use gluey_contact::Domain;
use gluey_geom::{Lattice, Particle, Twist, Vector};

use crate::interpolate::cubic;

/// Particles at an instant, and how they move.
#[derive(Clone, Copy, Debug)]
pub struct TrajectoryRow<'a, const D: usize> {
    /// Time.
    pub time: f64,
    /// Particles; their centres are not brought back into the period.
    pub particles: &'a [Particle<D>],
    /// Their velocities and spins.
    pub twists: &'a [Twist<D>],
    /// Their walls and periods.
    pub domain: &'a Domain<D>,
}

impl<const D: usize> TrajectoryRow<'_, D> {
    /// Mean radius of the particles.
    pub fn mean_radius(&self) -> f64 {
        self.particles.iter().map(|particle| particle.radius).sum::<f64>() / self.particles.len() as f64
    }

    /// Gap between the surfaces of two particles, of their nearest images (Verdon et al. 2010, eq. 14).
    pub fn gap(&self, first: usize, second: usize) -> f64 {
        let [one, other] = [first, second].map(|particle| &self.particles[particle]);
        let distance = separation(&one.pose.position, &other.pose.position, &self.domain.lattice).norm();
        distance - (one.radius + other.radius)
    }

    /// Whether the nearest image of a particle is the particle itself.
    pub fn is_direct(&self, first: usize, second: usize) -> bool {
        let [one, other] = [first, second].map(|particle| &self.particles[particle].pose.position);
        separation(one, other, &self.domain.lattice) == other - one
    }

    /// All pairs, `(0, 1), (0, 2), (1, 2), ...` in the order 12, 13, ..., 23, ... of the output.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<D> {
        let count = self.particles.len();
        (0..count).flat_map(move |first| (first + 1..count).map(move |second| (first, second)))
    }
}

/// Vector from one point to the nearest image of another.
fn separation<const D: usize>(one: &Vector<D>, other: &Vector<D>, lattice: &Lattice<D>) -> Vector<D> {
    lattice.nearest(&(other - one)).0
}

/// History of particles 1 and 2 for the report: three numbers per row.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PairHistory {
    times: Vec<f64>,
    gaps: Vec<f64>,
    /// How far particle 2 is ahead of particle 1 in x.
    ahead: Vec<f64>,
}

impl PairHistory {
    /// Adds the instant `time`, later than all before, at which two particles of radii `radii` are at
    /// `centers`.
    pub fn push<const D: usize>(
        &mut self,
        time: f64,
        centers: [&Vector<D>; 2],
        radii: [f64; 2],
        lattice: &Lattice<D>,
    ) {
        let [one, other] = centers;
        self.times.push(time);
        // The same expression as in `Row::gap`, so that both are equal bit for bit.
        self.gaps.push(separation(one, other, lattice).norm() - (radii[0] + radii[1]));
        self.ahead.push(other[0] - one[0]);
    }

    /// Gap at the end.
    pub fn end_gap(&self) -> Option<f64> {
        self.gaps.last().copied()
    }

    /// Last time.
    pub fn end(&self) -> Option<f64> {
        self.times.last().copied()
    }

    /// Gap at time `t`, interpolated between rows.
    pub fn gap_at(&self, t: f64) -> Option<f64> {
        cubic(&self.times, |index| self.gaps[index], t)
    }

    /// The last time when the particles are abreast in x.
    pub fn last_crossing(&self) -> Option<f64> {
        let (times, ahead) = (&self.times, &self.ahead);
        let crosses = |index: usize| (ahead[index] > 0.0) != (ahead[index + 1] > 0.0);
        let index = (0..times.len().saturating_sub(1)).rev().find(|&index| crosses(index))?;
        let (mut before, mut after) = (times[index], times[index + 1]);
        // Bisection to the last bit or so.
        for _ in 0..60 {
            let middle = 0.5 * (before + after);
            let same_side = (cubic(times, |i| ahead[i], middle)? > 0.0) == (ahead[index] > 0.0);
            *(if same_side { &mut before } else { &mut after }) = middle;
        }
        Some(0.5 * (before + after))
    }
}
