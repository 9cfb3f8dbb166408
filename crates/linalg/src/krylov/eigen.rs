//! A few eigenvalues of dense symmetric matrices of some tens of rows.

use std::sync::LazyLock;

use super::lanczos::Tridiagonal;
use crate::dense::{BlockError, DenseSymmetric};

/// Lanczos steps for the largest eigenvalue, at most, and how many there are between two looks at it.
const STEPS: usize = 48;
const STEPS_AT_ONCE: usize = 4;
/// The eigenvalue has converged when it changes by no more than this share from one look to the next.
const TOLERANCE: f64 = 1e-7;
/// The start vector is used up where the next one is shorter than this share of the eigenvalue, which is
/// found to that share.
const USED_UP: f64 = 1e-5;
/// Vectors of the inverse iteration for the lowest modes, side by side.
const MODES: usize = 16;
/// Steps of that.
const INVERSE_STEPS: usize = 2;
/// Sweeps of Jacobi's method over what is left of the matrix on these vectors, which is nearly diagonal, and
/// the share of the diagonal below which an entry is let be.
const SWEEPS: usize = 6;
const NEGLIGIBLE: f64 = 1e-3;

/// The largest `x.A x / x.B x`, `B` being positive definite, to six digits, or five where the start vector
/// is used up: Lanczos' method for `B^-1 A` in the scalar product of `B` (Golub and Van Loan 2013, section
/// 10.1). Directions lose their orthogonality, which repeats eigenvalues and adds none. `B` multiplies every
/// vector: with products that follow the recurrence of the vectors, rounding in directions without energy
/// would pass for a ratio. `B` is overwritten.
///
/// # Errors
/// If `B` is not positive definite.
pub fn largest_ratio(above: &DenseSymmetric, below: &mut DenseSymmetric) -> Result<f64, BlockError> {
    let dim = above.dim();
    let metric = below.clone();
    below.eliminate(dim)?;
    let [mut vector, mut last, mut next, mut image, mut load] = [(); 5].map(|()| vec![0.0; dim]);
    let start: Vec<f64> = (0..dim).map(|k| (1.0 + k as f64).sin()).collect();
    above.multiply(&start, &mut vector);
    below.solve(vector.as_chunks_mut::<1>().0);
    let mut projected = Tridiagonal::default();
    let (mut largest, mut first) = (0.0, 0.0);
    for step in 1..=STEPS.min(dim) {
        metric.multiply(&vector, &mut image);
        let norm = inner(&vector, &image).max(0.0).sqrt();
        if norm <= USED_UP * first || !norm.is_normal() {
            break;
        }
        vector.iter_mut().for_each(|x| *x /= norm);
        above.multiply(&vector, &mut load);
        let value = inner(&vector, &load);
        let coupling = if step == 1 { 0.0 } else { norm };
        projected.push(value, coupling);
        first = f64::max(first, value);
        if step % STEPS_AT_ONCE == 0 {
            let now = projected.largest_eigenvalue();
            if now - largest <= TOLERANCE * now {
                return Ok(now);
            }
            largest = now;
        }
        next.copy_from_slice(&load);
        below.solve(next.as_chunks_mut::<1>().0);
        for ((next, own), before) in next.iter_mut().zip(&vector).zip(&last) {
            *next -= value * own + coupling * before;
        }
        std::mem::swap(&mut last, &mut vector);
        std::mem::swap(&mut vector, &mut next);
    }
    Ok(projected.largest_eigenvalue())
}

