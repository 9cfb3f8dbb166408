//! Near pairs, and the smallest gap, at a cost proportional to the number of particles.

use gluey_geom::Vector;
use gluey_suspension::{Container, for_each_pair};

use crate::trajectory::TrajectoryRow;

/// Room for rounding in the search, relative to lengths.
const SLACK: f64 = 1e-9;

/// Two particles and the smallest gap between their images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PairGap {
    /// Index of the first particle, from 0.
    pub first: usize,
    /// Index of the second particle, larger.
    pub second: usize,
    /// Distance of their surfaces.
    pub gap: f64,
}

/// All pairs with a gap of at most `reach >= 0`, sorted by particles.
pub(crate) fn within<const D: usize>(row: &TrajectoryRow<'_, D>, reach: f64) -> Vec<PairGap> {
    let lattice = row.domain.lattice.reduced();
    let centers: Vec<Vector<D>> = row.particles.iter().map(|particle| particle.pose.position).collect();
    let largest = row.particles.iter().map(|particle| particle.radius).fold(0.0, f64::max);
    let longest = lattice.periods().iter().flatten().copied().fold(0.0, f64::max);
    let slack = SLACK * (longest + 2.0 * largest + reach);
    let mut meeting = Vec::new();
    for_each_pair(&Container::of_lattice(lattice), &centers, 2.0 * largest + reach + slack, |pair| {
        let touching = row.particles[pair.first].radius + row.particles[pair.second].radius;
        if pair.first != pair.second && pair.arm.norm() <= touching + reach + slack {
            meeting.push((pair.first, pair.second));
        }
    });
    // Pairs may meet in several images.
    meeting.sort_unstable();
    meeting.dedup();
    let gaps =
        meeting.into_iter().map(|(first, second)| PairGap { first, second, gap: row.gap(first, second) });
    gaps.filter(|pair| pair.gap <= reach).collect()
}

/// The smallest gap of all pairs, exactly; `None` for fewer than two particles. `near` holds the pairs up to
/// `reach`.
pub(crate) fn smallest<const D: usize>(
    row: &TrajectoryRow<'_, D>,
    near: &[PairGap],
    mut reach: f64,
) -> Option<f64> {
    let smallest = |pairs: &[PairGap]| pairs.iter().map(|pair| pair.gap).reduce(f64::min);
    let mut found = smallest(near);
    // No pair is nearer than `reach`, so within twice that a particle has few neighbours, however many there
    // are.
    while found.is_none() && row.particles.len() > 1 && reach < f64::MAX {
        reach *= 2.0;
        found = smallest(&within(row, reach));
    }
    found
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
    fn agrees<const D: usize>(domain: &Domain<D>, count: usize, radius: f64, spread: f64) {
        let mut next = numbers();
        for _ in 0..20 {
            let particles: Vec<Particle<D>> = (0..count)
                .map(|_| {
                    let x = Vector::from_fn(|_, _| spread * (next() - 0.3));
                    Particle::new(x, radius * (0.5 + next()))
                })
                .collect();
            let twists = vec![Twist::default(); count];
            let row = TrajectoryRow { time: 0.0, particles: &particles, twists: &twists, domain };
            let all: Vec<PairGap> = row
                .pairs()
                .map(|(first, second)| PairGap { first, second, gap: row.gap(first, second) })
                .collect();
            let reach = radius;
            let near = within(&row, reach);
            let expected: Vec<_> = all.iter().copied().filter(|pair| pair.gap <= reach).collect();
            assert_eq!(near, expected);
            let smallest = all.iter().map(|pair| pair.gap).reduce(f64::min);
            assert_eq!(super::smallest(&row, &near, reach), smallest);
        }
    }

    fn agrees_everywhere<const D: usize>() {
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
