//! Inverses and Schur complements of dense symmetric matrices of some tens of rows.
//!
//! The sweep operator: a group of unknowns `K` changes places with its equations: with `P = A_KK` the matrix
//! becomes `-P^-1` there, `A_iK P^-1` beside it and `A_ij - A_iK P^-1 A_Kj` elsewhere, and stays symmetric
//! (Goodnight 1979, 10.2307/2683825). After all unknowns have gone it is `-A^-1`. If only the first ones go,
//! what is left of the others is their Schur complement.
//!
//! The loops are compiled for the vectors the processor has; where it fuses products and sums, they are
//! fused.

use faer::traits::pulp::{Arch, Simd, WithSimd};

use super::cholesky::BlockError;

/// Rows are padded to a multiple of this, which is one of the numbers in a vector.
const LANES: usize = 8;
/// Unknowns that are swept at once.
const GROUP: usize = 4;

/// A dense symmetric matrix, of which the lower triangle counts.
#[derive(Clone, Debug, Default)]
pub struct DenseSymmetric {
    dim: usize,
    /// Numbers in a padded row.
    stride: usize,
    /// Row by row.
    values: Vec<f64>,
    /// The rows `A_K` of the group that is swept, one after the other.
    group: Vec<f64>,
}

impl DenseSymmetric {
    /// A zero matrix, in memory that [`DenseSymmetric::reset`] reuses.
    pub fn zeros(dim: usize) -> Self {
        let mut new = Self::default();
        new.reset(dim);
        new
    }

    /// Makes it a zero matrix of `dim` rows.
    pub fn reset(&mut self, dim: usize) {
        (self.dim, self.stride) = (dim, dim.next_multiple_of(LANES));
        self.values.clear();
        self.values.resize(dim * self.stride, 0.0);
        self.group.resize(GROUP * self.stride, 0.0);
    }

    /// Number of rows.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// A row up to and with the diagonal.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.stride..][..=row]
    }

    /// A whole row; what stands behind the diagonal is ignored.
    pub fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[row * self.stride..][..self.dim]
    }

    /// Sweeps all unknowns: replaces a positive definite matrix by the negative of its inverse.
    pub fn sweep(&mut self) -> Result<(), BlockError> {
        let count = self.dim;
        Arch::new().dispatch(Sweep::<true> { matrix: self, count })
    }

    /// Sweeps the first unknowns only: replaces the part of the matrix beyond the first `count` unknowns, on
    /// which it is positive definite, by the Schur complement. The rest becomes the factors of
    /// [`DenseSymmetric::solve`].
    pub fn eliminate(&mut self, count: usize) -> Result<(), BlockError> {
        Arch::new().dispatch(Sweep::<false> { matrix: self, count })
    }

    /// `x <- A^-1 x` for a matrix whose unknowns have all been eliminated, and `R` vectors side by side.
    ///
    /// With the groups `K` on the diagonal of `D`, `A = L D L^T`: `L` is one on the diagonal.
    pub fn solve<const R: usize>(&self, x: &mut [[f64; R]]) {
        Arch::new().dispatch(Solve { matrix: self, x });
    }

    /// `y = A x` by the lower triangle.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        Arch::new().dispatch(Multiply { matrix: self, x, y });
    }

    /// `P^-1` for the group of `size` unknowns from `first` on, with zeros around it.
    #[inline(always)]
    fn invert_pivots(&self, first: usize, size: usize) -> Result<[[f64; GROUP]; GROUP], BlockError> {
        let mut p = [[0.0; GROUP]; GROUP];
        for i in 0..size {
            p[i][..=i].copy_from_slice(&self.row(first + i)[first..]);
            (0..i).for_each(|j| p[j][i] = p[i][j]);
        }
        for k in 0..size {
            let (pivot, row) = (p[k][k], p[k]);
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err(BlockError::NotPositiveDefinite { pivot: first + k, value: pivot });
            }
            for i in (0..size).filter(|&i| i != k) {
                let factor = row[i] / pivot;
                (0..size).for_each(|j| p[i][j] -= factor * row[j]);
                (p[i][k], p[k][i]) = (factor, factor);
            }
            p[k][k] = -1.0 / pivot;
        }
        Ok(p.map(|row| row.map(|value| -value)))
    }

    /// Takes the rows of the group out of the lower triangle.
    #[inline(always)]
    fn gather(&mut self, first: usize, size: usize) {
        let Self { dim, stride, ref values, ref mut group } = *self;
        group[size * stride..].fill(0.0);
        for k in 0..size {
            let (row, pivot) = (&mut group[k * stride..][..stride], first + k);
            row[..=pivot].copy_from_slice(&values[pivot * stride..][..=pivot]);
            (pivot + 1..dim).for_each(|i| row[i] = values[i * stride + pivot]);
        }
    }

    /// `A_iK P^-1`.
    #[inline(always)]
    fn factors(&self, row: usize, inverse: &[[f64; GROUP]; GROUP]) -> [f64; GROUP] {
        let entries: [f64; GROUP] = std::array::from_fn(|k| self.group[k * self.stride + row]);
        std::array::from_fn(|k| {
            let [a, b, c, d] = std::array::from_fn(|l| entries[l] * inverse[l][k]);
            (a + b) + (c + d)
        })
    }

    /// Subtracts the multiples `factors` of the rows of the group, in the columns from `start` on, which is a
    /// multiple of [`LANES`].
    #[inline(always)]
    fn subtract<S: Simd>(&mut self, simd: S, row: usize, start: usize, factors: &[f64; GROUP]) {
        let columns = start..(row + 1).next_multiple_of(LANES);
        let (target, _) = S::as_mut_simd_f64s(&mut self.values[row * self.stride..][columns.clone()]);
        let group = |k: usize| S::as_simd_f64s(&self.group[k * self.stride..][columns.clone()]).0.iter();
        let group = group(0).zip(group(1)).zip(group(2).zip(group(3)));
        let [fa, fb, fc, fd] = factors.map(|factor| simd.splat_f64s(-factor));
        for (target, ((a, b), (c, d))) in target.iter_mut().zip(group) {
            let first = simd.mul_add_e_f64s(fb, *b, simd.mul_add_e_f64s(fa, *a, *target));
            *target = simd.mul_add_e_f64s(fd, *d, simd.mul_add_e_f64s(fc, *c, first));
        }
    }

    /// Writes entries of a row in the columns from `first` on.
    #[inline(always)]
    fn write_beside(&mut self, row: usize, first: usize, entries: &[f64]) {
        for (column, &entry) in (first..).zip(entries) {
            self.values[row.max(column) * self.stride + row.min(column)] = entry;
        }
    }
}

