//! Operators and preconditioners: all that iterative methods ask of a matrix and of its approximate inverse.

use crate::scalar::Scalar;
use crate::vector;

/// A square linear operator that is known by its action on vectors of `T`.
pub trait LinOp<T> {
    /// Number of rows, equal to the number of columns.
    fn dim(&self) -> usize;

    /// `y = A x`. All of `y` is overwritten; nothing is allocated.
    fn apply(&mut self, x: &[T], y: &mut [T]);

    /// Completes sums over the entries held here to sums over all entries, where vectors are shared by ranks.
    /// [`crate::Gcr`] takes all its scalar products so.
    fn complete(&self, _sums: &mut [f64]) {}

    /// Changes an iterate for the right-hand side `b` so that equations hold exactly that are wanted to.
    /// Every iterate whose true residual [`crate::Gcr`] computes went through it.
    fn settle(&mut self, _b: &[T], _x: &mut [T]) {}

    /// Sets entries of the residual `r = b - A x` to zero that are within the rounding error of their own
    /// sums, where those are of terms so large that the rest of the residual cannot be seen beside it.
    /// Returns whether there are any. Called after `y = A x`, with the same `x`.
    fn clear_rounding(&mut self, _b: &[T], _x: &[T], _r: &mut [T]) -> bool {
        false
    }
}

/// An approximate inverse `M^-1` of an operator.
pub trait Preconditioner<T> {
    /// `z = M^-1 r`. All of `z` is overwritten; nothing is allocated.
    fn apply(&mut self, r: &[T], z: &mut [T]);

    /// `M^-1` on the leading unknowns that it multiplies one by one, which lets a smoother do so in passing.
    fn diagonal(&self) -> &[T] {
        &[]
    }

    /// Unknowns among those of [`Preconditioner::diagonal`] on which there is more than it, to be added.
    fn scattered(&self) -> &[u32] {
        &[]
    }

    /// The addition there: `z = P r` for vectors on the scattered unknowns alone.
    fn apply_scattered(&mut self, _r: &[T], z: &mut [T]) {
        debug_assert!(z.is_empty(), "scattered unknowns without a matrix");
    }

    /// `z = M^-1 r` on the unknowns after those of [`Preconditioner::diagonal`], which they must not depend
    /// on.
    fn apply_rest(&mut self, r: &[T], z: &mut [T]) {
        self.apply(r, z);
    }
}

impl<T, A: LinOp<T> + ?Sized> LinOp<T> for &mut A {
    fn dim(&self) -> usize {
        (**self).dim()
    }

    fn apply(&mut self, x: &[T], y: &mut [T]) {
        (**self).apply(x, y);
    }

    fn complete(&self, sums: &mut [f64]) {
        (**self).complete(sums);
    }

    fn settle(&mut self, b: &[T], x: &mut [T]) {
        (**self).settle(b, x);
    }

    fn clear_rounding(&mut self, b: &[T], x: &[T], r: &mut [T]) -> bool {
        (**self).clear_rounding(b, x, r)
    }
}

impl<T, M: Preconditioner<T> + ?Sized> Preconditioner<T> for &mut M {
    fn apply(&mut self, r: &[T], z: &mut [T]) {
        (**self).apply(r, z);
    }

    fn diagonal(&self) -> &[T] {
        (**self).diagonal()
    }

    fn scattered(&self) -> &[u32] {
        (**self).scattered()
    }

    fn apply_scattered(&mut self, r: &[T], z: &mut [T]) {
        (**self).apply_scattered(r, z);
    }

    fn apply_rest(&mut self, r: &[T], z: &mut [T]) {
        (**self).apply_rest(r, z);
    }
}

/// An operator or preconditioner given by a closure `|x, y| ...` that sets `y`.
pub struct FnOp<F> {
    dim: usize,
    action: F,
}

impl<F> FnOp<F> {
    /// The operator of dimension `dim` whose action is `action(x, y)`.
    pub fn new(dim: usize, action: F) -> Self {
        Self { dim, action }
    }
}

impl<T, F: FnMut(&[T], &mut [T])> LinOp<T> for FnOp<F> {
    fn dim(&self) -> usize {
        self.dim
    }

    fn apply(&mut self, x: &[T], y: &mut [T]) {
        (self.action)(x, y);
    }
}

impl<T, F: FnMut(&[T], &mut [T])> Preconditioner<T> for FnOp<F> {
    fn apply(&mut self, r: &[T], z: &mut [T]) {
        (self.action)(r, z);
    }
}

/// No preconditioning: `z = r`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Identity;

impl<T: Copy> Preconditioner<T> for Identity {
    fn apply(&mut self, r: &[T], z: &mut [T]) {
        z.copy_from_slice(r);
    }
}

/// Jacobi's preconditioner: division by a diagonal.
#[derive(Clone, Debug)]
pub struct Jacobi<T> {
    inverse: Vec<T>,
}

/// The entry of a diagonal that has no inverse.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("diagonal entry {row} is {value:e} and cannot be inverted")]
pub struct BadDiagonal {
    /// Index of the entry.
    pub row: usize,
    /// Its value: zero, infinite or NaN.
    pub value: f64,
}

impl<T: Scalar> Jacobi<T> {
    /// Division by `diagonal`, whose entries are finite and not zero.
    pub fn new(diagonal: &[T]) -> Result<Self, BadDiagonal> {
        let mut jacobi = Self { inverse: vec![T::ONE; diagonal.len()] };
        jacobi.refill(diagonal)?;
        Ok(jacobi)
    }

    /// Takes a new diagonal of the same length.
    pub fn refill(&mut self, diagonal: &[T]) -> Result<(), BadDiagonal> {
        for (row, (inverse, &d)) in self.inverse.iter_mut().zip(diagonal).enumerate() {
            *inverse = T::ONE / d;
            if !(inverse.is_finite() && d.is_finite()) {
                return Err(BadDiagonal { row, value: d.to_f64() });
            }
        }
        Ok(())
    }
}

impl<T: Scalar> Preconditioner<T> for Jacobi<T> {
    fn apply(&mut self, r: &[T], z: &mut [T]) {
        vector::multiply(&self.inverse, r, z);
    }

    fn diagonal(&self) -> &[T] {
        &self.inverse
    }

    fn apply_rest(&mut self, _: &[T], _: &mut [T]) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobi_divides_and_names_the_bad_row() {
        let mut jacobi = Jacobi::new(&[2.0, -4.0]).expect("invertible");
        let mut z = [0.0; 2];
        jacobi.apply(&[1.0, 1.0], &mut z);
        assert_eq!(z, [0.5, -0.25]);
        assert_eq!(Jacobi::new(&[1.0, 0.0]).expect_err("zero"), BadDiagonal { row: 1, value: 0.0 });
        assert!(Jacobi::new(&[f64::NAN]).is_err());
        assert!(Jacobi::new(&[f64::INFINITY]).is_err());
    }
}
