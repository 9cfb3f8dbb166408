//! Sparse matrices for products only, in slices of rows (SELL: Kreutzer, Hager, Wellein, Fehske and Bishop
//! 2014, 10.1137/130930352).
//!
//! The rows of a slice lie side by side, filled up to the longest with zeros: their products do not wait for
//! one another, as those of one short row do.

use super::{Pattern, SparseMatrix};
use crate::operator::LinOp;
use crate::parallel;
use crate::scalar::Scalar;

/// Rows of a slice.
const ROWS: usize = 16;

/// A square sparse matrix in slices of rows.
#[derive(Clone, Debug)]
pub struct SellMatrix<T> {
    dim: usize,
    /// First entries of each slice, in units of [`ROWS`] entries; one more for the end.
    first: Vec<u32>,
    columns: Vec<[u32; ROWS]>,
    values: Vec<[T; ROWS]>,
}

impl<T: Scalar> SellMatrix<T> {
    /// The entries of a square `matrix`, rounded to the precision of this one.
    pub fn new<S: Scalar>(matrix: &SparseMatrix<S>) -> Self {
        let pattern = matrix.pattern();
        let dim = pattern.row_count();
        debug_assert_eq!(dim, pattern.column_count());
        let mut new = Self { dim, first: vec![0], columns: Vec::new(), values: Vec::new() };
        for slice in 0..dim.div_ceil(ROWS) {
            new.push_slice(slice * ROWS, pattern, matrix.values());
        }
        new
    }

    fn push_slice<S: Scalar>(&mut self, first_row: usize, pattern: &Pattern, values: &[S]) {
        let row_count = ROWS.min(self.dim - first_row);
        let length = |row: usize| pattern.range(first_row + row).len();
        let width = (0..row_count).map(length).max().unwrap_or(0);
        for k in 0..width {
            // What fills up a row is a zero on the diagonal, or in the first column after the last row.
            let mut columns: [u32; ROWS] =
                std::array::from_fn(|row| if row < row_count { (first_row + row) as u32 } else { 0 });
            let mut entries = [T::ZERO; ROWS];
            for row in (0..row_count).filter(|&row| k < length(row)) {
                let entry = pattern.range(first_row + row).start + k;
                columns[row] = pattern.columns_of(first_row + row)[k];
                entries[row] = T::from_f64(values[entry].to_f64());
            }
            self.columns.push(columns);
            self.values.push(entries);
        }
        self.first.push(self.columns.len() as u32);
    }

    /// Products of the rows of a slice, with zeros after the last row.
    #[inline(always)]
    fn slice_product(&self, slice: usize, x: &[T]) -> [T; ROWS] {
        let range = self.first[slice] as usize..self.first[slice + 1] as usize;
        let mut sums = [T::ZERO; ROWS];
        for (columns, values) in self.columns[range.clone()].iter().zip(&self.values[range]) {
            let gathered: [T; ROWS] = std::array::from_fn(|row| x[columns[row] as usize]);
            for row in 0..ROWS {
                sums[row] += values[row] * gathered[row];
            }
        }
        sums
    }
}

impl<T: Scalar> LinOp<T> for SellMatrix<T> {
    fn dim(&self) -> usize {
        self.dim
    }

    fn apply(&mut self, x: &[T], y: &mut [T]) {
        let x = &x[..self.dim];
        parallel::for_each(y, |first, y| {
            // Pieces of vectors begin with slices.
            for (k, y) in y.chunks_mut(ROWS).enumerate() {
                y.copy_from_slice(&self.slice_product(first / ROWS + k, x)[..y.len()]);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_multiply_as_rows_do() {
        for dim in [1, 15, 16, 100, 40_001] {
            let entry = |row: usize, k: usize| (row, (row + k * k * 7) % dim, ((row + k) as f64).sin());
            let entries: Vec<_> = (0..dim).flat_map(|row| (0..row % 5).map(move |k| entry(row, k))).collect();
            let matrix = SparseMatrix::from_triplets(dim, dim, &entries).expect("in range");
            let x: Vec<f64> = (0..dim).map(|i| (0.3 * i as f64).cos()).collect();
            let (mut want, mut got) = (vec![0.0; dim], vec![f64::NAN; dim]);
            matrix.multiply(&x, &mut want);
            let mut sliced = SellMatrix::<f64>::new(&matrix);
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                pool.install(|| sliced.apply(&x, &mut got));
                assert!(got.iter().zip(&want).all(|(a, b)| (a - b).abs() < 1e-14));
            }
        }
    }
}
