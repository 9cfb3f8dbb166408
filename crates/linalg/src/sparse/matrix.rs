//! Sparse matrices in compressed rows: the pattern apart from the values, so that a steady mesh refills only
//! values.

use std::sync::Arc;

use rayon::prelude::*;

use super::pattern::{Pattern, SparseError};
use crate::operator::LinOp;
use crate::parallel;
use crate::scalar::Scalar;

/// Rows that are filled by one thread at a time.
const ROWS: usize = 1024;

/// A sparse matrix: a shared pattern and its own values.
#[derive(Clone, Debug)]
pub struct SparseMatrix<T = f64> {
    pattern: Arc<Pattern>,
    values: Vec<T>,
}

impl<T: Scalar> SparseMatrix<T> {
    /// The zero matrix of a pattern.
    pub fn zeros(pattern: Arc<Pattern>) -> Self {
        let values = parallel::filled(T::ZERO, pattern.entry_count());
        Self { pattern, values }
    }

    /// The matrix with the given values, in the order of the pattern.
    pub fn new(pattern: Arc<Pattern>, values: Vec<T>) -> Result<Self, SparseError> {
        let (expected, found) = (pattern.entry_count(), values.len());
        if expected != found {
            return Err(SparseError::WrongLength { expected, found });
        }
        Ok(Self { pattern, values })
    }

    /// The sum of the triplets `(row, column, value)`.
    pub fn from_triplets(
        row_count: usize,
        column_count: usize,
        triplets: &[(usize, usize, T)],
    ) -> Result<Self, SparseError> {
        let entries: Vec<_> = triplets.iter().map(|&(row, column, _)| (row, column)).collect();
        let pattern = Pattern::from_entries(row_count, column_count, &entries)?;
        let mut matrix = Self::zeros(Arc::new(pattern));
        for &(row, column, value) in triplets {
            matrix.add(row, column, value)?;
        }
        Ok(matrix)
    }

    /// The pattern.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// The values in the order of the pattern.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// The values, for refilling by position (see [`Pattern::position`]).
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// Overwrites all values, in the order of the pattern.
    pub fn copy_values(&mut self, values: &[T]) -> Result<(), SparseError> {
        let (expected, found) = (self.values.len(), values.len());
        if expected != found {
            return Err(SparseError::WrongLength { expected, found });
        }
        self.values.copy_from_slice(values);
        Ok(())
    }

    /// Sets all values to zero and keeps the pattern.
    pub fn clear(&mut self) {
        self.values.fill(T::ZERO);
    }

    /// Adds to one entry.
    pub fn add(&mut self, row: usize, column: usize, value: T) -> Result<(), SparseError> {
        let position = self.pattern.position(row, column).ok_or(SparseError::NotInPattern { row, column })?;
        self.values[position] += value;
        Ok(())
    }

    /// Has `fill` change each row, given its columns and values, some rows side by side.
    pub fn fill_rows(&mut self, fill: impl Fn(usize, &[u32], &mut [T]) + Sync) {
        let Self { pattern, values } = self;
        let (rows, mut rest) = (pattern.row_count(), values.as_mut_slice());
        let mut parts = Vec::with_capacity(rows.div_ceil(ROWS));
        for first in (0..rows).step_by(ROWS) {
            let last = (first + ROWS).min(rows);
            let own;
            (own, rest) = rest.split_at_mut(pattern.range(last - 1).end - pattern.range(first).start);
            parts.push((first..last, own));
        }
        parts.into_par_iter().for_each(|(rows, mut values)| {
            for row in rows {
                let columns = pattern.columns_of(row);
                let own;
                (own, values) = values.split_at_mut(columns.len());
                fill(row, columns, own);
            }
        });
    }