/// Sweeps the first `count` unknowns. Unless `BACKWARD`, those that have gone keep the factors with which
/// they went: in the rows of a group `P^-1`, in the rows behind it `A_iK P^-1`.
struct Sweep<'a, const BACKWARD: bool> {
    matrix: &'a mut DenseSymmetric,
    count: usize,
}

impl<const BACKWARD: bool> WithSimd for Sweep<'_, BACKWARD> {
    type Output = Result<(), BlockError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { matrix, count } = self;
        for first in (0..count).step_by(GROUP) {
            let size = GROUP.min(count - first);
            let inverse = matrix.invert_pivots(first, size)?;
            matrix.gather(first, size);
            let group = first..first + size;
            let start = if BACKWARD { 0 } else { group.end };
            for row in (start..matrix.dim).filter(|row| !group.contains(row)) {
                let factors = matrix.factors(row, &inverse);
                matrix.subtract(simd, row, start / LANES * LANES, &factors);
                matrix.write_beside(row, first, &factors[..size]);
            }
            let sign = if BACKWARD { -1.0 } else { 1.0 };
            for (i, row) in inverse[..size].iter().enumerate() {
                matrix.write_beside(first + i, first, &row.map(|p| sign * p)[..=i]);
            }
        }
        Ok(())
    }
}

/// See [`DenseSymmetric::solve`].
struct Solve<'a, const R: usize> {
    matrix: &'a DenseSymmetric,
    x: &'a mut [[f64; R]],
}

impl<const R: usize> WithSimd for Solve<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { matrix, x } = self;
        let group_of = |row: usize| row / GROUP * GROUP;
        for row in GROUP..matrix.dim {
            let (before, rest) = x.split_at_mut(group_of(row));
            let sum = sum_of_products(&matrix.row(row)[..before.len()], before);
            (0..R).for_each(|l| rest[row % GROUP][l] -= sum[l]);
        }
        for (k, group) in x.chunks_mut(GROUP).enumerate() {
            let old: [[f64; R]; GROUP] = std::array::from_fn(|i| group.get(i).copied().unwrap_or([0.0; R]));
            for i in 0..group.len() {
                group[i] = [0.0; R];
                for (j, old) in old[..group.len()].iter().enumerate() {
                    let factor = matrix.row(k * GROUP + i.max(j))[k * GROUP + i.min(j)];
                    (0..R).for_each(|l| group[i][l] += factor * old[l]);
                }
            }
        }
        for first in (GROUP..matrix.dim).step_by(GROUP).rev() {
            let (before, group) = x.split_at_mut(first);
            // Rows that a short group lacks count zero times.
            let own: [[f64; R]; GROUP] = std::array::from_fn(|i| group.get(i).copied().unwrap_or([0.0; R]));
            let row = |i: usize| &matrix.row((first + i).min(matrix.dim - 1))[..first];
            let rows = row(0).iter().zip(row(1)).zip(row(2).iter().zip(row(3)));
            for (x, ((a, b), (c, d))) in before.iter_mut().zip(rows) {
                (0..R).for_each(|l| {
                    x[l] -= (a * own[0][l] + b * own[1][l]) + (c * own[2][l] + d * own[3][l]);
                });
            }
        }
    }
}

