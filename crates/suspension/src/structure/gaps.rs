//! The gaps of nearest neighbours.

use gluey_geom::Vector;

use crate::{Container, for_each_pair};

/// Gaps between the surfaces of each particle and the nearest other one, or the nearest image of any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GapStatistics {
    /// The smallest of all.
    pub smallest: f64,
    /// One particle in a hundred has a smaller one.
    pub percentile: f64,
    /// Half of the particles have a smaller one.
    pub median: f64,
}

impl GapStatistics {
    /// The statistics of a configuration; `None` where a particle has no neighbour at all.
    pub fn of<const D: usize>(
        container: &Container<D>,
        positions: &[Vector<D>],
        radii: &[f64],
    ) -> Option<Self> {
        let mut gaps = nearest_gaps(container, positions, radii)?;
        gaps.sort_unstable_by(f64::total_cmp);
        Some(Self { smallest: gaps[0], percentile: quantile(&gaps, 0.01), median: quantile(&gaps, 0.5) })
    }
}

/// The gap of each particle to its nearest neighbour; `None` where one has none.
fn nearest_gaps<const D: usize>(
    container: &Container<D>,
    positions: &[Vector<D>],
    radii: &[f64],
) -> Option<Vec<f64>> {
    let has_neighbours = positions.len() > 1 || container.lattice().is_periodic();
    if positions.is_empty() || !has_neighbours {
        return None;
    }
    let largest = radii.iter().copied().fold(0.0, f64::max);
    let spacing = (container.volume() / positions.len() as f64).powf(1.0 / D as f64);
    let mut range = (2.5 * largest).max(1.2 * spacing);
    loop {
        let mut gaps = vec![f64::INFINITY; positions.len()];
        for_each_pair(container, positions, range, |pair| {
            let gap = pair.arm.norm() - radii[pair.first] - radii[pair.second];
            for particle in [pair.first, pair.second] {
                gaps[particle] = gap.min(gaps[particle]);
            }
        });
        // A particle that was not found is farther than the range.
        let is_sure = |(gap, radius): (&f64, &f64)| gap + radius + largest <= range;
        if gaps.iter().zip(radii).all(is_sure) {
            return Some(gaps);
        }
        range *= 1.5;
    }
}

/// The value below which this part of sorted ones lies, interpolated.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let place = part * (sorted.len() - 1) as f64;
    let below = place as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn nearest_gaps_equal_brute_force() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let container = Container::<3>::periodic(&Vector::repeat(1.0)).tilted(0.4);
        for count in [1, 2, 40] {
            let positions: Vec<Vector<3>> =
                (0..count).map(|_| Vector::from_fn(|_, _| random.random_range(0.0..1.0))).collect();
            let radii: Vec<f64> = (0..count).map(|i| 0.01 + 0.1 * f64::from(i % 4 == 0)).collect();
            let gap = |i: usize, j: usize| match i == j {
                true => 1.0 - 2.0 * radii[i],
                false => {
                    let (arm, _) = container.lattice().nearest(&(positions[j] - positions[i]));
                    arm.norm() - radii[i] - radii[j]
                }
            };
            let count = count as usize;
            let smallest = |i: usize| (0..count).map(|j| gap(i, j)).fold(f64::INFINITY, f64::min);
            let gaps = nearest_gaps(&container, &positions, &radii).expect("neighbours");
            assert!((0..count).all(|i| (gaps[i] - smallest(i)).abs() < 1e-12));
        }
        assert_eq!(
            GapStatistics::of(&Container::walled(gluey_geom::Aabb::<2>::unit()), &[Vector::zeros()], &[0.1]),
            None
        );
    }

    #[test]
    fn quantiles_are_interpolated() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.5), 2.0);
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.75), 3.0);
        assert_eq!(quantile(&[3.0], 0.01), 3.0);
    }
}
