//! The largest eigenvalue of a preconditioned operator, from the Lanczos matrix that conjugate gradients
//! builds (Golub and Van Loan 2013, section 11.3).

use super::KrylovError;
use crate::operator::{LinOp, Preconditioner};
use crate::scalar::Scalar;
use crate::vector;

/// Estimate of the largest eigenvalue of `M^-1 A`, both symmetric positive definite, from `iterations` steps.
///
/// The estimate is a Ritz value, a bound from below; ten steps come within a few per cent, so multiply it by
/// 1.1 to 1.2 where a bound from above is needed. The start vector is fixed, so the result repeats bit for
/// bit.
pub fn estimate_lambda_max<T: Scalar>(
    a: &mut (impl LinOp<T> + ?Sized),
    m: &mut (impl Preconditioner<T> + ?Sized),
    iterations: usize,
) -> Result<f64, KrylovError> {
    let mut start = vec![T::ZERO; a.dim()];
    vector::fill_pseudo_random(1, &mut start);
    estimate_lambda_max_from(start, a, m, iterations)
}

/// The same from a start vector, for operators on vectors that ranks share: their number decides on no
/// entry of it.
pub fn estimate_lambda_max_from<T: Scalar>(
    start: Vec<T>,
    a: &mut (impl LinOp<T> + ?Sized),
    m: &mut (impl Preconditioner<T> + ?Sized),
    iterations: usize,
) -> Result<f64, KrylovError> {
    Ok(lanczos(start, a, m, iterations)?.largest_eigenvalue())
}

fn lanczos<T: Scalar>(
    mut r: Vec<T>,
    a: &mut (impl LinOp<T> + ?Sized),
    m: &mut (impl Preconditioner<T> + ?Sized),
    iterations: usize,
) -> Result<Tridiagonal, KrylovError> {
    let mut z = vec![T::ZERO; a.dim()];
    m.apply(&r, &mut z);
    let mut p = z.clone();
    let mut q = vec![T::ZERO; a.dim()];
    let mut rz = dot(a, &r, &z);
    let first = rz;
    let (mut alpha, mut beta) = (1.0, 0.0);
    let mut matrix = Tridiagonal::default();
    for iteration in 1..=iterations {
        // The start vector is used up: the Ritz values are eigenvalues.
        if rz.abs() <= (T::EPSILON * T::EPSILON) * first.abs() {
            break;
        }
        let alpha_before = alpha;
        a.apply(&p, &mut q);
        let curvature = dot(a, &p, &q);
        if !(rz.is_finite() && curvature.is_finite()) {
            return Err(KrylovError::NotFinite { iteration });
        }
        for (form, what) in [(rz, "preconditioner"), (curvature, "operator")] {
            if form <= 0.0 {
                return Err(KrylovError::NotPositiveDefinite { what, iteration, form });
            }
        }
        alpha = rz / curvature;
        matrix.push(1.0 / alpha + beta / alpha_before, beta.sqrt() / alpha_before);
        vector::axpy(-alpha, &q, &mut r);
        m.apply(&r, &mut z);
        let rz_next = dot(a, &r, &z);
        beta = rz_next / rz;
        vector::axpby(1.0, &z, beta, &mut p);
        rz = rz_next;
    }
    Ok(matrix)
}

fn dot<T: Scalar>(a: &(impl LinOp<T> + ?Sized), x: &[T], y: &[T]) -> f64 {
    let mut sum = [vector::dot(x, y)];
    a.complete(&mut sum);
    sum[0]
}

/// A symmetric tridiagonal matrix.
#[derive(Debug, Default)]
pub(crate) struct Tridiagonal {
    diagonal: Vec<f64>,
    /// Entry `j` couples rows `j - 1` and `j`; the first is not used.
    coupling: Vec<f64>,
}

impl Tridiagonal {
    /// Appends a row.
    pub(crate) fn push(&mut self, diagonal: f64, coupling: f64) {
        self.coupling.push(if self.diagonal.is_empty() { 0.0 } else { coupling });
        self.diagonal.push(diagonal);
    }

    /// Zero for no rows. By bisection on the sign of the pivots of `T - lambda` (Sylvester's law of inertia).
    pub(crate) fn largest_eigenvalue(&self) -> f64 {
        let mut high = self.gershgorin_bound();
        let mut low = self.diagonal.iter().copied().fold(0.0, f64::max);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if self.exceeds(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    fn gershgorin_bound(&self) -> f64 {
        (0..self.diagonal.len())
            .map(|j| {
                let next = self.coupling.get(j + 1).copied().unwrap_or(0.0);
                self.diagonal[j] + self.coupling[j].abs() + next.abs()
            })
            .fold(0.0, f64::max)
    }

    /// Whether an eigenvalue is larger than `lambda`.
    fn exceeds(&self, lambda: f64) -> bool {
        let mut pivot = -1.0;
        for (d, c) in self.diagonal.iter().zip(&self.coupling) {
            pivot = d - lambda - c * c / pivot;
            if pivot > 0.0 {
                return true;
            }
            pivot = pivot.min(-f64::MIN_POSITIVE);
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tridiagonal_eigenvalues_are_exact() {
        let n = 12;
        let mut matrix = Tridiagonal::default();
        for _ in 0..n {
            matrix.push(2.0, -1.0);
        }
        let exact = 2.0 - 2.0 * (std::f64::consts::PI * n as f64 / (n as f64 + 1.0)).cos();
        assert!((matrix.largest_eigenvalue() - exact).abs() < 1e-14);
    }
}
