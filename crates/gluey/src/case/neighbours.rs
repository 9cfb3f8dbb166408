//! Particles of a case that are near each other, across periodic borders too.

use gluey_contact::broadphase::{BestOf, Broadphase};
use gluey_geom::Vector;
use gluey_levelset::nearest_image;

use super::Case;

/// Rounding of the search, which compares squares.
const ROUNDING: f64 = 1e-9;

/// Two particles and the distance of their surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Neighbours {
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
pub(crate) fn nearer_than(case: &Case, reach: f64) -> Vec<Neighbours> {
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    let (centers, owners) = with_images(case, reach);
    let radii: Vec<f64> =
        owners.iter().map(|&owner| (case.particles[owner].radius + 0.5 * reach) * (1.0 + ROUNDING)).collect();
    let mut found = Vec::new();
    // Discs are looked for as spheres in one plane.
    Broadphase::<3>::meeting(&mut BestOf::default(), &centers, &radii, case.particles.len(), &mut found);
    for (i, j) in found {
        let (i, j) = (owners[i as usize], owners[j as usize]);
        pairs.push((i.max(j), i.min(j)));
    }
    pairs.sort_unstable();
    pairs.dedup();
    let near = pairs.into_iter().map(|(second, first)| neighbours(case, first, second));
    near.filter(|pair| pair.distance - pair.contact_distance < reach).collect()
}

fn neighbours(case: &Case, first: usize, second: usize) -> Neighbours {
    let (a, b) = (&case.particles[first], &case.particles[second]);
    let along = |axis: usize| nearest_image(a.position[axis] - b.position[axis], case.period(axis));
    let distance = (0..case.dimension).map(along).fold(0.0, f64::hypot);
    Neighbours { first, second, distance, contact_distance: a.radius + b.radius }
}

/// Centres of the particles, then of their images that particles in the box can meet; and which particle each
/// is.
fn with_images(case: &Case, reach: f64) -> (Vec<Vector<3>>, Vec<usize>) {
    let center = |position: &Vec<f64>| Vector::<3>::from_fn(|d, _| position.get(d).copied().unwrap_or(0.0));
    let mut centers: Vec<_> = case.particles.iter().map(|particle| center(&particle.position)).collect();
    let mut owners: Vec<usize> = (0..centers.len()).collect();
    let largest = case.particles.iter().map(|particle| particle.radius).fold(0.0, f64::max);
    let (lower, upper) = (case.lower(), case.upper());
    for axis in 0..case.dimension {
        let Some(period) = case.period(axis) else { continue };
        for k in 0..centers.len() {
            let width = case.particles[owners[k]].radius + largest + reach;
            for (is_near, shift) in [
                (centers[k][axis] - lower[axis] < width, period),
                (upper[axis] - centers[k][axis] < width, -period),
            ] {
                if is_near {
                    let mut image = centers[k];
                    image[axis] += shift;
                    centers.push(image);
                    owners.push(owners[k]);
                }
            }
        }
    }
    (centers, owners)
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
                let expected: Vec<Neighbours> = all
                    .map(|(first, second)| neighbours(&case, first, second))
                    .filter(|pair| pair.distance - pair.contact_distance < reach)
                    .collect();
                assert!(!expected.is_empty());
                assert_eq!(nearer_than(&case, reach), expected, "{dimension}D, reach {reach}, {boundary}");
            }
        }
    }
}
