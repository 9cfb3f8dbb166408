//! Small dense matrices, stored row by row, and the block-Jacobi preconditioner made of their inverses.

use crate::operator::Preconditioner;
use crate::scalar::Scalar;

/// Why a dense block has no inverse.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BlockError {
    /// A Cholesky pivot is not positive, or not a number.
    #[error("the block is not positive definite: pivot {pivot} is {value:e}")]
    NotPositiveDefinite {
        /// Row of the pivot.
        pivot: usize,
        /// Its value.
        value: f64,
    },
    /// All candidates for a pivot are zero, or not numbers.
    #[error("the block is singular: no pivot in column {pivot}")]
    Singular {
        /// Column in which no pivot was found.
        pivot: usize,
    },
}

/// Why a block-Jacobi preconditioner was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BlockJacobiError {
    /// A block does not have the size of its list of unknowns, or names one outside the vector.
    #[error("block {block} does not fit its unknowns")]
    WrongShape {
        /// Index of the block.
        block: usize,
    },
    /// A block has no inverse.
    #[error("block {block}: {source}")]
    NoInverse {
        /// Index of the block.
        block: usize,
        /// Why.
        source: BlockError,
    },
}

/// Replaces the lower triangle by that of the Cholesky factor.
fn factorise_cholesky<T: Scalar>(dim: usize, a: &mut [T]) -> Result<(), BlockError> {
    for i in 0..dim {
        let (above, row) = a.split_at_mut(i * dim);
        for j in 0..i {
            let partner = &above[j * dim..=j * dim + j];
            row[j] = (row[j] - inner(&row[..j], &partner[..j])) / partner[j];
        }
        let pivot = row[i] - inner(&row[..i], &row[..i]);
        if !(pivot > T::ZERO && pivot.is_finite()) {
            return Err(BlockError::NotPositiveDefinite { pivot: i, value: pivot.to_f64() });
        }
        row[i] = pivot.sqrt();
    }
    Ok(())
}

fn inner<T: Scalar>(x: &[T], y: &[T]) -> T {
    x.iter().zip(y).fold(T::ZERO, |sum, (&x, &y)| sum + x * y)
}

/// Replaces a symmetric positive definite matrix by its inverse; only the lower triangle is read.
pub fn invert_spd<T: Scalar>(dim: usize, a: &mut [T]) -> Result<(), BlockError> {
    factorise_cholesky(dim, a)?;
    invert_lower(dim, a);
    // A^-1 = L^-T L^-1, entry by entry from the top: row i of the result needs rows >= i of L^-1 only.
    for i in 0..dim {
        for j in 0..=i {
            let mut sum = T::ZERO;
            for k in i..dim {
                sum += a[k * dim + i] * a[k * dim + j];
            }
            a[i * dim + j] = sum;
        }
    }
    for i in 0..dim {
        for j in i + 1..dim {
            a[i * dim + j] = a[j * dim + i];
        }
    }
    Ok(())
}

/// Replaces a lower triangular matrix by its inverse.
fn invert_lower<T: Scalar>(dim: usize, l: &mut [T]) {
    for j in 0..dim {
        l[j * dim + j] = T::ONE / l[j * dim + j];
        for i in j + 1..dim {
            let mut sum = T::ZERO;
            for k in j..i {
                sum += l[i * dim + k] * l[k * dim + j];
            }
            l[i * dim + j] = -sum / l[i * dim + i];
        }
    }
}

/// Replaces a matrix by its inverse (Gauss and Jordan, with column pivoting in `pivots`, a workspace of `dim` numbers).
pub fn invert_general<T: Scalar>(dim: usize, a: &mut [T], pivots: &mut [usize]) -> Result<(), BlockError> {
    for k in 0..dim {
        let pivot_row = largest_in_column(dim, a, k).ok_or(BlockError::Singular { pivot: k })?;
        pivots[k] = pivot_row;
        swap_rows(dim, a, k, pivot_row);
        eliminate(dim, a, k);
    }
    for k in (0..dim).rev() {
        for i in 0..dim {
            a.swap(i * dim + k, i * dim + pivots[k]);
        }
    }
    Ok(())
}