    /// Adds a dense block, stored row by row, to the rows and columns `dofs`.
    pub fn add_block(&mut self, dofs: &[usize], block: &[T]) -> Result<(), SparseError> {
        debug_assert_eq!(block.len(), dofs.len() * dofs.len());
        for (&row, values) in dofs.iter().zip(block.chunks_exact(dofs.len())) {
            for (&column, &value) in dofs.iter().zip(values) {
                self.add(row, column, value)?;
            }
        }
        Ok(())
    }

    /// The entry, or zero where the pattern has none.
    pub fn get(&self, row: usize, column: usize) -> T {
        self.pattern.position(row, column).map_or(T::ZERO, |position| self.values[position])
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<T> {
        (0..self.pattern.row_count()).map(|row| self.get(row, row)).collect()
    }

    /// `y = A x`.
    pub fn multiply(&self, x: &[T], y: &mut [T]) {
        parallel::for_each(y, |first, y| {
            for (row, y) in y.iter_mut().enumerate() {
                *y = self.row_product(first + row, x);
            }
        });
    }

    /// `y += a A x`.
    pub fn multiply_add(&self, a: f64, x: &[T], y: &mut [T]) {
        let a = T::from_f64(a);
        parallel::for_each(y, |first, y| {
            for (row, y) in y.iter_mut().enumerate() {
                *y += a * self.row_product(first + row, x);
            }
        });
    }

    /// In partial sums, so that one product need not wait for the one before.
    fn row_product(&self, row: usize, x: &[T]) -> T {
        const SUMS: usize = 4;
        let range = self.pattern.range(row);
        let (columns, last_columns) = self.pattern.columns()[range.clone()].as_chunks::<SUMS>();
        let (values, last_values) = self.values[range].as_chunks::<SUMS>();
        let mut sums = [T::ZERO; SUMS];
        for (columns, values) in columns.iter().zip(values) {
            for k in 0..SUMS {
                sums[k] += values[k] * x[columns[k] as usize];
            }
        }
        let last = last_columns.iter().zip(last_values);
        let sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
        last.fold(sum, |sum, (&c, &v)| sum + v * x[c as usize])
    }
}

impl<T: Scalar> LinOp<T> for SparseMatrix<T> {
    fn dim(&self) -> usize {
        self.pattern.row_count()
    }

    fn apply(&mut self, x: &[T], y: &mut [T]) {
        self.multiply(x, y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triplets_add_up() {
        let a = SparseMatrix::from_triplets(2, 3, &[(1, 2, 4.0), (0, 0, 1.0), (1, 2, -1.0), (1, 0, 2.0)])
            .expect("valid");
        let mut y = [0.0; 2];
        a.multiply(&[1.0, 10.0, 100.0], &mut y);
        assert_eq!(y, [1.0, 302.0]);
        a.multiply_add(-1.0, &[1.0, 10.0, 100.0], &mut y);
        assert_eq!(y, [0.0, 0.0]);
        assert!(!a.pattern().is_symmetric());
        assert!(SparseMatrix::from_triplets(2, 2, &[(2, 0, 1.0)]).is_err());
        assert!(SparseMatrix::from_triplets(2, 2, &[(0, 2, 1.0)]).is_err());
    }

    #[test]
    fn refilling_keeps_the_pattern() {
        let pattern = Arc::new(Pattern::from_groups(3, &[[0, 1], [1, 2]]).expect("valid"));
        let mut a = SparseMatrix::zeros(pattern.clone());
        for scale in [1.0, 3.0] {
            a.clear();
            a.add_block(&[0, 1], &[scale, -scale, -scale, scale]).expect("in pattern");
            a.add_block(&[2, 1], &[scale, -scale, -scale, scale]).expect("in pattern");
            assert_eq!(a.diagonal(), [scale, 2.0 * scale, scale]);
            assert_eq!(a.get(1, 2), -scale);
        }
        assert!(Arc::ptr_eq(a.pattern(), &pattern));
        assert_eq!(a.add(0, 2, 1.0), Err(SparseError::NotInPattern { row: 0, column: 2 }));
    }
}
