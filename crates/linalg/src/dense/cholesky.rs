//! Inverses of small dense positive definite matrices, stored row by row, by their Cholesky factors.

use crate::scalar::Scalar;

/// Reason why a dense block has no inverse.
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
        }
    }

    #[test]
    fn bad_blocks_are_refused() {
        let indefinite = BlockError::NotPositiveDefinite { pivot: 1, value: -3.0 };
        assert_eq!(invert_spd(2, &mut [1.0, 2.0, 2.0, 1.0]), Err(indefinite));
        assert!(invert_spd(1, &mut [f64::NAN]).is_err());
    }
}
