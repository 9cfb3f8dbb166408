//! Sparse matrices for products only, in slices of rows (SELL: Kreutzer, Hager, Wellein, Fehske and Bishop
//! 2014, 10.1137/130930352).
//!
//! The rows of a slice lie side by side, filled up to the longest with zeros: their products do not wait for
//! one another, as those of one short row do.

use std::ops::Range;

use rayon::prelude::*;

use super::SparseMatrix;
use crate::operator::LinOp;
use crate::scalar::Scalar;

/// Rows of a slice.
const ROWS: usize = 16;
/// Slices that a thread multiplies at a time.
const SLICES: usize = 64;

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
        let slice = |k: usize| k * ROWS..((k + 1) * ROWS).min(dim);
        let width = |k: usize| slice(k).map(|row| pattern.range(row).len()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..dim.div_ceil(ROWS)).into_par_iter().map(width).collect();
        let mut first = Vec::with_capacity(widths.len() + 1);
        first.push(0);
        first.extend(widths.iter().scan(0, |end, width| {
            *end += *width as u32;
            Some(*end)
        }));
        let count = first.last().map_or(0, |&end| end as usize);
        let mut new =
            Self { dim, first, columns: vec![[0; ROWS]; count], values: vec![[T::ZERO; ROWS]; count] };
        let (mut columns, mut values) = (&mut new.columns[..], &mut new.values[..]);
        let mut slices = Vec::with_capacity(widths.len());
        for (k, &width) in widths.iter().enumerate() {
            let (of_columns, of_values) = (columns.split_off_mut(..width), values.split_off_mut(..width));
            slices.push((slice(k), of_columns.unwrap_or_default(), of_values.unwrap_or_default()));
        }
        slices.into_par_iter().for_each(|(rows, columns, values)| {
            fill_slice(rows, matrix, columns, values);
        });
        new
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

/// Fills a slice, which is as wide as its longest row. What fills up a row is a zero on the diagonal, or in
/// the first column after the last row.
fn fill_slice<T: Scalar, S: Scalar>(
    rows: Range<usize>,
    matrix: &SparseMatrix<S>,
    columns: &mut [[u32; ROWS]],
    values: &mut [[T; ROWS]],
) {
    for (place, row) in rows.enumerate() {
        let range = matrix.pattern().range(row);
        let entries = matrix.pattern().columns_of(row).iter().zip(&matrix.values()[range.clone()]);
        for ((&column, value), (columns, values)) in entries.zip(columns.iter_mut().zip(values.iter_mut())) {
            columns[place] = column;
            values[place] = T::from_f64(value.to_f64());
        }
        columns[range.len()..].iter_mut().for_each(|columns| columns[place] = row as u32);
    }
}

impl<T: Scalar> LinOp<T> for SellMatrix<T> {
    fn dim(&self) -> usize {
        self.dim
    }

    fn apply(&mut self, x: &[T], y: &mut [T]) {
        let x = &x[..self.dim];
        let rows = |(piece, y): (usize, &mut [T])| {
            for (k, y) in y.chunks_mut(ROWS).enumerate() {
                y.copy_from_slice(&self.slice_product(piece * SLICES + k, x)[..y.len()]);
            }
        };
        y.par_chunks_mut(SLICES * ROWS).enumerate().for_each(rows);
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
