//! Near pairs, and the smallest gap, at a cost proportional to the number of particles.

use gluey_contact::broadphase::{BestOf, Broadphase};
use gluey_geom::{Dim, Lattice, Space, Vector};

use crate::trajectory::Row;

/// Room for rounding in the search, relative to lengths.
const SLACK: f64 = 1e-9;

/// Two particles and the smallest gap between their images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairGap {
    /// Index of the first particle, from 0.
    pub first: usize,
    /// Index of the second particle, larger.
    pub second: usize,
    /// Distance of their surfaces.
    pub gap: f64,
}

/// Finds near pairs; keeps its buffers.
#[derive(Debug, Default)]
pub struct NearPairs<const D: usize> {
    broadphase: BestOf,
    centers: Vec<Vector<D>>,
    reaches: Vec<f64>,
    /// Particle of each ball: those behind the particles are images across a periodic border.
    owners: Vec<u32>,
    meeting: Vec<(u32, u32)>,
}

impl<const D: usize> NearPairs<D>
where
    Dim<D>: Space<D>,
{
    /// No buffers yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// All pairs with a gap of at most `reach >= 0`, sorted by particles.
    pub fn within(&mut self, row: &Row<'_, D>, reach: f64) -> Vec<PairGap> {
        let count = row.particles.len();
        self.place_balls(row, reach);
        self.broadphase.meeting(&self.centers, &self.reaches, count, &mut self.meeting);
        // Of a pair across the border and its mirror image, one stays; a particle's own images do not count.
        for (first, second) in &mut self.meeting {
            let owner = self.owners[*second as usize];
            (*first, *second) = (owner.min(*first), owner.max(*first));
        }
        self.meeting.sort_unstable();
        self.meeting.dedup();
        let pairs = self.meeting.iter().filter(|(first, second)| first != second);
        let gaps = pairs.map(|&(first, second)| {
            let (first, second) = (first as usize, second as usize);
            PairGap { first, second, gap: row.gap(first, second) }
        });
        gaps.filter(|pair| pair.gap <= reach).collect()
    }

    /// The smallest gap of all pairs, exactly; `None` for fewer than two particles. `near` holds the pairs up
    /// to `reach`.
    pub fn smallest(&mut self, row: &Row<'_, D>, near: &[PairGap], mut reach: f64) -> Option<f64> {
        let smallest = |pairs: &[PairGap]| pairs.iter().map(|pair| pair.gap).reduce(f64::min);
        let mut found = smallest(near);
        // No pair is nearer than `reach`, so within twice that a particle has few neighbours, however many
        // there are.
        while found.is_none() && row.particles.len() > 1 && reach < f64::MAX {
            reach *= 2.0;
            found = smallest(&self.within(row, reach));
        }
        found
    }

    /// One ball per particle, as large as to meet those within `reach`, and the images that could meet one.
    fn place_balls(&mut self, row: &Row<'_, D>, reach: f64) {
        let lattice = row.domain.lattice.reduced();
        let longest = lattice.periods().iter().flatten().copied().fold(0.0, f64::max);
        self.centers.clear();
        self.centers.extend(row.particles.iter().map(|p| wrapped(p.pose.position, &lattice)));
        self.reaches.clear();
        self.reaches
            .extend(row.particles.iter().map(|p| (p.radius + 0.5 * reach) * (1.0 + SLACK) + SLACK * longest));
        self.owners.clear();
        self.owners.extend(0..row.particles.len() as u32);
        let margin = 2.0 * self.reaches.iter().copied().fold(0.0, f64::max);
        // Images across the border in y are moved along x, so x comes last.
        for axis in (0..D).rev() {
            if let Some(period) = lattice.periods()[axis] {
                self.add_images(axis, period, margin, &lattice);
            }
        }
    }

    /// Images of all balls so far, as many periods up or down an axis as come within the margin, or as the
    /// nearest ones can be.
    fn add_images(&mut self, axis: usize, period: f64, margin: f64, lattice: &Lattice<D>) {
        let is_tilted = axis < 2 && lattice.tilt() != 0.0;
        let across = if is_tilted { &lattice.periods()[..2] } else { &lattice.periods()[axis..=axis] };
        let farthest = 0.5 * across.iter().flatten().copied().fold(0.0, f64::hypot);
        let margin = margin.min(farthest * (1.0 + SLACK));
        let most = (margin / period).ceil() as i32;
        for ball in 0..self.centers.len() {
            for up in (-most..=most).filter(|&up| up != 0).map(f64::from) {
                let mut image = self.centers[ball];
                image[axis] += up * period;
                if axis == 1 && lattice.tilt() != 0.0 {
                    image[0] += up * lattice.tilt();
                    image = wrapped_along(0, image, lattice);
                }
                if image[axis] >= -margin && image[axis] <= period + margin {
                    self.centers.push(image);
                    self.reaches.push(self.reaches[ball]);
                    self.owners.push(self.owners[ball]);
                }
            }
        }
    }
}

