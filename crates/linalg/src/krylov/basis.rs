//! The vectors that a Krylov method keeps: an orthogonal basis, and the directions whose images span the same
//! space.
//!
//! Both are written where they stay: directions by the preconditioner, basis vectors by the operator. Basis
//! vectors are not scaled to norm one; their norms go into the coefficients.
//!
//! Sums over the entries held here are completed to sums over all entries by the caller
//! ([`crate::LinOp::complete`]).
//!
//! Orthogonalisation goes by groups of [`GROUP`] vectors, classical Gram-Schmidt inside a group and modified
//! between groups; the pass over `w` that subtracts one group takes the scalar products with the next.

use crate::scalar::Scalar;
use crate::vector::{BLOCK, axpy_block, dot_block};
use crate::{parallel, vector};

/// Vectors that one pass over `w` is orthogonalised against.
const GROUP: usize = 8;

/// Largest norm of a basis vector, and its inverse the smallest: products of entries stay in the range of
/// `f32`.
const LARGEST_NORM: f64 = 1e8;

/// Vectors of one length, of which the first are in use. Memory is kept for later use.
#[derive(Clone, Debug, Default)]
struct Stack<T> {
    vectors: Vec<Vec<T>>,
    dim: usize,
    count: usize,
}

impl<T: Scalar> Stack<T> {
    fn reset(&mut self, dim: usize) {
        self.count = 0;
        if self.dim != dim {
            self.dim = dim;
            self.vectors.iter_mut().for_each(|v| v.resize(dim, T::ZERO));
        }
    }

    /// The vectors in use and the one after them, whatever is in it.
    fn used_and_next(&mut self) -> (&[Vec<T>], &mut [T]) {
        if self.count == self.vectors.len() {
            self.vectors.push(parallel::filled(T::ZERO, self.dim));
        }
        let (used, rest) = self.vectors.split_at_mut(self.count);
        (used, &mut rest[0])
    }

    fn used(&self) -> &[Vec<T>] {
        &self.vectors[..self.count]
    }
}

/// The part of a vector that is orthogonal to a basis.
#[derive(Clone, Copy, Debug)]
pub struct Remainder {
    /// Its norm.
    pub norm: f64,
    /// Its product, over its norm, with another vector.
    pub product: f64,
}

/// An orthogonal basis. Its vectors keep the norms they have when they become orthogonal.
#[derive(Clone, Debug, Default)]
pub struct Basis<T> {
    vectors: Stack<T>,
    norms: Vec<f64>,
}

impl<T: Scalar> Basis<T> {
    /// An empty basis of vectors of length `dim`.
    pub fn reset(&mut self, dim: usize) {
        self.vectors.reset(dim);
        self.norms.clear();
    }

    /// Where the next vector is to be written.
    pub fn next(&mut self) -> &mut [T] {
        self.vectors.used_and_next().1
    }

    /// Takes what was written to [`Basis::next`] into the basis: a vector of this norm, orthogonal to the
    /// others. It is scaled if products with such vectors might leave the range of the scalar.
    pub fn push(&mut self, norm: f64) {
        let is_safe = (1.0 / LARGEST_NORM..=LARGEST_NORM).contains(&norm);
        if !is_safe {
            vector::scale(1.0 / norm, self.next());
        }
        self.vectors.count += 1;
        self.norms.push(if is_safe { norm } else { 1.0 });
    }

    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.vectors.count
    }

    /// The last vector; empty before there is one.
    pub fn last(&self) -> &[T] {
        self.vectors.used().last().map_or(&[], Vec::as_slice)
    }

    /// Makes [`Basis::next`] orthogonal to the basis, passes its products with the normalised vectors to
    /// `coefficient` and returns the norm of what is left and its product with `r`.
    pub fn orthogonalise(
        &mut self,
        r: &[T],
        complete: impl Fn(&mut [f64]),
        coefficient: impl FnMut(f64),
    ) -> Remainder {
        let (used, w) = self.vectors.used_and_next();
        let last = take_out_all(used, &self.norms, w, &complete, coefficient);
        let terms =
            |at: usize, block: &[T]| [dot_block(block, block), dot_block(&r[at..][..block.len()], block)];
        let mut sums = pass(w, last, terms);
        complete(&mut sums);
        let [square, product] = sums;
        let norm = square.sqrt();
        Remainder { norm, product: product / norm }
    }

    /// Makes `r` orthogonal to the basis, passes its products with the normalised vectors to `coefficient`
    /// and returns the norm of what is left.
    pub fn take_out(&self, r: &mut [T], complete: impl Fn(&mut [f64]), coefficient: impl FnMut(f64)) -> f64 {
        let last = take_out_all(self.vectors.used(), &self.norms, r, &complete, coefficient);
        norm_after(r, last, complete)
    }

    /// Subtracts this multiple of the last vector, normalised, from `r` and returns the norm of what is left.
    pub fn take_out_last(&self, multiple: f64, r: &mut [T], complete: impl Fn(&mut [f64])) -> f64 {
        let last = self.vectors.count.saturating_sub(1);
        let mut h = [0.0; GROUP];
        h[0] = multiple / self.norms.last().copied().unwrap_or(1.0);
        norm_after(r, Pending { group: &self.vectors.used()[last..], multiples: h }, complete)
    }
}

