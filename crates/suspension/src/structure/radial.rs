//! The pair correlation as a function of distance.

use gluey_geom::Vector;

use crate::{Container, for_each_pair};
use gluey_geom::ball_volume;

/// A bin of distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialBin {
    /// Middle of the bin.
    pub distance: f64,
    /// Pairs found over those of particles at random; none where there would be none of these.
    pub g: Option<f64>,
    /// Number of pairs found.
    pub pair_count: u64,
}

/// Pair correlation `g(r)`: the number of pairs at the distance `r` between centres, over that of as many
/// points at random, whose number is `N (N - 1) / 2` times the volume of the shell over that of the box.
///
/// Walls hide partners: between walls a height `h` apart a point at random sees the part `1 - |r_y| / h` of
/// its surroundings, which is accounted for on average over directions; `h` is the room of the centres.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialDistribution<const D: usize> {
    range: f64,
    counts: Vec<u64>,
    /// Number of pairs at random per unit of volume, with the part that walls leave in each bin.
    expected: Vec<f64>,
}

impl<const D: usize> RadialDistribution<D> {
    /// Bins of equal width up to `range`, which is cut at half the shortest period: beyond it the images of a
    /// particle would be taken for others.
    pub fn new(container: &Container<D>, range: f64, bin_count: usize) -> Self {
        let longest = container.shortest_period().map_or(f64::INFINITY, |period| 0.5 * period);
        let bin_count = bin_count.max(1);
        Self { range: range.min(longest), counts: vec![0; bin_count], expected: vec![0.0; bin_count] }
    }

    /// Adds one configuration. `margin` is how far centres keep from walls, usually the radius.
    pub fn add(&mut self, container: &Container<D>, positions: &[Vector<D>], margin: f64) {
        self.add_between(container, positions, |_| 0, [0, 0], margin);
    }

    /// Adds the pairs of one configuration of which one particle is of one species and the other of another,
    /// or of the same; `species` has that of each particle.
    pub fn add_between(
        &mut self,
        container: &Container<D>,
        positions: &[Vector<D>],
        species: impl Fn(usize) -> usize,
        [one, other]: [usize; 2],
        margin: f64,
    ) {
        let width = self.width();
        let (counts, last) = (&mut self.counts, self.expected.len() - 1);
        for_each_pair(container, positions, self.range, |pair| {
            let found = [pair.first, pair.second].map(&species);
            let is_wanted = found == [one, other] || found == [other, one];
            if is_wanted && pair.first != pair.second {
                counts[((pair.arm.norm() / width) as usize).min(last)] += 1;
            }
        });
        let rooms = container.bounds().extent().map(|edge| edge - 2.0 * margin);
        let count = |of: usize| (0..positions.len()).filter(|&k| species(k) == of).count() as f64;
        let pairs =
            if one == other { 0.5 * count(one) * (count(one) - 1.0) } else { count(one) * count(other) };
        let room: f64 = (0..D)
            .map(|d| if container.is_walled(d) { rooms[d] } else { container.bounds().extent()[d] })
            .product();
        let density = pairs / room;
        for (bin, expected) in self.expected.iter_mut().enumerate() {
            *expected += density * seen(container, &rooms, (bin as f64 + 0.5) * width);
        }
    }

    fn width(&self) -> f64 {
        self.range / self.expected.len() as f64
    }

    /// The correlation, averaged over all configurations.
    pub fn bins(&self) -> Vec<RadialBin> {
        let width = self.width();
        let bin = |(bin, (&pair_count, &expected)): (usize, (&u64, &f64))| {
            let [inner, outer] = [bin as f64 * width, (bin + 1) as f64 * width];
            let wanted = expected * (ball_volume::<D>(outer) - ball_volume::<D>(inner));
            let g = (wanted > 0.0).then(|| pair_count as f64 / wanted);
            RadialBin { distance: 0.5 * (inner + outer), g, pair_count }
        };
        self.counts.iter().zip(&self.expected).enumerate().map(bin).collect()
    }

    /// The value at contact of balls of this diameter: the logarithm of `g` from there to 1.25 diameters is
    /// fitted by a parabola, each bin with its number of pairs as weight. `None` for fewer than four bins.
    pub fn at_contact(&self, diameter: f64) -> Option<f64> {
        let half = 0.5 * self.width();
        let bins = self.bins();
        let is_near = |bin: &&RadialBin| {
            let is_outside = bin.distance - half >= diameter * (1.0 - 1e-9);
            is_outside && bin.distance <= 1.25 * diameter && bin.pair_count > 0
        };
        let point =
            |bin: &RadialBin| Some([bin.distance / diameter - 1.0, bin.g?.ln(), bin.pair_count as f64]);
        let points: Vec<[f64; 3]> = bins.iter().filter(is_near).filter_map(point).collect();
        (points.len() >= 4).then(|| parabola_at_zero(&points).exp())
    }
}

/// The part of a sphere of radius `r` around a point at random that lies within walls, on average.
fn seen<const D: usize>(container: &Container<D>, rooms: &Vector<D>, r: f64) -> f64 {
    let walled: Vec<f64> = (0..D).filter(|&d| container.is_walled(d)).map(|d| rooms[d]).collect();
    if walled.is_empty() {
        return 1.0;
    }
    // Directions at equal steps of the polar angle's cosine (in 2D: of the angle) and of the azimuth.
    const STEPS: usize = 24;
    let part = |number: usize| {
        let [u, v] = [number % STEPS, number / STEPS].map(|k| (k as f64 + 0.5) / STEPS as f64);
        let (polar, azimuth) = (u, std::f64::consts::FRAC_PI_2 * v);
        let across = (1.0 - polar * polar).sqrt();
        let direction = match D {
            2 => [azimuth.cos(), azimuth.sin(), 0.0],
            _ => [across * azimuth.cos(), polar, across * azimuth.sin()],
        };
        let part = |d: usize| (1.0 - r * direction[d] / rooms[d]).max(0.0);
        (0..D).filter(|&d| container.is_walled(d)).map(part).product::<f64>()
    };
    (0..STEPS * STEPS).map(part).sum::<f64>() / (STEPS * STEPS) as f64
}