/// See [`DenseSymmetric::multiply`].
struct Multiply<'a> {
    matrix: &'a DenseSymmetric,
    x: &'a [f64],
    y: &'a mut [f64],
}

impl WithSimd for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { matrix, x, y } = self;
        for first in (0..matrix.dim).step_by(GROUP) {
            let ((before, own), (y, images)) = (x.split_at(first), y.split_at_mut(first));
            let size = GROUP.min(own.len());
            // Rows that a short group lacks count zero times.
            let rows = std::array::from_fn(|k| &matrix.row((first + k).min(matrix.dim - 1))[..first]);
            let factors = std::array::from_fn(|k| own.get(k).copied().unwrap_or(0.0));
            let sums = multiply_rows(simd, rows, factors, before, y);
            for (k, image) in images[..size].iter_mut().enumerate() {
                let entry = |l: usize| matrix.row(first + k.max(l))[first + k.min(l)];
                *image = sums[k] + (0..size).map(|l| entry(l) * own[l]).sum::<f64>();
            }
        }
    }
}

/// `y += A^T factors` for the rows `A`, and `A x`.
#[inline(always)]
fn multiply_rows<S: Simd>(
    simd: S,
    rows: [&[f64]; GROUP],
    factors: [f64; GROUP],
    x: &[f64],
    y: &mut [f64],
) -> [f64; GROUP] {
    let (x_full, x_rest) = S::as_simd_f64s(x);
    let (y_full, y_rest) = S::as_mut_simd_f64s(y);
    let [a, b, c, d] = rows.map(|row| S::as_simd_f64s(row).0.iter());
    let [fa, fb, fc, fd] = factors.map(|factor| simd.splat_f64s(factor));
    let mut sums = [simd.splat_f64s(0.0); GROUP];
    for ((x, y), ((a, b), (c, d))) in x_full.iter().zip(y_full).zip(a.zip(b).zip(c.zip(d))) {
        let first = simd.mul_add_e_f64s(fb, *b, simd.mul_add_e_f64s(fa, *a, *y));
        *y = simd.mul_add_e_f64s(fd, *d, simd.mul_add_e_f64s(fc, *c, first));
        for (sum, row) in sums.iter_mut().zip([a, b, c, d]) {
            *sum = simd.mul_add_e_f64s(*row, *x, *sum);
        }
    }
    let mut sums = sums.map(|sum| simd.reduce_sum_f64s(sum));
    let full = x.len() - x_rest.len();
    for (j, (x, y)) in (full..).zip(x_rest.iter().zip(y_rest)) {
        for k in 0..GROUP {
            *y += factors[k] * rows[k][j];
            sums[k] += rows[k][j] * x;
        }
    }
    sums
}

