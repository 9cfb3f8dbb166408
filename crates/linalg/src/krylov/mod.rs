//! Krylov methods: solvers, an estimate of the largest eigenvalue, and the norms, reports and errors they
//! share.

mod basis;
mod eigen;
mod gcr;
mod lanczos;

pub use eigen::{largest_ratio, lowest_modes};
pub use gcr::{Gcr, GcrParams};
pub use lanczos::{estimate_lambda_max, estimate_lambda_max_from};

use crate::operator::LinOp;
use crate::scalar::Scalar;
use crate::vector;

/// The norm that the relative tolerance is relative to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reference {
    /// `|b|`.
    RightHandSide,
    /// `|b - A x|` of the initial guess: the reduction asked for.
    InitialResidual,
    /// A norm the caller knows, such as that of the first time step.
    Norm(f64),
}

/// Outcome of a converged solve. All norms are Euclidean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KrylovReport {
    /// Applications of the preconditioner.
    pub iterations: usize,
    /// Norm of the initial residual.
    pub initial_norm: f64,
    /// Norm of the true residual `b - A x` at the end, computed from `x`.
    pub residual_norm: f64,
    /// The norm the tolerance was relative to.
    pub reference_norm: f64,
}

/// Reason why a Krylov method gave up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KrylovError {
    /// The residual is still too large.
    #[error("no convergence in {iterations} iterations: residual {residual_norm:e}, wanted {target_norm:e}")]
    NotConverged {
        /// Iterations made.
        iterations: usize,
        /// Norm of the true residual of the `x` handed back.
        residual_norm: f64,
        /// Norm at which the method would have stopped.
        target_norm: f64,
        /// Norm of the residual at the start and after each iteration.
        history: Vec<f64>,
    },
    /// An infinite or undefined number came from the data, the operator or the preconditioner.
    #[error("not a finite number in iteration {iteration}")]
    NotFinite {
        /// Iteration in which it was seen; 0 is the initial residual.
        iteration: usize,
    },
    /// A method for positive definite operators met a direction of curvature that is not positive.
    #[error("{what} is not positive definite: form {form:e} in iteration {iteration}")]
    NotPositiveDefinite {
        /// "operator" or "preconditioner".
        what: &'static str,
        /// Iteration in which it was seen.
        iteration: usize,
        /// The value of the quadratic form.
        form: f64,
    },
    /// A vector does not have the length of the operator.
    #[error("operator of dimension {expected} was given a vector of length {found}")]
    DimensionMismatch {
        /// Dimension of the operator.
        expected: usize,
        /// Length of the vector.
        found: usize,
    },
}

/// Stopping rule of one solve.
#[derive(Clone, Copy, Debug)]
struct Target {
    initial_norm: f64,
    reference_norm: f64,
    norm: f64,
}

impl Target {
    fn new(
        reference: Reference,
        right_hand_side_norm: f64,
        initial_norm: f64,
        relative: f64,
        floor: f64,
    ) -> Self {
        let reference_norm = match reference {
            Reference::RightHandSide => right_hand_side_norm,
            Reference::InitialResidual => initial_norm,
            Reference::Norm(norm) => norm,
        };
        Self { initial_norm, reference_norm, norm: (relative * reference_norm).max(floor) }
    }

    fn report(&self, iterations: usize, residual_norm: f64) -> KrylovReport {
        KrylovReport {
            iterations,
            initial_norm: self.initial_norm,
            residual_norm,
            reference_norm: self.reference_norm,
        }
    }

    fn not_converged(&self, iterations: usize, residual_norm: f64, history: &[f64]) -> KrylovError {
        KrylovError::NotConverged {
            iterations,
            residual_norm,
            target_norm: self.norm,
            history: history.to_vec(),
        }
    }
}

fn check_dimensions<T>(dim: usize, b: &[T], x: &[T]) -> Result<(), KrylovError> {
    match [b.len(), x.len()].into_iter().find(|&len| len != dim) {
        Some(found) => Err(KrylovError::DimensionMismatch { expected: dim, found }),
        None => Ok(()),
    }
}

fn finite(value: f64, iteration: usize) -> Result<f64, KrylovError> {
    if value.is_finite() { Ok(value) } else { Err(KrylovError::NotFinite { iteration }) }
}

/// `r = b - A x` and its norm.
fn true_residual<T: Scalar>(a: &mut (impl LinOp<T> + ?Sized), b: &[T], x: &[T], r: &mut [T]) -> f64 {
    a.apply(x, r);
    let mut square = [vector::residual_square_from_product(b, r)];
    if a.clear_rounding(b, x, r) {
        square = [vector::dot(r, r)];
    }
    a.complete(&mut square);
    square[0].sqrt()
}

/// The norm of a vector of the space that the operator acts on.
fn norm<T: Scalar>(a: &(impl LinOp<T> + ?Sized), x: &[T]) -> f64 {
    let mut square = [vector::dot(x, x)];
    a.complete(&mut square);
    square[0].sqrt()
}