fn largest_in_column<T: Scalar>(dim: usize, a: &[T], k: usize) -> Option<usize> {
    let mut best = None;
    let mut size = T::ZERO;
    for i in k..dim {
        let candidate = a[i * dim + k].abs();
        if candidate > size && candidate.is_finite() {
            (best, size) = (Some(i), candidate);
        }
    }
    best
}

fn swap_rows<T: Scalar>(dim: usize, a: &mut [T], i: usize, j: usize) {
    if i != j {
        for k in 0..dim {
            a.swap(i * dim + k, j * dim + k);
        }
    }
}

/// One step of Gauss and Jordan in place: exchanges unknown `k` with equation `k`.
fn eliminate<T: Scalar>(dim: usize, a: &mut [T], k: usize) {
    let inverse = T::ONE / a[k * dim + k];
    a[k * dim + k] = T::ONE;
    for j in 0..dim {
        a[k * dim + j] *= inverse;
    }
    for i in (0..dim).filter(|&i| i != k) {
        let factor = a[i * dim + k];
        a[i * dim + k] = T::ZERO;
        for j in 0..dim {
            let change = factor * a[k * dim + j];
            a[i * dim + j] -= change;
        }
    }
}

/// Block Jacobi: the inverse of a block-diagonal matrix with small blocks.
///
/// Unknowns in no block are passed through; where blocks overlap, their results are added (additive Schwarz).
#[derive(Clone, Debug)]
pub struct BlockJacobi<T> {
    dim: usize,
    block_start: Vec<usize>,
    unknowns: Vec<usize>,
    inverse_start: Vec<usize>,
    inverses: Vec<T>,
    /// Unknowns in no block.
    free: Vec<usize>,
}

impl<T: Scalar> BlockJacobi<T> {
    /// A preconditioner for vectors of length `dim` from symmetric positive definite blocks, given as pairs of unknowns
    /// and matrix.
    pub fn new_spd<'a>(
        dim: usize,
        blocks: impl IntoIterator<Item = (&'a [usize], &'a [T])>,
    ) -> Result<Self, BlockJacobiError> {
        Self::collect(dim, blocks, invert_spd)
    }

    /// The same for regular blocks of any kind.
    pub fn new_general<'a>(
        dim: usize,
        blocks: impl IntoIterator<Item = (&'a [usize], &'a [T])>,
    ) -> Result<Self, BlockJacobiError> {
        let mut pivots = Vec::new();
        Self::collect(dim, blocks, |size, a| {
            pivots.resize(size, 0);
            invert_general(size, a, &mut pivots)
        })
    }

    fn collect<'a>(
        dim: usize,
        blocks: impl IntoIterator<Item = (&'a [usize], &'a [T])>,
        mut invert: impl FnMut(usize, &mut [T]) -> Result<(), BlockError>,
    ) -> Result<Self, BlockJacobiError> {
        let mut jacobi = Self {
            dim,
            block_start: vec![0],
            unknowns: Vec::new(),
            inverse_start: vec![0],
            inverses: Vec::new(),
            free: Vec::new(),
        };
        let mut covered = vec![false; dim];
        for (block, (unknowns, matrix)) in blocks.into_iter().enumerate() {
            let size = unknowns.len();
            if matrix.len() != size * size || unknowns.iter().any(|&unknown| unknown >= dim) {
                return Err(BlockJacobiError::WrongShape { block });
            }
            unknowns.iter().for_each(|&unknown| covered[unknown] = true);
            let begin = jacobi.inverses.len();
            jacobi.inverses.extend_from_slice(matrix);
            invert(size, &mut jacobi.inverses[begin..])
                .map_err(|source| BlockJacobiError::NoInverse { block, source })?;
            jacobi.unknowns.extend_from_slice(unknowns);
            jacobi.block_start.push(jacobi.unknowns.len());
            jacobi.inverse_start.push(jacobi.inverses.len());
        }
        jacobi.free = (0..dim).filter(|&unknown| !covered[unknown]).collect();
        Ok(jacobi)
    }

    /// Length of the vectors.
    pub fn dim(&self) -> usize {
        self.dim
    }
}