/// `sum_k a_k x_k`, in as many partial sums as fill vectors.
#[inline(always)]
fn sum_of_products<const R: usize>(a: &[f64], x: &[[f64; R]]) -> [f64; R] {
    if R >= LANES {
        let mut sum = [0.0; R];
        for (a, x) in a.iter().zip(x) {
            (0..R).for_each(|l| sum[l] += a * x[l]);
        }
        return sum;
    }
    let mut parts = [[0.0; R]; LANES];
    let ((a_full, a_rest), (x_full, x_rest)) = (a.as_chunks::<LANES>(), x.as_chunks::<LANES>());
    for (a, x) in a_full.iter().zip(x_full) {
        for k in 0..LANES {
            (0..R).for_each(|l| parts[k][l] += a[k] * x[k][l]);
        }
    }
    for ((a, x), part) in a_rest.iter().zip(x_rest).zip(&mut parts) {
        (0..R).for_each(|l| part[l] += a * x[l]);
    }
    std::array::from_fn(|l| {
        let pair = |k: usize| parts[k][l] + parts[k + 4][l];
        (pair(0) + pair(2)) + (pair(1) + pair(3))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector;
    use faer::traits::pulp::Scalar;

    /// A random positive definite matrix, and its entries.
    fn random(dim: usize) -> (DenseSymmetric, Vec<f64>) {
        let mut g = vec![0.0; dim * dim];
        vector::fill_pseudo_random(dim as u64, &mut g);
        let product = |i: usize, j: usize| -> f64 { (0..dim).map(|k| g[i * dim + k] * g[j * dim + k]).sum() };
        let entry = |k: usize| product(k / dim, k % dim) + if k / dim == k % dim { 0.3 } else { 0.0 };
        let entries: Vec<f64> = (0..dim * dim).map(entry).collect();
        let mut matrix = DenseSymmetric::zeros(dim);
        for i in 0..dim {
            matrix.row_mut(i)[..=i].copy_from_slice(&entries[i * dim..=i * dim + i]);
        }
        (matrix, entries)
    }

    fn at(matrix: &DenseSymmetric, i: usize, j: usize) -> f64 {
        matrix.row(i.max(j))[i.min(j)]
    }

    #[test]
    fn the_inverse_times_the_matrix_is_one() {
        for dim in 1..40 {
            let (mut inverse, a) = random(dim);
            inverse.sweep().expect("positive definite");
            for i in 0..dim {
                for j in 0..dim {
                    let product: f64 = (0..dim).map(|k| -at(&inverse, i, k) * a[k * dim + j]).sum();
                    let expected = if i == j { 1.0 } else { 0.0 };
                    assert!((product - expected).abs() < 1e-10, "{dim}: {i} {j} {product}");
                }
            }
        }
    }

    /// The inverse of the Schur complement is a block of the inverse.
    #[test]
    fn elimination_leaves_the_schur_complement() {
        for (dim, count) in [(3, 1), (9, 7), (30, 22), (31, 24)] {
            let (mut schur, _) = random(dim);
            let mut inverse = schur.clone();
            schur.eliminate(count).expect("positive definite");
            inverse.sweep().expect("positive definite");
            for i in count..dim {
                for j in count..dim {
                    let product: f64 = (count..dim).map(|k| -at(&schur, i, k) * at(&inverse, k, j)).sum();
                    let expected = if i == j { 1.0 } else { 0.0 };
                    assert!((product - expected).abs() < 1e-10, "{dim}, {count}: {i} {j} {product}");
                }
            }
        }
    }

    fn solves<const R: usize>(dim: usize) {
        let (mut factors, a) = random(dim);
        factors.eliminate(dim).expect("positive definite");
        let mut x: Vec<[f64; R]> =
            (0..dim).map(|i| std::array::from_fn(|l| ((i * R + l) as f64).sin())).collect();
        let b = x.clone();
        factors.solve(&mut x);
        for i in 0..dim {
            for l in 0..R {
                let product: f64 = (0..dim).map(|k| a[i * dim + k] * x[k][l]).sum();
                assert!((product - b[i][l]).abs() < 1e-9, "{dim}, {R}: {i} {l} {product} {}", b[i][l]);
            }
        }
    }

    #[test]
    fn what_is_left_of_an_elimination_solves() {
        for dim in [1, 3, 4, 5, 27, 31] {
            solves::<1>(dim);
            solves::<16>(dim);
        }
    }

    #[test]
    fn products_with_the_lower_triangle_are_those_with_the_matrix() {
        let (matrix, a) = random(29);
        let x: Vec<f64> = (0..29).map(|k| f64::from(k).sin()).collect();
        let mut y = x.clone();
        matrix.multiply(&x, &mut y);
        for (row, y) in a.chunks_exact(29).zip(&y) {
            let expected: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((y - expected).abs() < 1e-12, "{y} {expected}");
        }
    }

    #[test]
    fn plain_loops_give_the_same_to_rounding() {
        let (mut wide, _) = random(81);
        let mut plain = wide.clone();
        wide.eliminate(70).expect("positive definite");
        Sweep::<false> { matrix: &mut plain, count: 70 }.with_simd(Scalar).expect("positive definite");
        for (a, b) in (70..81).flat_map(|row| wide.row(row)[70..].iter().zip(&plain.row(row)[70..])) {
            assert!((a - b).abs() < 1e-12 * plain.row(70)[70], "{a} {b}");
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut matrix = DenseSymmetric::zeros(2);
        matrix.row_mut(0)[0] = 1.0;
        matrix.row_mut(1).copy_from_slice(&[2.0, 1.0]);
        let refused = BlockError::NotPositiveDefinite { pivot: 1, value: -3.0 };
        assert_eq!(matrix.sweep(), Err(refused));
    }
}
