//! Values that are short linear forms in the unknowns of a problem, plus known numbers: `u = T x + g`.
//!
//! A hanging node is a weighted sum of its masters, a node of a rigid body of the entries of the body's
//! twist, a node with a boundary value is that value, and a free node is an unknown itself. The equations of
//! a problem `A u = f` in the values are then `T^T A T x = T^T (f - A g)` in the unknowns. (deal.II:
//! `AffineConstraints`, distribute and condense.)

use crate::scalar::Scalar;
use crate::subset::Subset;

/// The map `u = T x + g`, a few terms per row.
///
/// ```
/// use gluey_linalg::AffineConstraints;
///
/// // Two free nodes, a hanging one halfway between them, and one with the value 5.
/// let mut constraints = AffineConstraints::zeros(4, 2);
/// constraints.set(0, [(0, 1.0)]);
/// constraints.set(1, [(1, 1.0)]);
/// constraints.set_combination(2, [(0, 0.5), (1, 0.5)]);
/// constraints.set_inhomogeneity(3, 5.0);
/// let mut u = [0.0; 4];
/// constraints.apply(&[1.0, 2.0], &mut u);
/// assert_eq!(u, [1.0, 2.0, 1.5, 5.0]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct AffineConstraints {
    /// Where the terms of each row start and end: rows are set in any order.
    ranges: Vec<(u32, u32)>,
    /// Unknowns and weights.
    terms: Vec<(u32, f64)>,
    /// Of each row; empty where all are zero.
    inhomogeneities: Vec<f64>,
    unknown_count: usize,
}

impl AffineConstraints {
    /// `u = 0`.
    pub fn zeros(row_count: usize, unknown_count: usize) -> Self {
        let (ranges, terms) = (vec![(0, 0); row_count], Vec::with_capacity(row_count));
        Self { ranges, terms, inhomogeneities: Vec::new(), unknown_count }
    }

    /// `u = x`.
    pub fn identity(count: usize) -> Self {
        let mut new = Self::zeros(count, count);
        (0..count).for_each(|row| new.set(row, [(row as u32, 1.0)]));
        new
    }

    /// Sets the terms `(unknown, weight)` of a row.
    pub fn set(&mut self, row: usize, terms: impl IntoIterator<Item = (u32, f64)>) {
        let start = self.terms.len() as u32;
        self.terms.extend(terms);
        self.ranges[row] = (start, self.terms.len() as u32);
    }

    /// Sets the inhomogeneity of a row.
    pub fn set_inhomogeneity(&mut self, row: usize, value: f64) {
        if value != 0.0 && self.inhomogeneities.is_empty() {
            self.inhomogeneities.resize(self.ranges.len(), 0.0);
        }
        if let Some(inhomogeneity) = self.inhomogeneities.get_mut(row) {
            *inhomogeneity = value;
        }
    }

    /// Sets a row to the weighted sum of others that have been set before: a hanging node from its masters.
    pub fn set_combination(&mut self, row: usize, parts: impl IntoIterator<Item = (usize, f64)>) {
        let start = self.terms.len() as u32;
        let mut inhomogeneity = 0.0;
        for (part, weight) in parts {
            let (from, to) = self.ranges[part];
            for term in from..to {
                let (unknown, w) = self.terms[term as usize];
                self.terms.push((unknown, w * weight));
            }
            inhomogeneity += weight * self.inhomogeneity(part);
        }
        self.ranges[row] = (start, self.terms.len() as u32);
        self.set_inhomogeneity(row, inhomogeneity);
    }

    /// Number of values `u`.
    pub fn row_count(&self) -> usize {
        self.ranges.len()
    }

    /// Number of unknowns `x`.
    pub fn unknown_count(&self) -> usize {
        self.unknown_count
    }

    /// Terms `(unknown, weight)` of a row.
    #[inline(always)]
    pub fn terms(&self, row: usize) -> &[(u32, f64)] {
        let (start, end) = self.ranges[row];
        &self.terms[start as usize..end as usize]
    }

    /// Inhomogeneity of a row.
    pub fn inhomogeneity(&self, row: usize) -> f64 {
        self.inhomogeneities.get(row).copied().unwrap_or(0.0)
    }

    /// `u = T x + g` (distribute).
    pub fn apply<T: Scalar>(&self, x: &[T], u: &mut [T]) {
        for (row, u) in u.iter_mut().enumerate() {
            let terms = self.terms(row).iter();
            *u = terms.fold(T::from_f64(self.inhomogeneity(row)), |sum, &(unknown, weight)| {
                sum + T::from_f64(weight) * x[unknown as usize]
            });
        }
    }

    /// `r = T^T f` (condense).
    pub fn apply_transpose<T: Scalar>(&self, f: &[T], r: &mut [T]) {
        r.fill(T::ZERO);
        for (row, &f) in f.iter().enumerate() {
            for &(unknown, weight) in self.terms(row) {
                r[unknown as usize] += T::from_f64(weight) * f;
            }
        }
    }