impl<T: Scalar> Preconditioner<T> for BlockJacobi<T> {
    fn apply(&mut self, r: &[T], z: &mut [T]) {
        z.fill(T::ZERO);
        for &unknown in &self.free {
            z[unknown] = r[unknown];
        }
        for (block, bounds) in self.block_start.windows(2).enumerate() {
            let unknowns = &self.unknowns[bounds[0]..bounds[1]];
            let inverse = &self.inverses[self.inverse_start[block]..self.inverse_start[block + 1]];
            for (&row, entries) in unknowns.iter().zip(inverse.chunks_exact(unknowns.len())) {
                let product = unknowns.iter().zip(entries).fold(T::ZERO, |sum, (&c, &v)| sum + v * r[c]);
                z[row] += product;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector;

    fn random_spd(dim: usize, seed: u64) -> Vec<f64> {
        let mut g = vec![0.0; dim * dim];
        vector::fill_pseudo_random(seed, &mut g);
        let entry = |i: usize, j: usize| inner(&g[i * dim..(i + 1) * dim], &g[j * dim..(j + 1) * dim]);
        (0..dim * dim).map(|k| entry(k / dim, k % dim) + if k / dim == k % dim { 0.1 } else { 0.0 }).collect()
    }

    fn distance_from_identity(dim: usize, a: &[f64], b: &[f64]) -> f64 {
        let mut worst = 0.0f64;
        for i in 0..dim {
            for j in 0..dim {
                let product: f64 = (0..dim).map(|k| a[i * dim + k] * b[k * dim + j]).sum();
                worst = worst.max((product - if i == j { 1.0 } else { 0.0 }).abs());
            }
        }
        worst
    }

    #[test]
    fn inverses_of_every_small_size() {
        for dim in 1..=6 {
            let a = random_spd(dim, dim as u64);
            let mut inverse = a.clone();
            invert_spd(dim, &mut inverse).expect("positive definite");
            assert!(distance_from_identity(dim, &a, &inverse) < 1e-11, "dim {dim}");
            let mut general = vec![0.0; dim * dim];
            vector::fill_pseudo_random(7 + dim as u64, &mut general);
            let mut inverse = general.clone();
            invert_general(dim, &mut inverse, &mut vec![0; dim]).expect("regular");
            assert!(distance_from_identity(dim, &general, &inverse) < 1e-11, "dim {dim}");
        }
    }

    #[test]
    fn pivoting_handles_a_zero_in_front() {
        let mut a = [0.0, 2.0, 4.0, 0.0];
        invert_general(2, &mut a, &mut [0; 2]).expect("regular");
        assert_eq!(a, [0.0, 0.25, 0.5, 0.0]);
    }

    #[test]
    fn bad_blocks_are_refused() {
        let singular = BlockError::Singular { pivot: 1 };
        assert_eq!(invert_general(2, &mut [1.0, 2.0, 2.0, 4.0], &mut [0; 2]), Err(singular));
        assert!(invert_general(1, &mut [f64::NAN], &mut [0]).is_err());
        let indefinite = BlockError::NotPositiveDefinite { pivot: 1, value: -3.0 };
        assert_eq!(invert_spd(2, &mut [1.0, 2.0, 2.0, 1.0]), Err(indefinite));
        assert!(invert_spd(1, &mut [f64::NAN]).is_err());
        let blocks = [(&[0usize, 1][..], &[1.0][..])];
        assert_eq!(
            BlockJacobi::new_spd(2, blocks).expect_err("shape"),
            BlockJacobiError::WrongShape { block: 0 }
        );
        let blocks = [(&[0usize][..], &[1.0][..]), (&[1usize][..], &[0.0][..])];
        assert!(matches!(
            BlockJacobi::new_general(2, blocks),
            Err(BlockJacobiError::NoInverse { block: 1, .. })
        ));
    }

    #[test]
    fn block_jacobi_inverts_its_blocks_and_passes_the_rest() {
        let blocks = [(&[3usize, 0][..], &[4.0, 0.0, 0.0, 16.0][..])];
        let mut m = BlockJacobi::new_spd(4, blocks).expect("valid");
        let mut z = [9.0; 4];
        m.apply(&[64.0, 1.0, 2.0, 8.0], &mut z);
        assert_eq!(z, [4.0, 1.0, 2.0, 2.0]);
    }
}
