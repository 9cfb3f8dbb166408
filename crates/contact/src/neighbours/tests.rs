use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A step of spheres anywhere, with small random displacements.
struct Cloud<const D: usize> {
    positions: Vec<Vector<D>>,
    radii: Vec<f64>,
    moves: Vec<Vector<D>>,
    domain: Domain<D>,
}

impl<const D: usize> Cloud<D> {
    fn new(random: &mut ChaCha8Rng, lengths: [f64; D], periodic: [bool; D], count: usize) -> Self {
        let mut domain = Domain::default();
        for d in (0..D).filter(|&d| periodic[d]) {
            domain = domain.with_period(d, lengths[d]);
        }
        let mut anywhere =
            |size: f64| Vector::<D>::from_fn(|d, _| size * lengths[d] * random.random_range(-1.5..1.5));
        let positions = (0..count).map(|_| anywhere(1.0)).collect();
        let moves = (0..count).map(|_| anywhere(0.01)).collect();
        let radii = (0..count).map(|_| random.random_range(0.3..0.5)).collect();
        Self { positions, radii, moves, domain }
    }

    fn step<'a>(&'a self, drift: &'a [Vector<D>]) -> StepGeometry<'a, D> {
        StepGeometry { positions: &self.positions, radii: &self.radii, drift, velocity_weight: 1.0, dt: 1.0 }
    }

    /// All pairs of particles and images nearer than `reach_i + reach_j`, but for a particle's own images.
    fn brute_force(&self, reach: &[f64]) -> Vec<PairKey> {
        let mut pairs = Vec::new();
        for i in 0..reach.len() {
            for j in i + 1..reach.len() {
                let apart = self.positions[j] - self.positions[i];
                let near = self.images_near(&apart);
                let is_near =
                    |image: &[i32; 3]| (apart + self.domain.shift(image)).norm() <= reach[i] + reach[j];
                pairs.extend(near.into_iter().filter(is_near).map(|image| PairKey::across(i, j, image)));
            }
        }
        pairs.sort_unstable();
        pairs
    }

    /// Images of a displacement up to a period beyond the nearest: half as far again as the longest reach.
    fn images_near(&self, apart: &Vector<D>) -> Vec<[i32; 3]> {
        let lattice = &self.domain.lattice;
        let range = |d: usize, apart: f64| match lattice.periods().get(d).copied().flatten() {
            Some(period) => {
                let nearest = -(apart / period).round() as i32;
                nearest - 1..=nearest + 1
            }
            None => 0..=0,
        };
        let across = apart.get(2).map_or(0..=0, |z| range(2, *z));
        let rows = across.flat_map(|k| range(1, apart[1]).map(move |j| (j, k)));
        let along =
            |(j, k): (i32, i32)| range(0, apart[0] + f64::from(j) * lattice.tilt()).map(move |i| [i, j, k]);
        rows.flat_map(along).collect()
    }
}

fn keys<const D: usize>(neighbours: &NeighbourList<D>) -> Vec<PairKey> {
    let mut keys: Vec<PairKey> =
        neighbours.candidates.iter().map(|candidate| neighbours.key(candidate)).collect();
    keys.sort_unstable();
    keys
}

