//! Integrals of products of derivatives over parts of a cell, direction by direction.
//!
//! For weights `w_q` of the Gauss points of a cell, `sum_q w_q d_a phi_i d_b phi_j` is a product of
//! one-dimensional factors that depend on a pair `(i_d, j_d)` each: one direction after another is summed up.
//! The functions are those of a root some cells away.

use gluey_fem::cut::POINTS;
use gluey_fem::element::{derivatives_1d, gauss, multi_index, node_count, values_1d};

/// Nodes per direction, and pairs of them.
const NODES: usize = 3;
const PAIRS: usize = NODES * NODES;

/// Most numbers between two directions.
const LONGEST: usize = POINTS * PAIRS * PAIRS;

/// At each point the products of the functions of all pairs of nodes on a line.
type Line = [[f64; PAIRS]; POINTS];

/// The lines of a cell by direction and by whether the first and the second function are derived.
pub struct Lines<const D: usize>([[[Line; 2]; 2]; D]);

impl<const D: usize> Lines<D> {
    /// For the functions of a cell that lies this many cells before.
    pub fn new(offset: [f64; D]) -> Self {
        let rule = gauss(POINTS);
        Self(offset.map(|offset| {
            let at = |q: usize, is_derived: usize| match is_derived {
                0 => values_1d(2, offset + rule[q].0),
                _ => derivatives_1d(2, offset + rule[q].0),
            };
            let product = |q: usize, a: usize, b: usize| -> [f64; PAIRS] {
                let (first, second) = (at(q, a), at(q, b));
                std::array::from_fn(|s| first[s / NODES] * second[s % NODES])
            };
            [0, 1].map(|a| [0, 1].map(|b| std::array::from_fn(|q| product(q, a, b))))
        }))
    }
}

/// `int d_a phi_i d_b phi_j` for `b <= a`.
pub struct Products<const D: usize> {
    /// A number for every pair of nodes, ordered by the pairs of their places in the first direction, then in
    /// the second and so on.
    planes: [[Vec<f64>; D]; D],
    /// Where the pairs with each node as the first, and those with each node as the second, begin: the place
    /// of a pair is the sum of both.
    first: Vec<usize>,
    second: Vec<usize>,
}

impl<const D: usize> Products<D> {
    /// No weights.
    pub fn zeros() -> Self {
        let place = |node: usize, factor: usize| {
            multi_index::<D>(node, NODES).iter().fold(0, |place, k| place * PAIRS + factor * k)
        };
        let places = |factor: usize| (0..node_count::<D>(2)).map(|node| place(node, factor)).collect();
        let plane = || vec![0.0; PAIRS.pow(D as u32)];
        Self {
            planes: std::array::from_fn(|_| std::array::from_fn(|_| plane())),
            first: places(NODES),
            second: places(1),
        }
    }

    /// Adds what comes from weights of the points of a cell, x fastest.
    pub fn add(&mut self, Lines(lines): &Lines<D>, weights: &[f64]) {
        let [mut from, mut to] = [[0.0; LONGEST]; 2];
        for a in 0..D {
            for b in 0..=a {
                let line = |d: usize| &lines[d][usize::from(a == d)][usize::from(b == d)];
                let plane = &mut self.planes[a][b];
                if D == 2 {
                    contract::<1>(weights, line(1), cleared(&mut to, POINTS * PAIRS));
                    contract::<PAIRS>(&to[..POINTS * PAIRS], line(0), plane);
                    continue;
                }
                let lens = [POINTS * POINTS * PAIRS, POINTS * PAIRS * PAIRS];
                contract::<1>(weights, line(2), cleared(&mut from, lens[0]));
                contract::<PAIRS>(&from[..lens[0]], line(1), cleared(&mut to, lens[1]));
                contract::<{ PAIRS * PAIRS }>(&to[..lens[1]], line(0), plane);
            }
        }
    }

    /// The same with derivatives in space, `d_1 - shear d_0` instead of `d_1`, where cells are sheared.
    #[must_use]
    pub fn sheared(mut self, shear: f64) -> Self {
        if shear == 0.0 {
            return self;
        }
        let (n, straight) = (node_count::<D>(2), self.planes[0][0].clone());
        let (crossed, mut second) = (self.planes[1][0].clone(), self.planes[1][1].clone());
        let place = |i: usize, j: usize| self.first[i] + self.second[j];
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let mixed = crossed[place(i, j)] + crossed[place(j, i)];
            second[place(i, j)] += shear * (shear * straight[place(i, j)] - mixed);
        }
        self.planes[1][1] = second;
        for a in 1..D {
            let along = if a == 1 { straight.clone() } else { self.planes[a][0].clone() };
            let to = if a == 1 { 0 } else { 1 };
            self.planes[a][to].iter_mut().zip(along).for_each(|(sum, along)| *sum -= shear * along);
        }
        self
    }

    /// `int d_a phi_i d_b phi_j` for `b <= a`.
    #[inline]
    pub fn of(&self, [a, b]: [usize; 2], [i, j]: [usize; 2]) -> f64 {
        self.planes[a][b][self.first[i] + self.second[j]]
    }
}

/// The beginning of an array, zero.
fn cleared(array: &mut [f64; LONGEST], len: usize) -> &mut [f64] {
    array[..len].fill(0.0);
    &mut array[..len]
}

/// Sums up the slowest direction of the points: `to[r, s, t] += sum_q from[q, r, t] line[q][s]` for `INNER`
/// pairs `t` of the directions before.
fn contract<const INNER: usize>(from: &[f64], line: &Line, to: &mut [f64]) {
    let (from, rest) = (from.as_chunks::<INNER>().0, from.len() / (POINTS * INNER));
    for (k, to) in to.as_chunks_mut::<INNER>().0.iter_mut().enumerate() {
        let (r, s) = (k / PAIRS, k % PAIRS);
        for (q, factors) in line.iter().enumerate() {
            let from = &from[q * rest + r];
            (0..INNER).for_each(|t| to[t] += factors[s] * from[t]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_fem::element::{gauss_cube, gradient};

    fn are_sums_over_the_points<const D: usize>(offset: [f64; D], shear: f64) {
        let rule = gauss_cube::<D>(POINTS);
        let weights: Vec<f64> = (0..rule.len()).map(|q| (3.0 * q as f64).sin()).collect();
        let mut products = Products::zeros();
        products.add(&Lines::new(offset), &weights);
        let products = products.sheared(shear);
        let slope = |node: usize, x: &[f64; D]| {
            let mut slope = gradient::<D>(2, node, &std::array::from_fn(|d| x[d] + offset[d]));
            slope[1] -= shear * slope[0];
            slope
        };
        for (a, b) in (0..D).flat_map(|a| (0..=a).map(move |b| (a, b))) {
            for (i, j) in [(0, 1), (4, 4), (2, 7), (node_count::<D>(2) - 1, 3)] {
                let terms = rule.iter().zip(&weights).map(|((x, _), w)| w * slope(i, x)[a] * slope(j, x)[b]);
                let (found, expected) = (products.of([a, b], [i, j]), terms.sum::<f64>());
                assert!(
                    (found - expected).abs() < 1e-13 * (1.0 + expected.abs()).max(100.0),
                    "{D}D, {a}{b}, {i} {j}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn products_are_sums_over_the_points() {
        for shear in [0.0, -0.4] {
            are_sums_over_the_points::<2>([0.0, -1.0], shear);
            are_sums_over_the_points::<3>([0.0, 1.0, -2.0], shear);
        }
    }
}