/// A place brought into the periods.
fn wrapped<const D: usize>(x: Vector<D>, lattice: &Lattice<D>) -> Vector<D> {
    (0..D).rev().fold(x, |x, axis| wrapped_along(axis, x, lattice))
}

/// A place brought into the period of one axis.
fn wrapped_along<const D: usize>(axis: usize, mut x: Vector<D>, lattice: &Lattice<D>) -> Vector<D> {
    let Some(period) = lattice.periods()[axis] else { return x };
    let count = (x[axis] / period).floor();
    x[axis] -= period * count;
    if axis == 1 {
        x[0] -= lattice.tilt() * count;
    }
    x
}

#[cfg(test)]
mod tests {
    use gluey_contact::Domain;
    use gluey_geom::{Particle, Twist};

    use super::*;

    /// Numbers between 0 and 1 that are not in order.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 12345_u64;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// All pairs, and the smallest gap, are those of a look at every pair.
    fn agrees<const D: usize>(domain: &Domain<D>, count: usize, radius: f64, spread: f64)
    where
        Dim<D>: Space<D>,
    {
        let mut next = numbers();
        let mut search = NearPairs::new();
        for _ in 0..20 {
            let particles: Vec<Particle<D>> = (0..count)
                .map(|_| {
                    let x = Vector::from_fn(|_, _| spread * (next() - 0.3));
                    Particle::new(x, radius * (0.5 + next()))
                })
                .collect();
            let twists = vec![Twist::default(); count];
            let row = Row { time: 0.0, particles: &particles, twists: &twists, domain };
            let all: Vec<PairGap> = row
                .pairs()
                .map(|(first, second)| PairGap { first, second, gap: row.gap(first, second) })
                .collect();
            let reach = radius;
            let near = search.within(&row, reach);
            let expected: Vec<_> = all.iter().copied().filter(|pair| pair.gap <= reach).collect();
            assert_eq!(near, expected);
            let smallest = all.iter().map(|pair| pair.gap).reduce(f64::min);
            assert_eq!(search.smallest(&row, &near, reach), smallest);
        }
    }

    fn agrees_everywhere<const D: usize>()
    where
        Dim<D>: Space<D>,
    {
        let open = Domain::default();
        let channel = Domain::default().with_period(0, 1.0);
        let periodic = Domain::periodic(&Vector::<D>::repeat(1.0));
        let [mut tilted, mut sheared] = [periodic.clone(), periodic.clone()];
        tilted.set_sliding(0.5, 0.0);
        sheared.set_sliding(-3.3, 0.0);
        // Flat, so that the nearest image may be in a row far up or down.
        let mut flat = Domain::periodic(&Vector::from_fn(|d, _| [1.6, 0.2, 0.4][d]));
        flat.set_sliding(0.53, 0.0);
        for domain in [&open, &channel, &periodic, &tilted, &sheared, &flat] {
            // Dense, sparse, far apart, and far from the first period.
            for (count, radius, spread) in [
                (60, 0.1, 1.0),
                (40, 0.01, 1.0),
                (2, 1e-4, 1.0),
                (12, 1e-3, 40.0),
                (1, 0.1, 1.0),
                (0, 0.1, 1.0),
            ] {
                agrees(domain, count, radius, spread);
            }
        }
    }

    #[test]
    fn near_pairs_are_those_of_all_pairs() {
        agrees_everywhere::<2>();
        agrees_everywhere::<3>();
    }
}
