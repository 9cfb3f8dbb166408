//! The static structure factor.

use std::f64::consts::TAU;

use gluey_geom::Vector;

use crate::Container;

/// Most wave vectors of a shell that are summed; of more, every second, third, ... is taken.
const MOST_PER_SHELL: usize = 100;

/// A shell of wave vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaveBin {
    /// Mean wave number.
    pub wave_number: f64,
    /// `|sum_j exp(i k.x_j)|^2 / N`, averaged over the vectors of the shell.
    pub s: f64,
    /// Number of vectors summed.
    pub vector_count: u64,
}

/// Static structure factor `S(k) = <|sum_j exp(i k.x_j)|^2> / N` on the vectors that the periods allow,
/// averaged over shells of equal width; along axes with walls `k` has no component.
#[derive(Clone, Debug, PartialEq)]
pub struct StructureFactor<const D: usize> {
    width: f64,
    /// Sums of wave numbers and of factors, and numbers of vectors, of each shell.
    shells: Vec<(f64, f64, u64)>,
}

impl<const D: usize> StructureFactor<D> {
    /// Shells of this width up to the wave number `most`.
    pub fn new(most: f64, width: f64) -> Self {
        Self { width, shells: vec![(0.0, 0.0, 0); (most / width).ceil().max(1.0) as usize] }
    }

    /// Adds one configuration.
    pub fn add(&mut self, container: &Container<D>, positions: &[Vector<D>]) {
        if positions.is_empty() {
            return;
        }
        let mut vectors = vec![Vec::new(); self.shells.len()];
        self.for_each_vector(container, |shell, k| vectors[shell].push(k));
        for ((sum_k, sum_s, count), vectors) in self.shells.iter_mut().zip(&vectors) {
            for k in vectors.iter().step_by(vectors.len().div_ceil(MOST_PER_SHELL).max(1)) {
                *sum_k += k.norm();
                *sum_s += factor(k, positions);
                *count += 1;
            }
        }
    }

    /// Visits one of each pair `k`, `-k` of reciprocal vectors: `k.e = 2 pi n` for the periods `e`.
    fn for_each_vector(&self, container: &Container<D>, mut visit: impl FnMut(usize, Vector<D>)) {
        let most = self.width * self.shells.len() as f64;
        let (periods, tilt) = (container.lattice().periods(), container.lattice().tilt());
        let slant = 1f64.hypot(container.lattice().shear());
        let limits: [i64; D] = std::array::from_fn(|d| {
            periods[d].map_or(0, |period| (most * period * if d == 1 { slant } else { 1.0 } / TAU) as i64 + 1)
        });
        let sides: [i64; D] = limits.map(|limit| 2 * limit + 1);
        for number in 0..sides.iter().product() {
            let mut rest = number;
            let n: [i64; D] = std::array::from_fn(|d| {
                let n = rest % sides[d] - limits[d];
                rest /= sides[d];
                n
            });
            let mut k = Vector::<D>::from_fn(|d, _| periods[d].map_or(0.0, |p| TAU * n[d] as f64 / p));
            k[1] -= periods[1].map_or(0.0, |height| k[0] * tilt / height);
            let shell = (k.norm() / self.width) as usize;
            if n > [0; D] && shell < self.shells.len() {
                visit(shell, k);
            }
        }
    }

    /// The shells that have vectors.
    pub fn bins(&self) -> Vec<WaveBin> {
        let bin = |&(sum_k, sum_s, vector_count): &(f64, f64, u64)| {
            let count = vector_count as f64;
            WaveBin { wave_number: sum_k / count, s: sum_s / count, vector_count }
        };
        self.shells.iter().filter(|shell| shell.2 > 0).map(bin).collect()
    }
}

fn factor<const D: usize>(k: &Vector<D>, positions: &[Vector<D>]) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for x in positions {
        let (sin, cos) = k.dot(x).sin_cos();
        re += cos;
        im += sin;
    }
    (re * re + im * im) / positions.len() as f64
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn check<const D: usize>() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let container = Container::<D>::periodic(&Vector::repeat(1.0)).tilted(0.37);
        let mut gas = StructureFactor::new(60.0, 12.0);
        for _ in 0..60 {
            let positions: Vec<Vector<D>> =
                (0..50).map(|_| Vector::from_fn(|_, _| random.random_range(0.0..1.0))).collect();
            gas.add(&container, &positions);
        }
        for bin in gas.bins() {
            assert!((bin.s - 1.0).abs() < 5.0 / (bin.vector_count as f64).sqrt(), "{D}D: {bin:?}");
        }
    }

    #[test]
    fn the_factor_of_an_ideal_gas_is_one() {
        check::<2>();
        check::<3>();
    }

    #[test]
    fn a_lattice_scatters_at_its_reciprocal_vectors_only() {
        let site = |i: usize| Vector::<2>::new((i % 8) as f64, (i / 8) as f64);
        let positions: Vec<_> = (0..64).map(site).collect();
        for tilt in [0.0, 2.0, -3.0] {
            let container = Container::periodic(&Vector::<2>::repeat(8.0)).tilted(tilt);
            let mut peaks = 0;
            StructureFactor::new(1.2 * TAU, TAU).for_each_vector(&container, |_, k| {
                let is_peak = (k / TAU).iter().all(|n| (n - n.round()).abs() < 1e-9);
                let exact = if is_peak { 64.0 } else { 0.0 };
                assert!((factor(&k, &positions) - exact).abs() < 1e-9, "{tilt}: {k}");
                peaks += u32::from(is_peak);
            });
            // One of each pair; shells reach up to 2 in units of 2 pi.
            assert_eq!(peaks, 4);
        }
    }
}
