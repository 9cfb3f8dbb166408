//! Inverses and Schur complements of dense symmetric matrices of some tens of rows.
//!
//! A group of unknowns `K` changes places with its equations: with `P = A_KK` the matrix becomes `-P^-1` there,
//! `A_iK P^-1` beside it and `A_ij - A_iK P^-1 A_Kj` elsewhere, and stays symmetric (Goodnight 1979,
//! 10.2307/2683825). After all unknowns have gone it is `-A^-1`. If only the first ones go, what is left of the others is
//! their Schur complement.
//!
//! The loops are compiled for the widest vectors the processor has. None of the variants rounds differently.

use crate::BlockError;

/// Numbers in a vector.
const LANES: usize = 8;
/// Unknowns that are exchanged at once.
const GROUP: usize = 4;

type Vector = [f64; LANES];

/// A dense symmetric matrix, of which the lower triangle counts.
#[derive(Clone, Debug, Default)]
pub struct DenseSymmetric {
    dim: usize,
    /// Vectors in a row.
    width: usize,
    /// Row by row.
    values: Vec<Vector>,
    /// The rows `A_K` of the group that is exchanged, one after the other.
    group: Vec<Vector>,
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
        (self.dim, self.width) = (dim, dim.div_ceil(LANES));
        self.values.clear();
        self.values.resize(dim * self.width, [0.0; LANES]);
        self.group.resize(GROUP * self.width, [0.0; LANES]);
    }

    /// Number of rows.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// A row up to and with the diagonal.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.width..].as_flattened()[..=row]
    }

    /// A whole row; what stands behind the diagonal is ignored.
    pub fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[row * self.width..].as_flattened_mut()[..self.dim]
    }

    /// Replaces a positive definite matrix by the negative of its inverse.
    pub fn invert_to_negative(&mut self) -> Result<(), BlockError> {
        self.dispatch::<true>(self.dim)
    }

    /// Replaces the part of the matrix beyond the first `count` unknowns, on which it is positive definite, by the Schur
    /// complement; the rest is lost.
    pub fn eliminate(&mut self, count: usize) -> Result<(), BlockError> {
        self.dispatch::<false>(count)
    }

    fn dispatch<const BACKWARD: bool>(&mut self, count: usize) -> Result<(), BlockError> {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                // SAFETY: the instructions the function is compiled for were detected just above; its code is the safe
                // `exchange`, with which the test `wide_and_portable_loops_agree` compares it.
                return unsafe { exchange_avx512::<BACKWARD>(self, count) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: as above.
                return unsafe { exchange_avx2::<BACKWARD>(self, count) };
            }
        }
        self.exchange::<BACKWARD>(count)
    }

    /// Exchanges the first `count` unknowns. Unless `BACKWARD`, what becomes of those that have gone is not computed.
    #[inline(always)]
    fn exchange<const BACKWARD: bool>(&mut self, count: usize) -> Result<(), BlockError> {
        for first in (0..count).step_by(GROUP) {
            let size = GROUP.min(count - first);
            let inverse = self.invert_pivots(first, size)?;
            self.gather(first, size);
            let group = first..first + size;
            let start = if BACKWARD { 0 } else { group.end };
            for row in (start..self.dim).filter(|row| !group.contains(row)) {
                let factors = self.factors(row, &inverse);
                self.subtract(row, if BACKWARD { 0 } else { start / LANES }, &factors);
                if BACKWARD {
                    self.write_beside(row, first, &factors[..size]);
                }
            }
            if BACKWARD {
                for (i, row) in inverse[..size].iter().enumerate() {
                    self.write_beside(first + i, first, &row.map(|p| -p)[..=i]);
                }
            }
        }
        Ok(())
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
        let (stride, dim) = (self.width * LANES, self.dim);
        let values = self.values.as_flattened();
        let group = self.group.as_flattened_mut();
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
        let group = self.group.as_flattened();
        let entries: [f64; GROUP] = std::array::from_fn(|k| group[k * self.width * LANES + row]);
        std::array::from_fn(|k| {
            let [a, b, c, d] = std::array::from_fn(|l| entries[l] * inverse[l][k]);
            (a + b) + (c + d)
        })
    }

    /// Subtracts the multiples `factors` of the rows of the group, from the vector `start` of the row on.
    #[inline(always)]
    fn subtract(&mut self, row: usize, start: usize, factors: &[f64; GROUP]) {
        let end = row / LANES + 1;
        let target = &mut self.values[row * self.width..][start..end];
        let [a, b, c, d]: [&[Vector]; GROUP] =
            std::array::from_fn(|k| &self.group[k * self.width..][start..end]);
        for (target, ((a, b), (c, d))) in target.iter_mut().zip(a.iter().zip(b).zip(c.iter().zip(d))) {
            for l in 0..LANES {
                let sum = (factors[0] * a[l] + factors[1] * b[l]) + (factors[2] * c[l] + factors[3] * d[l]);
                target[l] -= sum;
            }
        }
    }

    /// Writes entries of a row in the columns from `first` on.
    #[inline(always)]
    fn write_beside(&mut self, row: usize, first: usize, entries: &[f64]) {
        let stride = self.width * LANES;
        let values = self.values.as_flattened_mut();
        for (column, &entry) in (first..).zip(entries) {
            values[row.max(column) * stride + row.min(column)] = entry;
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn exchange_avx512<const BACKWARD: bool>(
    matrix: &mut DenseSymmetric,
    count: usize,
) -> Result<(), BlockError> {
    matrix.exchange::<BACKWARD>(count)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn exchange_avx2<const BACKWARD: bool>(matrix: &mut DenseSymmetric, count: usize) -> Result<(), BlockError> {
    matrix.exchange::<BACKWARD>(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector;

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
            inverse.invert_to_negative().expect("positive definite");
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
            inverse.invert_to_negative().expect("positive definite");
            for i in count..dim {
                for j in count..dim {
                    let product: f64 = (count..dim).map(|k| -at(&schur, i, k) * at(&inverse, k, j)).sum();
                    let expected = if i == j { 1.0 } else { 0.0 };
                    assert!((product - expected).abs() < 1e-10, "{dim}, {count}: {i} {j} {product}");
                }
            }
        }
    }

    #[test]
    fn wide_and_portable_loops_agree() {
        for dim in [5, 27, 81] {
            let (matrix, _) = random(dim);
            let run = |exchange: &dyn Fn(&mut DenseSymmetric) -> Result<(), BlockError>| {
                let mut matrix = matrix.clone();
                exchange(&mut matrix).expect("positive definite");
                matrix.values
            };
            assert_eq!(run(&|m| m.invert_to_negative()), run(&|m| m.exchange::<true>(dim)));
            assert_eq!(run(&|m| m.eliminate(dim - 2)), run(&|m| m.exchange::<false>(dim - 2)));
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut matrix = DenseSymmetric::zeros(2);
        matrix.row_mut(0)[0] = 1.0;
        matrix.row_mut(1).copy_from_slice(&[2.0, 1.0]);
        let refused = BlockError::NotPositiveDefinite { pivot: 1, value: -3.0 };
        assert_eq!(matrix.invert_to_negative(), Err(refused));
    }
}
