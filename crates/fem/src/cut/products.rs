//! Integrals of products of derivatives over parts of a cell, direction by direction.
//!
//! For weights `w_q` of the Gauss points of a cell, `sum_q w_q d_a phi_i d_b phi_j` is a product of
//! one-dimensional factors that depend on a pair `(i_d, j_d)` each: one direction after another is summed up.
//! The functions are those of a root some cells away.

use gluey_linalg::vectorised;

use super::polynomials::POINTS;
use crate::element::{derivatives_1d, gauss, multi_index, node_count, values_1d};

/// Nodes per direction, and pairs of them.
const NODES: usize = 3;
const PAIRS: usize = NODES * NODES;

/// Numbers between two directions, at most.
const LONGEST: usize = POINTS * PAIRS * PAIRS;

/// At each point the products of the functions of all pairs of nodes on a line.
type PairLine = [[f64; PAIRS]; POINTS];

/// The lines of a cell by direction and by whether the first and the second function are derived.
#[derive(Clone, Debug)]
pub struct PairLines<const D: usize>([[[PairLine; 2]; 2]; D]);

impl<const D: usize> PairLines<D> {
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
#[derive(Clone, Debug)]
pub struct Products<const D: usize> {
    /// A number for every pair of nodes, see [`Places`].
    planes: [[Vec<f64>; D]; D],
    places: Places,
}

/// Places of pairs of nodes among the products, which are ordered by the pairs of their places in the first
/// direction, then in the second and so on.
#[derive(Clone, Debug)]
pub struct Places {
    /// Where the pairs with each node as the first, and those with each node as the second, begin: the place
    /// of a pair is the sum of both.
    first: Vec<usize>,
    second: Vec<usize>,
}

impl Places {
    /// Those of a cell.
    pub fn new<const D: usize>() -> Self {
        let place = |node: usize, factor: usize| {
            multi_index::<D>(node, NODES).iter().fold(0, |place, k| place * PAIRS + factor * k)
        };
        let places = |factor: usize| (0..node_count::<D>(2)).map(|node| place(node, factor)).collect();
        Self { first: places(NODES), second: places(1) }
    }

    /// The place of a pair.
    #[inline(always)]
    pub fn of(&self, [i, j]: [usize; 2]) -> usize {
        self.first[i] + self.second[j]
    }
}

/// Numbers of all pairs of nodes of a cell.
pub const fn pair_count<const D: usize>() -> usize {
    PAIRS.pow(D as u32)
}

impl<const D: usize> Products<D> {
    /// No weights.
    pub fn zeros() -> Self {
        let plane = || vec![0.0; pair_count::<D>()];
        Self { planes: std::array::from_fn(|_| std::array::from_fn(|_| plane())), places: Places::new::<D>() }
    }

    /// Adds what comes from weights of the points of a cell, x fastest.
    pub fn add(&mut self, lines: &PairLines<D>, weights: &[f64]) {
        vectorised(
            #[inline(always)]
            || {
                for (a, b) in (0..D).flat_map(|a| (0..=a).map(move |b| (a, b))) {
                    add_products(lines, [Some(a), Some(b)], weights, &mut self.planes[a][b]);
                }
            },
        );
    }

    /// Clears all weights.
    pub fn clear(&mut self) {
        self.planes.iter_mut().flatten().for_each(|plane| plane.fill(0.0));
    }

    /// The same with derivatives in space, `d_1 - shear d_0` instead of `d_1`, where cells are sheared.
    pub fn shear(&mut self, shear: f64) {
        if shear == 0.0 {
            return;
        }
        let (n, straight) = (node_count::<D>(2), self.planes[0][0].clone());
        let (crossed, mut second) = (self.planes[1][0].clone(), self.planes[1][1].clone());
        let place = |i: usize, j: usize| self.places.of([i, j]);
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
    }

    /// `int d_a phi_i d_b phi_j` for `b <= a`.
    #[inline]
    pub fn of(&self, [a, b]: [usize; 2], [i, j]: [usize; 2]) -> f64 {
        self.planes[a][b][self.places.of([i, j])]
    }
}

/// Adds `sum_q w_q D_0 phi_i D_1 phi_j` for the derivatives `D_0`, `D_1` along an axis each, or the values.
#[inline(always)]
pub fn add_products<const D: usize>(
    PairLines(lines): &PairLines<D>,
    derived: [Option<usize>; 2],
    weights: &[f64],
    to: &mut [f64],
) {
    let line = |d: usize| {
        let [a, b] = derived.map(|axis| usize::from(axis == Some(d)));
        &lines[d][a][b]
    };
    let [mut first, mut second] = [[0.0; LONGEST]; 2];
    if D == 2 {
        let first = &mut first[..POINTS * PAIRS];
        contract::<1>(weights, line(1), first);
        return contract::<PAIRS>(first, line(0), to);
    }
    let first = &mut first[..POINTS * POINTS * PAIRS];
    let second = &mut second[..POINTS * PAIRS * PAIRS];
    contract::<1>(weights, line(2), first);
    contract::<PAIRS>(first, line(1), second);
    contract::<{ PAIRS * PAIRS }>(second, line(0), to);
}

/// Sums up the slowest direction of the points: `to[r, s, t] += sum_q from[q, r, t] line[q][s]` for `INNER`
/// pairs `t` of the directions before.
#[inline(always)]
fn contract<const INNER: usize>(from: &[f64], line: &PairLine, to: &mut [f64]) {
    let (from, rest) = (from.as_chunks::<INNER>().0, from.len() / (POINTS * INNER));
    let rows = to.as_chunks_mut::<INNER>().0.as_chunks_mut::<PAIRS>().0;
    for (r, rows) in rows.iter_mut().enumerate() {
        let points: [&[f64; INNER]; POINTS] = std::array::from_fn(|q| &from[q * rest + r]);
        for (s, to) in rows.iter_mut().enumerate() {
            for t in 0..INNER {
                let [a, b, c, d, e]: [f64; POINTS] = std::array::from_fn(|q| line[q][s] * points[q][t]);
                to[t] += ((a + b) + (c + d)) + e;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{gauss_cube, gradient};

    fn are_sums_over_the_points<const D: usize>(offset: [f64; D], shear: f64) {
        let rule = gauss_cube::<D>(POINTS);
        let weights: Vec<f64> = (0..rule.len()).map(|q| (3.0 * q as f64).sin()).collect();
        let mut products = Products::zeros();
        products.add(&PairLines::new(offset), &weights);
        products.shear(shear);
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
