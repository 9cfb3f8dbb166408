//! The pair correlation near contact as a function of the direction in the plane of shear.

use std::f64::consts::PI;

use gluey_geom::Vector;

use crate::{Container, for_each_pair};
use gluey_geom::ball_volume;

/// In 3D pairs count whose direction is so near the plane of shear: `|n_z|` at most this. Directions at
/// random do with this probability.
const BAND: f64 = 0.5;

/// Pair correlation `g(theta)` of a shell around contact, `a_i + a_j <= r <= s (a_i + a_j)`, by the angle of
/// the line of centres to the flow `x` in the plane `(x, y)`, from 0 to pi: above pi/2 in the quadrant where
/// simple shear with a positive rate compresses. In 3D of pairs at most 30 degrees off that plane.
#[derive(Clone, Debug, PartialEq)]
pub struct AngularDistribution<const D: usize> {
    outer: f64,
    counts: Vec<u64>,
    expected: f64,
}

impl<const D: usize> AngularDistribution<D> {
    /// Bins of equal width for pairs up to `outer > 1` contact distances apart.
    pub fn new(outer: f64, bin_count: usize) -> Self {
        Self { outer, counts: vec![0; bin_count.max(1)], expected: 0.0 }
    }

    /// Adds one configuration.
    pub fn add(&mut self, container: &Container<D>, positions: &[Vector<D>], radii: &[f64]) {
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let (outer, counts) = (self.outer, &mut self.counts);
        for_each_pair(container, positions, 2.0 * outer * largest, |pair| {
            let arm = pair.arm;
            let reach = arm.norm() / (radii[pair.first] + radii[pair.second]);
            let is_in_plane = D == 2 || arm[D - 1].abs() <= BAND * arm.norm();
            if reach <= outer && is_in_plane && pair.first != pair.second {
                let part = arm[1].atan2(arm[0]).rem_euclid(PI) / PI;
                let bin = ((part * counts.len() as f64) as usize).min(counts.len() - 1);
                counts[bin] += 1;
            }
        });
        let band = if D == 2 { 1.0 } else { BAND };
        let shell = (outer.powi(D as i32) - 1.0) * ball_volume::<D>(1.0) * pair_sizes::<D>(radii);
        self.expected += shell * band / (container.volume() * self.counts.len() as f64);
    }

    /// The middle of each bin of angles and the correlation there; none where there are no pairs at random.
    pub fn bins(&self) -> Vec<(f64, Option<f64>)> {
        let width = PI / self.counts.len() as f64;
        let g = |count: u64| (self.expected > 0.0).then(|| count as f64 / self.expected);
        self.counts.iter().enumerate().map(|(bin, &count)| ((bin as f64 + 0.5) * width, g(count))).collect()
    }
}

/// `sum over pairs of (a_i + a_j)^D`, from the sums of powers.
fn pair_sizes<const D: usize>(radii: &[f64]) -> f64 {
    let power = |k: usize| radii.iter().map(|a| a.powi(k as i32)).sum::<f64>();
    let all = match D {
        2 => 2.0 * power(0) * power(2) + 2.0 * power(1).powi(2),
        _ => 2.0 * power(0) * power(3) + 6.0 * power(1) * power(2),
    };
    0.5 * (all - f64::from(1 << D) * power(D))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn check<const D: usize>() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let container = Container::<D>::periodic(&Vector::repeat(1.0)).tilted(0.3);
        let radii: Vec<f64> = (0..300).map(|i| 0.03 + 0.01 * f64::from(i % 3)).collect();
        let mut angular = AngularDistribution::new(2.0, 6);
        for _ in 0..40 {
            let positions: Vec<Vector<D>> =
                (0..300).map(|_| Vector::from_fn(|_, _| random.random_range(0.0..1.0))).collect();
            angular.add(&container, &positions, &radii);
            // The pairs that overlap do not belong to the shell.
            for_each_pair(&container, &positions, 0.1, |pair| {
                let touching = radii[pair.first] + radii[pair.second];
                if pair.arm.norm() < touching && (D == 2 || pair.arm[D - 1].abs() <= 0.5 * pair.arm.norm()) {
                    let bin = (pair.arm[1].atan2(pair.arm[0]).rem_euclid(PI) / PI * 6.0) as usize;
                    angular.counts[bin.min(5)] -= 1;
                }
            });
        }
        for ((_, g), count) in angular.bins().iter().zip(&angular.counts) {
            let g = g.expect("pairs");
            assert!((g - 1.0).abs() < 4.0 / (*count as f64).sqrt(), "{D}D: {g} of {count}");
        }
    }

    #[test]
    fn an_ideal_gas_has_no_preferred_direction() {
        check::<2>();
        check::<3>();
    }

    #[test]
    fn a_pair_in_compression_is_above_a_right_angle() {
        let container = Container::periodic(&Vector::<2>::repeat(10.0));
        let mut angular = AngularDistribution::new(1.1, 4);
        let positions = [Vector::<2>::new(5.0, 5.0), Vector::<2>::new(3.6, 6.5)];
        angular.add(&container, &positions, &[1.0; 2]);
        let g: Vec<f64> = angular.bins().iter().filter_map(|(_, g)| *g).collect();
        assert!(g[2] > 0.0 && g[0] + g[1] + g[3] == 0.0, "{g:?}");
    }
}