/// Vectors of a group, and their multiples that are still to be subtracted.
struct Pending<'a, T> {
    group: &'a [Vec<T>],
    multiples: [f64; GROUP],
}

/// Takes all groups but the last out of `w`; what is to be subtracted of that one is returned.
fn take_out_all<'a, T: Scalar>(
    vectors: &'a [Vec<T>],
    norms: &[f64],
    w: &mut [T],
    complete: &impl Fn(&mut [f64]),
    mut coefficient: impl FnMut(f64),
) -> Pending<'a, T> {
    let mut before = Pending { group: &[], multiples: [0.0; GROUP] };
    for (group, norms) in vectors.chunks(GROUP).zip(norms.chunks(GROUP)) {
        let mut h = pass(w, before, |at, block| products(group, at, block));
        complete(&mut h[..group.len()]);
        for (h, norm) in h.iter_mut().zip(norms) {
            *h /= norm;
            coefficient(*h);
            *h /= norm;
        }
        before = Pending { group, multiples: h };
    }
    before
}

/// Subtracts what is pending from `w` and returns its norm.
fn norm_after<T: Scalar>(w: &mut [T], pending: Pending<'_, T>, complete: impl Fn(&mut [f64])) -> f64 {
    let mut square = pass(w, pending, |_, block| [dot_block(block, block)]);
    complete(&mut square);
    square[0].sqrt()
}