fn check_boxes<const D: usize>(box_count: usize, largest_tilt: f64) {
    let mut random = ChaCha8Rng::seed_from_u64(D as u64);
    let (mut pair_count, mut tilted_count) = (0, 0);
    for case in 0..box_count {
        // From boxes barely larger than two diameters to large ones; some directions are free.
        let longest = if case % 2 == 0 { 2.1 } else { 9.0 };
        let lengths = std::array::from_fn(|_| random.random_range(2.01..longest));
        let periodic = std::array::from_fn(|d| case % 3 == 0 || (case + d) % 2 == 0);
        let count = random.random_range(1..40);
        let mut cloud = Cloud::<D>::new(&mut random, lengths, periodic, count);
        let tilt = lengths[0] * largest_tilt * random.random_range(-1.0..1.0);
        cloud.domain.set_sliding(tilt, 0.02 * largest_tilt * tilt.signum());
        tilted_count += usize::from(cloud.domain.lattice.tilt() != 0.0);
        let drift = vec![Vector::zeros(); count];
        let mut neighbours = NeighbourList::default();
        neighbours.begin(&cloud.step(&drift), &cloud.domain, &cloud.moves).expect("slow particles");
        let mut reach = vec![0.0; count];
        neighbours.order.iter().zip(&neighbours.reach).for_each(|(&i, r)| reach[i as usize] = *r);
        assert!(reach.iter().zip(&cloud.radii).all(|(reach, radius)| reach > radius));
        let expected = cloud.brute_force(&reach);
        assert_eq!(keys(&neighbours), expected, "box {case} of {lengths:?}");
        pair_count += expected.len();
    }
    assert!(pair_count > 10 * box_count);
    assert!(largest_tilt == 0.0 || tilted_count > box_count / 3, "{tilted_count}");
}

#[test]
fn periodic_pairs_equal_brute_force() {
    check_boxes::<2>(100, 0.0);
    check_boxes::<3>(100, 0.0);
}

#[test]
fn pairs_of_tilted_boxes_equal_brute_force() {
    check_boxes::<2>(400, 3.0);
    check_boxes::<3>(200, 3.0);
}

/// A list that is kept over steps of a shear with some noise names every pair that could close in them.
/// Returns how often it was made anew.
fn searches<const D: usize>(periodic: [bool; D], count: usize) -> usize {
    let (height, strain_step, step_count) = (6.0, 0.01, 200);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut cloud = Cloud::<D>::new(&mut random, [height; D], periodic, count);
    if periodic[1] {
        // Written many rows of boxes apart, which move fast against each other.
        let rows = (0..count).map(|k| (100 * (k % 7)) as f64);
        cloud.positions.iter_mut().zip(rows).for_each(|(x, rows)| x[1] += rows * height);
    }
    let drift = vec![Vector::zeros(); count];
    let mut neighbours = NeighbourList::default();
    let mut search_count = 0;
    for n in 0..step_count {
        cloud.domain.set_sliding(strain_step * height * f64::from(n), strain_step * height);
        // Distant particles move apart but neighbours little.
        for (s, x) in cloud.moves.iter_mut().zip(&cloud.positions) {
            *s = Vector::from_fn(|_, _| random.random_range(-2e-3..2e-3));
            s[0] += strain_step * x[1];
        }
        let before = neighbours.reference.clone();
        neighbours.begin(&cloud.step(&drift), &cloud.domain, &cloud.moves).expect("slow particles");
        search_count += usize::from(neighbours.reference != before);
        let known = keys(&neighbours);
        // Could close: the gap is not larger than the relative displacement.
        let far: Vec<f64> = cloud.radii.iter().map(|radius| radius + 0.2).collect();
        for key in cloud.brute_force(&far) {
            let Partner::Particle { index, image } = key.second else { panic!("no walls here") };
            let (i, j) = (key.first as usize, index as usize);
            let apart = cloud.positions[j] + cloud.domain.shift(&image) - cloud.positions[i];
            let approach = cloud.moves[j] + cloud.domain.slide(&image) - cloud.moves[i];
            if apart.norm() - cloud.radii[i] - cloud.radii[j] <= approach.norm() {
                assert!(known.binary_search(&key).is_ok(), "{key} is missing");
            }
        }
        cloud.positions.iter_mut().zip(&cloud.moves).for_each(|(x, s)| *x += s);
    }
    search_count
}

#[test]
fn a_kept_graph_misses_no_pair() {
    for (name, search_count) in [
        ("channel", searches([true, false, false], 100)),
        ("sliding spheres", searches([true; 3], 100)),
        ("sliding between walls", searches([true, true, false], 100)),
        ("sliding discs", searches([true; 2], 60)),
    ] {
        println!("{name}: {search_count} searches in 200 steps");
        assert!((2..=100).contains(&search_count), "{name}: {search_count}");
    }
}