    /// This map after `inner`: `u = T (S y + h) + g` for `inner` `x = S y + h`.
    pub fn after(&self, inner: &Self) -> Self {
        debug_assert_eq!(self.unknown_count, inner.row_count());
        let mut new = Self::zeros(self.row_count(), inner.unknown_count);
        for row in 0..self.row_count() {
            let start = new.terms.len() as u32;
            let mut inhomogeneity = self.inhomogeneity(row);
            for &(middle, weight) in self.terms(row) {
                let terms = inner.terms(middle as usize).iter();
                new.terms.extend(terms.map(|&(unknown, w)| (unknown, w * weight)));
                inhomogeneity += weight * inner.inhomogeneity(middle as usize);
            }
            new.ranges[row] = (start, new.terms.len() as u32);
            new.set_inhomogeneity(row, inhomogeneity);
        }
        new
    }

    /// The same forms in the numbers of `kept`, in which unknown `k` has the position `first + k`; the others
    /// count as zero.
    pub fn restricted_to(&self, kept: &Subset, first: usize) -> Self {
        let mut new = Self::zeros(self.row_count(), kept.len());
        for row in 0..self.row_count() {
            let number = |&(k, w): &(u32, f64)| Some((kept.number(first + k as usize)? as u32, w));
            new.set(row, self.terms(row).iter().filter_map(number));
        }
        Self { inhomogeneities: self.inhomogeneities.clone(), ..new }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{dot, fill_pseudo_random};

    /// Rows of all kinds, set out of order: `seed` makes two of them differ.
    fn example(row_count: usize, unknown_count: usize, seed: u64) -> AffineConstraints {
        let mut weights = vec![0.0; row_count];
        fill_pseudo_random(seed, &mut weights);
        let mut new = AffineConstraints::zeros(row_count, unknown_count);
        for row in (0..row_count).rev().filter(|row| row % 3 != 0) {
            new.set(
                row,
                [((row % unknown_count) as u32, weights[row]), ((row / 2 % unknown_count) as u32, 0.5)],
            );
            new.set_inhomogeneity(row, weights[row] * (row % 2) as f64);
        }
        for row in (0..row_count - 2).filter(|row| row % 3 == 0) {
            new.set_combination(row, [(row + 1, 0.25), (row + 2, weights[row])]);
        }
        new
    }

    fn random(n: usize, seed: u64) -> Vec<f64> {
        let mut x = vec![0.0; n];
        fill_pseudo_random(seed, &mut x);
        x
    }

    fn applied(constraints: &AffineConstraints, x: &[f64]) -> Vec<f64> {
        let mut u = vec![f64::NAN; constraints.row_count()];
        constraints.apply(x, &mut u);
        u
    }

    #[test]
    fn condensing_is_the_transpose_of_distributing() {
        let constraints = example(40, 11, 1);
        let (x, f) = (random(11, 2), random(40, 3));
        let g = applied(&constraints, &[0.0; 11]);
        let tx: Vec<f64> = applied(&constraints, &x).iter().zip(&g).map(|(u, g)| u - g).collect();
        let mut r = vec![f64::NAN; 11];
        constraints.apply_transpose(&f, &mut r);
        assert!((dot(&tx, &f) - dot(&x, &r)).abs() < 1e-13);
        assert!(g.iter().any(|g| *g != 0.0));
    }

    #[test]
    fn a_composition_is_one_map_after_the_other() {
        let (outer, inner) = (example(30, 12, 4), example(12, 5, 5));
        let y = random(5, 6);
        let (once, twice) = (applied(&outer.after(&inner), &y), applied(&outer, &applied(&inner, &y)));
        assert!(once.iter().zip(&twice).all(|(a, b)| (a - b).abs() < 1e-14));
        let identity = AffineConstraints::identity(12);
        assert_eq!(applied(&identity.after(&inner), &y), applied(&inner, &y));
        let x = random(12, 7);
        assert_eq!(applied(&outer.after(&identity), &x), applied(&outer, &x));
    }

    #[test]
    fn combinations_of_rows_are_combinations_of_values() {
        let constraints = example(20, 7, 7);
        let u = applied(&constraints, &random(7, 8));
        let mut weights = vec![0.0; 20];
        fill_pseudo_random(7, &mut weights);
        for row in [0, 3, 6, 9, 12, 15] {
            assert!((u[row] - 0.25 * u[row + 1] - weights[row] * u[row + 2]).abs() < 1e-15);
        }
    }

    #[test]
    fn unknowns_that_are_left_out_count_as_zero() {
        let constraints = example(20, 7, 9);
        let kept = Subset::new(10, |position| position >= 4 && position != 5);
        let short = random(kept.len(), 10);
        let mut long = vec![0.0; 10];
        kept.scatter(&short, &mut long);
        let restricted = constraints.restricted_to(&kept, 3);
        assert_eq!(restricted.unknown_count(), kept.len());
        assert_eq!(applied(&restricted, &short), applied(&constraints, &long[3..]));
    }
}