/// The modes of a positive definite matrix with eigenvalues below `bound`, lowest first, at most sixteen:
/// eigenvalues and vectors of length one. By inverse iteration: those next to the bound are rough. The matrix
/// is overwritten.
///
/// # Errors
/// If the matrix is not positive definite.
pub fn lowest_modes(matrix: &mut DenseSymmetric, bound: f64) -> Result<Vec<(f64, Vec<f64>)>, BlockError> {
    let dim = matrix.dim();
    matrix.eliminate(dim)?;
    let count = MODES.min(dim);
    let mut x: Vec<[f64; MODES]> = STARTS.iter().copied().take(dim).collect();
    x.extend((x.len()..dim).map(start));
    for _ in 0..INVERSE_STEPS {
        matrix.solve(&mut x);
        orthonormalise(&mut x, count);
    }
    let basis = x.clone();
    matrix.solve(&mut x);
    let mut inverse = [[0.0; MODES]; MODES];
    for (q, x) in basis.iter().zip(&x) {
        for (row, q) in inverse.iter_mut().zip(q) {
            row.iter_mut().zip(x).for_each(|(sum, x)| *sum += q * x);
        }
    }
    let rotation = diagonalise(&mut inverse, count, 0.5 / bound);
    let mut found: Vec<usize> = (0..count).filter(|&k| inverse[k][k] * bound > 1.0).collect();
    found.sort_by(|&a, &b| inverse[b][b].total_cmp(&inverse[a][a]));
    let mode = |k: usize| {
        let vector = basis.iter().map(|q| inner(q, &rotation[k])).collect();
        (1.0 / inverse[k][k], vector)
    };
    Ok(found.into_iter().map(mode).collect())
}

/// Rows of the vectors with which the iteration begins that are kept: a root and what it reaches have fewer.
const KEPT: usize = 512;
static STARTS: LazyLock<Vec<[f64; MODES]>> = LazyLock::new(|| (0..KEPT).map(start).collect());

/// A row of the vectors with which the iteration begins.
fn start(row: usize) -> [f64; MODES] {
    std::array::from_fn(|k| (1.0 + (row * MODES + k) as f64).powi(2).sin())
}

/// Makes the first `count` vectors orthonormal, one after another, and the others zero (Gram and Schmidt,
/// modified).
fn orthonormalise(x: &mut [[f64; MODES]], count: usize) {
    for k in 0..MODES {
        let mut products = [0.0; MODES];
        for x in x.iter() {
            let own = x[k];
            (0..MODES).for_each(|l| products[l] += own * x[l]);
        }
        let square = products[k];
        let scale = if k < count && square > 0.0 { 1.0 / square.sqrt() } else { 0.0 };
        let shares: [f64; MODES] =
            std::array::from_fn(|l| if l > k && scale > 0.0 { products[l] / square } else { 0.0 });
        for x in x.iter_mut() {
            let own = x[k];
            (0..MODES).for_each(|l| x[l] -= shares[l] * own);
            x[k] = scale * own;
        }
    }
}

/// Rotates the first `count` unknowns until the matrix is nearly diagonal there, but for unknowns both of
/// which are below `least` on the diagonal; the rows of the result are what they have become.
fn diagonalise(a: &mut [[f64; MODES]; MODES], count: usize, least: f64) -> [[f64; MODES]; MODES] {
    let mut rotation = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for _ in 0..SWEEPS {
        let mut is_diagonal = true;
        for (i, j) in (1..count).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let (entry, ends) = (0.5 * (a[i][j] + a[j][i]), [a[i][i], a[j][j]]);
            let is_small = entry.powi(2) <= NEGLIGIBLE.powi(2) * (ends[0] * ends[1]).abs();
            if is_small || ends[0].max(ends[1]) < least {
                continue;
            }
            is_diagonal = false;
            let ratio = (ends[1] - ends[0]) / (2.0 * entry);
            let tangent = ratio.signum() / (ratio.abs() + (1.0 + ratio * ratio).sqrt());
            let cos = 1.0 / (1.0 + tangent * tangent).sqrt();
            let sin = tangent * cos;
            rotate_rows(a, [i, j], [cos, sin]);
            for row in a.iter_mut() {
                (row[i], row[j]) = (cos * row[i] - sin * row[j], sin * row[i] + cos * row[j]);
            }
            rotate_rows(&mut rotation, [i, j], [cos, sin]);
        }
        if is_diagonal {
            break;
        }
    }
    rotation
}

fn rotate_rows(a: &mut [[f64; MODES]; MODES], [i, j]: [usize; 2], [cos, sin]: [f64; 2]) {
    let (x, y) = (a[i], a[j]);
    for l in 0..MODES {
        (a[i][l], a[j][l]) = (cos * x[l] - sin * y[l], sin * x[l] + cos * y[l]);
    }
}