/// Subtracts what is pending from `w` and sums `terms(first index, block)` over the blocks of
/// the result.
fn pass<T: Scalar, const N: usize>(
    w: &mut [T],
    pending: Pending<'_, T>,
    terms: impl Fn(usize, &[T]) -> [f64; N] + Sync,
) -> [f64; N] {
    parallel::update_and_sum(w, |first, piece| {
        let mut sums = [0.0; N];
        for (k, block) in piece.chunks_mut(BLOCK).enumerate() {
            let at = first + k * BLOCK;
            subtract(pending.group, &pending.multiples, at, block);
            let terms = terms(at, block);
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        sums
    })
}

/// Scalar products of the vectors, from index `at` on, with a block.
fn products<T: Scalar>(vectors: &[Vec<T>], at: usize, block: &[T]) -> [f64; GROUP] {
    let mut sums = [0.0; GROUP];
    for (sum, v) in sums.iter_mut().zip(vectors) {
        *sum = dot_block(&v[at..][..block.len()], block);
    }
    sums
}

fn subtract<T: Scalar>(vectors: &[Vec<T>], h: &[f64; GROUP], at: usize, block: &mut [T]) {
    for (h, v) in h.iter().zip(vectors) {
        axpy_block(-h, &v[at..], block);
    }
}

/// The directions that a preconditioner has returned.
#[derive(Clone, Debug, Default)]
pub struct Directions<S> {
    vectors: Stack<S>,
}

impl<S: Scalar> Directions<S> {
    /// No directions, of length `dim`.
    pub fn reset(&mut self, dim: usize) {
        self.vectors.reset(dim);
    }

    /// One more direction, as `fill` writes it.
    pub fn push_with(&mut self, fill: impl FnOnce(&mut [S])) -> &[S] {
        fill(self.vectors.used_and_next().1);
        self.vectors.count += 1;
        &self.vectors.vectors[self.vectors.count - 1]
    }

    /// Drops the last direction.
    pub fn pop(&mut self) {
        self.vectors.count = self.vectors.count.saturating_sub(1);
    }

    /// `x += Z y`.
    pub fn add<T: Scalar>(&self, y: &[f64], x: &mut [T]) {
        parallel::for_each(x, |first, piece| {
            for (k, block) in piece.chunks_mut(BLOCK).enumerate() {
                let at = first + k * BLOCK;
                for (z, &y) in self.vectors.used().iter().zip(y) {
                    axpy_block(y, &z[at..], block);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize, k: f64) -> Vec<f64> {
        (0..n).map(|i| (k * i as f64 + 0.3 * k * k).sin()).collect()
    }

    #[test]
    fn remainders_are_orthogonal_to_the_basis() {
        let n = 3 * BLOCK + 5;
        let mut basis = Basis::<f64>::default();
        basis.reset(n);
        let mut stored: Vec<Vec<f64>> = Vec::new();
        for j in 0..19 {
            let w = wave(n, 0.1 + 0.37 * j as f64);
            basis.next().copy_from_slice(&w);
            let mut h = Vec::new();
            let r = wave(n, 0.2);
            let Remainder { norm, product } = basis.orthogonalise(&r, |_| {}, |c| h.push(c));
            assert_eq!(h.len(), j);
            assert!((product * norm - vector::dot(&r, basis.next())).abs() < 1e-12 * vector::norm(&r) * norm);
            assert!((norm - vector::norm(basis.next())).abs() < 1e-12 * norm);
            let square = norm * norm + h.iter().map(|h| h * h).sum::<f64>();
            assert!((square / vector::dot(&w, &w) - 1.0).abs() < 1e-12);
            basis.push(norm);
            let last = basis.last();
            assert!(stored.iter().all(|v| vector::dot(v, last).abs() < 1e-13 * vector::norm(v) * norm));
            stored.push(last.to_vec());
        }
        let mut r = wave(n, 0.2);
        basis.take_out(&mut r, |_| {}, |_| {});
        assert!(
            stored.iter().all(|v| vector::dot(v, &r).abs() < 1e-12 * vector::norm(v) * (n as f64).sqrt())
        );
        let mut last = stored[18].clone();
        let norm = vector::norm(&last);
        assert!(basis.take_out_last(0.75 * norm, &mut last, |_| {}) / norm - 0.25 < 1e-14);
    }

    #[test]
    fn directions_are_kept_as_they_are_and_added_up() {
        let mut directions = Directions::<f32>::default();
        directions.reset(100);
        let mut want = vec![0.0; 100];
        for k in 0..3 {
            let z = directions.push_with(|z| {
                z.copy_from_slice(&wave(100, 0.7 + k as f64).iter().map(|&z| z as f32).collect::<Vec<_>>())
            });
            want.iter_mut().zip(z).for_each(|(sum, &z)| *sum += (k as f64 - 0.5) * f64::from(z));
        }
        let mut x = vec![0.0; 100];
        directions.add(&[-0.5, 0.5, 1.5], &mut x);
        assert!(x.iter().zip(&want).all(|(x, want)| (x - want).abs() < 1e-15));
    }

    #[test]
    fn only_extreme_vectors_are_scaled() {
        for (norm, stored) in [(1e-7, 1e-7), (1e-60, 1.0), (3e70, 1.0)] {
            let mut basis = Basis::<f64>::default();
            basis.reset(2);
            basis.next().copy_from_slice(&[0.6 * norm, -0.8 * norm]);
            basis.push(norm);
            assert!((vector::norm(basis.last()) / stored - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn memory_serves_vectors_of_another_length() {
        let mut basis = Basis::<f64>::default();
        for n in [10, 4, 7] {
            basis.reset(n);
            assert_eq!((basis.next().len(), basis.last().len()), (n, 0));
            basis.push(1.0);
        }
    }
}