/// Value at `x = 0` of the parabola that fits points `(x, y)` with weights best.
fn parabola_at_zero(points: &[[f64; 3]]) -> f64 {
    let sum = |term: &dyn Fn(&[f64; 3]) -> f64| points.iter().map(term).sum::<f64>();
    let moment = |power: i32| sum(&|[x, _, w]| w * x.powi(power));
    let load = |power: i32| sum(&|[x, y, w]| w * y * x.powi(power));
    let [m0, m1, m2, m3, m4] = [0, 1, 2, 3, 4].map(moment);
    let [b0, b1, b2] = [0, 1, 2].map(load);
    let minor = |a: f64, b: f64, c: f64, d: f64| a * d - b * c;
    let [c0, c1, c2] = [minor(m2, m3, m3, m4), minor(m1, m3, m2, m4), minor(m1, m2, m2, m3)];
    (b0 * c0 - m1 * minor(b1, m3, b2, m4) + m2 * minor(b1, m2, b2, m3)) / (m0 * c0 - m1 * c1 + m2 * c2)
}

#[cfg(test)]
mod tests {
    use gluey_geom::Aabb;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn ideal<const D: usize>(count: usize, seed: u64) -> Vec<Vector<D>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| Vector::from_fn(|_, _| random.random_range(0.0..1.0))).collect()
    }

    /// Points at random have no correlation, with and without walls.
    fn check<const D: usize>() {
        for walls in [[false; D], std::array::from_fn(|d| d == 1), [true; D]] {
            let container = Container::new(Aabb::<D>::unit(), walls.map(|is_walled| !is_walled));
            let mut radial = RadialDistribution::new(&container, 0.45, 9);
            (0..20).for_each(|seed| radial.add(&container, &ideal(400, seed), 0.0));
            for bin in radial.bins() {
                let error = 4.0 / (bin.pair_count as f64).sqrt() + 0.004;
                assert!((bin.g.expect("pairs") - 1.0).abs() < error, "{D}D {walls:?}: {bin:?}");
            }
            radial = RadialDistribution::new(&container, 0.45, 9);
            radial.add(&container, &ideal(1, 0), 0.0);
            assert!(radial.bins().iter().all(|bin| bin.g.is_none()), "one particle has no pairs");
        }
    }

    #[test]
    fn an_ideal_gas_has_no_correlation() {
        check::<2>();
        check::<3>();
    }

    /// In a lattice of two species in turn, nearest neighbours are unlike, the next ones alike.
    #[test]
    fn partial_correlations_tell_species_apart() {
        let container = Container::<2>::periodic(&Vector::repeat(10.0));
        let site = |i: usize| Vector::<2>::new((i % 10) as f64, (i / 10) as f64);
        let positions: Vec<_> = (0..100).map(site).collect();
        let species = |i: usize| (i % 10 + i / 10) % 2;
        let mut whole = RadialDistribution::new(&container, 4.5, 45);
        whole.add(&container, &positions, 0.5);
        let pair_counts = |pair: [usize; 2]| {
            let mut radial = RadialDistribution::new(&container, 4.5, 45);
            radial.add_between(&container, &positions, species, pair, 0.5);
            radial.bins().iter().map(|bin| bin.pair_count).collect::<Vec<u64>>()
        };
        let [alike, unlike, others] = [[0, 0], [0, 1], [1, 1]].map(pair_counts);
        assert_eq!((alike[10], unlike[10], alike[14], unlike[14]), (0, 200, 100, 0));
        assert_eq!((&alike, pair_counts([1, 0])), (&others, unlike.clone()));
        let sum = |k: usize| alike[k] + unlike[k] + others[k];
        assert!(whole.bins().iter().enumerate().all(|(k, bin)| bin.pair_count == sum(k)));
    }

    #[test]
    fn neighbours_on_a_tilted_lattice_are_counted() {
        // A square lattice of 10 x 10, sheared by one spacing, is itself.
        let site = |i: usize| Vector::<2>::new((i % 10) as f64 + 0.5, (i / 10) as f64 + 0.5);
        let positions: Vec<_> = (0..100).map(site).collect();
        let straight = Container::periodic(&Vector::<2>::repeat(10.0));
        for container in [straight, straight.tilted(3.0), straight.tilted(10.0)] {
            let mut radial = RadialDistribution::new(&container, 9.0, 50);
            radial.add(&container, &positions, 0.5);
            let counts: Vec<u64> = radial.bins().iter().map(|bin| bin.pair_count).collect();
            // At 1, sqrt 2, 2, sqrt 5: 4, 4, 4, 8 neighbours, each pair once.
            assert_eq!([10, 14, 20, 22].map(|bin| counts[bin]), [200, 200, 200, 400]);
            assert_eq!(counts[..10].iter().sum::<u64>(), 0);
        }
    }

    #[test]
    fn parabolas_are_exact() {
        let points = [0.1, 0.2, 0.35, 0.5, 0.8].map(|x| [x, 3.0 - 2.0 * x + 0.5 * x * x, 1.0 + x]);
        assert!((parabola_at_zero(&points) - 3.0).abs() < 1e-9);
    }
}