fn inner(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `H diag(values) H` with the reflection `H = 1 - 2 v v^T`.
    fn with_eigenvalues(values: &[f64]) -> DenseSymmetric {
        let dim = values.len();
        let raw: Vec<f64> = (0..dim).map(|k| 1.0 + (k as f64).cos()).collect();
        let square = inner(&raw, &raw);
        let reflection = |i: usize, k: usize| f64::from(u8::from(i == k)) - 2.0 * raw[i] * raw[k] / square;
        let mut matrix = DenseSymmetric::zeros(dim);
        for i in 0..dim {
            for j in 0..=i {
                let terms = (0..dim).map(|k| reflection(i, k) * values[k] * reflection(k, j));
                matrix.row_mut(i)[j] = terms.sum();
            }
        }
        matrix
    }

    #[test]
    fn the_largest_ratio_is_an_eigenvalue() {
        let values: Vec<f64> = (0..60).map(|k| 1.0 + (f64::from(k) / 20.0).powi(3)).collect();
        let scaled =
            |factor: f64| with_eigenvalues(&values.iter().map(|x| factor * x * x).collect::<Vec<_>>());
        let found = largest_ratio(&scaled(3.0), &mut with_eigenvalues(&values)).unwrap();
        assert!((found / (3.0 * values[59]) - 1.0).abs() < 1e-6, "{found}");
        assert!(largest_ratio(&scaled(1.0), &mut scaled(-1.0)).is_err());
        // Rank one is used up in one step.
        let mut one = vec![0.0; 20];
        one[7] = 4.0;
        let found = largest_ratio(&with_eigenvalues(&one), &mut with_eigenvalues(&[2.0; 20])).unwrap();
        assert!((found - 2.0).abs() < 1e-6, "{found}");
        assert_eq!(largest_ratio(&with_eigenvalues(&[0.0; 3]), &mut with_eigenvalues(&[1.0; 3])), Ok(0.0));
    }

    /// A surface that is flat has few strains, fluid that is moved rigidly none: what rounding leaves of a
    /// used up start vector is as large as the least eigenvalue of `B` is small.
    #[test]
    fn rounding_is_not_taken_for_a_ratio() {
        let few = [1.0, 1.5, 2.0, 3.5, 5.0, 6.0, 7.5];
        for count in 1..=few.len() {
            let mut above = vec![0.0; 81];
            above[20..20 + count].copy_from_slice(&few[..count]);
            let mut below = vec![1.0; 81];
            below[..6].fill(1e-9);
            let found = largest_ratio(&with_eigenvalues(&above), &mut with_eigenvalues(&below)).unwrap();
            assert!((found / few[count - 1] - 1.0).abs() < 1e-6, "{count}: {found}");
        }
    }

    #[test]
    fn the_lowest_modes_are_found_twins_too() {
        let mut values = vec![1.0; 50];
        values[3..8].copy_from_slice(&[1e-5, 0.02, 0.02, 0.19, 0.3]);
        let matrix = with_eigenvalues(&values);
        let modes = lowest_modes(&mut matrix.clone(), 0.2).unwrap();
        let found: Vec<f64> = modes.iter().map(|mode| mode.0).collect();
        assert!(
            found.iter().zip([1e-5, 0.02, 0.02, 0.19]).all(|(a, b)| (a / b - 1.0).abs() < 2e-2),
            "{found:?}"
        );
        for (value, vector) in &modes {
            let mut image = vec![0.0; 50];
            matrix.multiply(vector, &mut image);
            let error = image.iter().zip(vector).map(|(a, v)| (a - value * v).abs()).fold(0.0, f64::max);
            assert!(error < 4e-2 * value.sqrt(), "{value}: {error}");
            assert!((inner(vector, vector) - 1.0).abs() < 1e-10);
        }
        assert_eq!(lowest_modes(&mut with_eigenvalues(&[0.1, 0.5]), 0.2).unwrap().len(), 1);
    }
}
