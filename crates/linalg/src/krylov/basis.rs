//! The vectors that flexible GMRES keeps: an orthonormal basis in the scalar `T` of the problem, directions in a narrower
//! one, `S`.
//!
//! Rounding a direction `z_j` costs nothing but a little of the preconditioner's quality: the operator is applied to what
//! is stored.
//!
//! Orthogonalisation goes by groups of [`GROUP`] vectors, classical Gram-Schmidt inside a group and modified between
//! groups; the pass over `w` that subtracts one group takes the scalar products with the next.

use crate::vector::{BLOCK, axpy_block, dot_block};
use crate::{Scalar, parallel, vector};

/// Vectors that one pass over `w` is orthogonalised against.
const GROUP: usize = 4;

/// Vectors of one length, of which the first are in use. Memory is kept for later use.
#[derive(Clone, Debug, Default)]
struct Stack<T> {
    vectors: Vec<Vec<T>>,
    count: usize,
}

impl<T: Scalar> Stack<T> {
    fn reset(&mut self, dim: usize) {
        self.count = 0;
        if self.vectors.first().is_some_and(|v| v.len() != dim) {
            self.vectors.clear();
        }
    }

    fn next(&mut self, dim: usize) -> &mut [T] {
        if self.count == self.vectors.len() {
            self.vectors.push(vec![T::ZERO; dim]);
        }
        self.count += 1;
        &mut self.vectors[self.count - 1]
    }

    fn used(&self) -> &[Vec<T>] {
        &self.vectors[..self.count]
    }
}

/// The orthonormal basis of a Krylov space.
#[derive(Clone, Debug, Default)]
pub struct Basis<T> {
    vectors: Stack<T>,
}

impl<T: Scalar> Basis<T> {
    /// An empty basis of vectors of length `dim`.
    pub fn reset(&mut self, dim: usize) {
        self.vectors.reset(dim);
    }

    /// Appends `a w` and leaves in `w` what was stored.
    pub fn push(&mut self, a: f64, w: &mut [T]) {
        store(a, w, 1.0, self.vectors.next(w.len()));
    }

    /// Makes `w` orthogonal to the basis, passes the coefficients taken out to `coefficient` and returns the norm of
    /// what is left.
    pub fn orthogonalise(&self, w: &mut [T], mut coefficient: impl FnMut(f64)) -> f64 {
        let mut before: (&[Vec<T>], _) = (&[], [0.0; GROUP]);
        for group in self.vectors.used().chunks(GROUP) {
            let h = pass(w, before, |at, block| products(group, at, block));
            h[..group.len()].iter().for_each(|&h| coefficient(h));
            before = (group, h);
        }
        let [square] = pass(w, before, |_, block| [dot_block(block, block)]);
        square.sqrt()
    }
}

/// Subtracts the multiples `h` of `group` from `w` and sums `terms(first index, block)` over the blocks of the result.
fn pass<T: Scalar, const N: usize>(
    w: &mut [T],
    (group, h): (&[Vec<T>], [f64; GROUP]),
    terms: impl Fn(usize, &[T]) -> [f64; N] + Sync,
) -> [f64; N] {
    parallel::update_and_sum(w, |first, piece| {
        let mut sums = [0.0; N];
        for (k, block) in piece.chunks_mut(BLOCK).enumerate() {
            let at = first + k * BLOCK;
            subtract(group, &h, at, block);
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

/// `to = a from` in the precision of `to`, and `from = b to`.
fn store<S: Scalar, T: Scalar>(a: f64, from: &mut [T], b: f64, to: &mut [S]) {
    let (a, b) = (T::from_f64(a), T::from_f64(b));
    parallel::for_each_2(from, to, |_, from, to| {
        for (from, to) in from.iter_mut().zip(to) {
            *to = S::from_f64((a * *from).to_f64());
            *from = b * T::from_f64(to.to_f64());
        }
    });
}

/// Preconditioned basis vectors, each scaled to norm one so that none leaves the range of `S`.
#[derive(Clone, Debug, Default)]
pub struct Directions<S> {
    vectors: Stack<S>,
    norms: Vec<f64>,
}

impl<S: Scalar> Directions<S> {
    /// No directions, of length `dim`.
    pub fn reset(&mut self, dim: usize) {
        self.vectors.reset(dim);
        self.norms.clear();
    }

    /// Appends `z` and leaves in `z` what was stored.
    pub fn push<T: Scalar>(&mut self, z: &mut [T]) {
        let norm = vector::norm(z);
        let scale = if norm > 0.0 { norm } else { 1.0 };
        store(1.0 / scale, z, scale, self.vectors.next(z.len()));
        self.norms.push(norm);
    }

    /// Bound `sum_j |y_j| |z_j|` of the norm of `Z y`.
    pub fn bound(&self, y: &[f64]) -> f64 {
        y.iter().zip(&self.norms).map(|(y, norm)| y.abs() * norm).sum()
    }

    /// `x += Z y`.
    pub fn add<T: Scalar>(&self, y: &[f64], x: &mut [T]) {
        parallel::for_each(x, |first, piece| {
            for (k, block) in piece.chunks_mut(BLOCK).enumerate() {
                let at = first + k * BLOCK;
                for ((z, norm), y) in self.vectors.used().iter().zip(&self.norms).zip(y) {
                    axpy_block(y * norm, &z[at..], block);
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
    fn what_is_left_is_orthogonal_to_the_basis() {
        let n = 3 * BLOCK + 5;
        let mut basis = Basis::<f64>::default();
        basis.reset(n);
        let mut stored: Vec<Vec<f64>> = Vec::new();
        for j in 0..11 {
            let mut w = wave(n, 0.1 + 0.37 * j as f64);
            let mut h = Vec::new();
            let norm = basis.orthogonalise(&mut w, |c| h.push(c));
            assert_eq!(h.len(), j);
            assert!((norm - vector::norm(&w)).abs() < 1e-12 * norm);
            basis.push(1.0 / norm, &mut w);
            assert!(stored.iter().all(|v| vector::dot(v, &w).abs() < 1e-13));
            stored.push(w);
        }
    }

    #[test]
    fn directions_keep_seven_digits_at_any_scale() {
        let mut directions = Directions::<f32>::default();
        directions.reset(100);
        for scale in [1e-100, 1.0, 1e100] {
            let exact: Vec<f64> = wave(100, 0.7).iter().map(|z| scale * z).collect();
            let mut z = exact.clone();
            directions.push(&mut z);
            let error: f64 = z.iter().zip(&exact).map(|(a, b)| (a / scale - b / scale).abs()).sum();
            assert!(error > 0.0 && error < 1e-5);
            let mut x = vec![0.0; 100];
            let mut y = vec![0.0; directions.norms.len()];
            *y.last_mut().expect("pushed") = 1.0;
            directions.add(&y, &mut x);
            assert!(x.iter().zip(&z).all(|(x, z)| (x - z).abs() <= 1e-15 * scale));
        }
    }
}
