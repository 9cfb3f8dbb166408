//! Particles of a case that are near each other, across periodic borders too.

use gluey_geom::Vector;
use gluey_levelset::nearest_image;
use gluey_suspension::for_each_pair;

use super::Case;

/// Rounding of the search, relative to lengths.
const ROUNDING: f64 = 1e-9;

/// Two particles and the distance of their surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NearParticles {
    /// Index of the first particle.
    pub first: usize,
    /// Index of the second particle, larger.
    pub second: usize,
    /// Distance of the centres, between the nearest images.
    pub distance: f64,
    /// Sum of the radii.
    pub contact_distance: f64,
}

/// The pairs whose surfaces are nearer than `reach`, in the order of the second, then of the first particle.
/// Centres have `dimension` coordinates and lie in the box.
pub(crate) fn nearer_than(case: &Case, reach: f64) -> Vec<NearParticles> {
    let mut pairs = match case.dimension {
        2 => candidates::<2>(case, reach),
        _ => candidates::<3>(case, reach),
    };
    pairs.sort_unstable();
    pairs.dedup();
    let near = pairs.into_iter().map(|(second, first)| neighbours(case, first, second));
    near.filter(|pair| pair.distance - pair.contact_distance < reach).collect()
}

fn neighbours(case: &Case, first: usize, second: usize) -> NearParticles {
    let (a, b) = (&case.particles[first], &case.particles[second]);
    let along = |axis: usize| nearest_image(a.position[axis] - b.position[axis], case.period(axis));
    let distance = (0..case.dimension).map(along).fold(0.0, f64::hypot);
    NearParticles { first, second, distance, contact_distance: a.radius + b.radius }
}

/// The second and the first of pairs that are about as near as that, in any image.
fn candidates<const D: usize>(case: &Case, reach: f64) -> Vec<(usize, usize)> {
    let particles = case.start::<D>();
    let centers: Vec<Vector<D>> = particles.iter().map(|particle| particle.pose.position).collect();
    let largest = particles.iter().map(|particle| particle.radius).fold(0.0, f64::max);
    let mut pairs = Vec::new();
    for_each_pair(&case.container(), &centers, (2.0 * largest + reach) * (1.0 + ROUNDING), |pair| {
        let touching = particles[pair.first].radius + particles[pair.second].radius;
        if pair.first != pair.second && pair.arm.norm() <= (touching + reach) * (1.0 + ROUNDING) {
            pairs.push((pair.second, pair.first));
        }
    });
    pairs
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::case::{Boundary, ParticleSpec};

    fn random_case(dimension: usize, boundary: Boundary, seed: u64) -> Case {
        let text = format!(
            "name = \"x\"\ndimension = {dimension}\n[[particles]]\nposition = [{}]\nradius = 0.05\n\
             [time]\nstep = 0.1\nend = 1.0\n",
            vec!["0.5"; dimension].join(", ")
        );
        let mut case = Case::parse(&text, "x.toml").expect("a good case");
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        case.domain.boundary = boundary;
        case.particles = (0..60)
            .map(|_| {
                let radius = random.random_range(0.01..0.06);
                let position = (0..dimension).map(|_| random.random_range(0.0..1.0)).collect();
                ParticleSpec::new(position, radius)
            })
            .collect();
        case
    }

    #[test]
    fn pairs_equal_brute_force() {
        for (seed, boundary) in [(1, Boundary::Couette), (2, Boundary::Periodic)] {
            for (dimension, reach) in [(2, 0.0), (2, 0.05), (3, 0.0), (3, 0.1)] {
                let case = random_case(dimension, boundary, seed);
                let all = (0..60).flat_map(|second| (0..second).map(move |first| (first, second)));
                let expected: Vec<NearParticles> = all
                    .map(|(first, second)| neighbours(&case, first, second))
                    .filter(|pair| pair.distance - pair.contact_distance < reach)
                    .collect();
                assert!(!expected.is_empty());
                assert_eq!(nearer_than(&case, reach), expected, "{dimension}D, reach {reach}, {boundary}");
            }
        }
    }
}
