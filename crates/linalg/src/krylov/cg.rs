//! Preconditioned conjugate gradients (Hestenes and Stiefel 1952, 10.6028/jres.049.044) for positive definite
//! operators and fixed, positive definite preconditioners.

use super::{KrylovError, KrylovReport, Reference, Target, check_dimensions, finite, true_residual};
use crate::operator::{LinOp, Preconditioner};
use crate::scalar::Scalar;
use crate::vector;

/// Tuning of [`Cg`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgParams {
    /// Stop at this fraction of the [`Reference`] norm.
    pub relative_tolerance: f64,
    /// Stop at this norm in any case; zero for none.
    pub absolute_floor: f64,
    /// Give up after this many iterations.
    pub max_iterations: usize,
}

impl Default for CgParams {
    fn default() -> Self {
        Self { relative_tolerance: 1e-8, absolute_floor: 0.0, max_iterations: 1000 }
    }
}

/// Conjugate gradients. Owns its workspace of four vectors.
#[derive(Clone, Debug)]
pub struct Cg<T> {
    params: CgParams,
    r: Vec<T>,
    z: Vec<T>,
    p: Vec<T>,
    q: Vec<T>,
    history: Vec<f64>,
}

impl<T: Scalar> Cg<T> {
    /// A solver for operators of dimension `dim`.
    pub fn new(dim: usize, params: CgParams) -> Self {
        let zeros = || vec![T::ZERO; dim];
        let history = Vec::with_capacity(params.max_iterations + 1);
        Self { params, r: zeros(), z: zeros(), p: zeros(), q: zeros(), history }
    }

    /// The tuning in use.
    pub fn params(&self) -> &CgParams {
        &self.params
    }

    /// Residual norms of the last solve: the initial one, then one for each iteration. The last is the true one.
    pub fn residual_history(&self) -> &[f64] {
        &self.history
    }

    /// Solves `A x = b` from the guess in `x`.
    ///
    /// Converged means that the residual recomputed from `x` is small; where the recurrence was too hopeful, the
    /// iteration starts again from `x`.
    pub fn solve(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        m: &mut (impl Preconditioner<T> + ?Sized),
        b: &[T],
        x: &mut [T],
        reference: Reference,
    ) -> Result<KrylovReport, KrylovError> {
        check_dimensions(a.dim(), b, x)?;
        check_dimensions(a.dim(), &self.r, x)?;
        self.history.clear();
        let right_hand_side_norm = finite(vector::norm(b), 0)?;
        let mut norm = finite(true_residual(a, b, x, &mut self.r), 0)?;
        let CgParams { relative_tolerance, absolute_floor, max_iterations } = self.params;
        let target = Target::new(reference, right_hand_side_norm, norm, relative_tolerance, absolute_floor);
        self.history.push(norm);
        let mut iterations = 0;
        while norm > target.norm {
            if iterations == max_iterations {
                return Err(target.not_converged(iterations, norm, &self.history));
            }
            self.run(a, m, x, &target, &mut iterations)?;
            norm = finite(true_residual(a, b, x, &mut self.r), iterations)?;
            if let Some(last) = self.history.last_mut() {
                *last = norm;
            }
        }
        Ok(target.report(iterations, norm))
    }

    /// The recurrence from the residual in `r` until its own residual is small.
    fn run(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        m: &mut (impl Preconditioner<T> + ?Sized),
        x: &mut [T],
        target: &Target,
        iterations: &mut usize,
    ) -> Result<(), KrylovError> {
        m.apply(&self.r, &mut self.z);
        self.p.copy_from_slice(&self.z);
        let mut rz = positive(vector::dot(&self.r, &self.z), "preconditioner", *iterations + 1)?;
        while *iterations < self.params.max_iterations {
            *iterations += 1;
            a.apply(&self.p, &mut self.q);
            let curvature = positive(vector::dot(&self.p, &self.q), "operator", *iterations)?;
            vector::axpy(rz / curvature, &self.p, x);
            vector::axpy(-rz / curvature, &self.q, &mut self.r);
            let norm = finite(vector::norm(&self.r), *iterations)?;
            self.history.push(norm);
            if norm <= target.norm {
                return Ok(());
            }
            m.apply(&self.r, &mut self.z);
            let rz_next = positive(vector::dot(&self.r, &self.z), "preconditioner", *iterations + 1)?;
            vector::axpby(1.0, &self.z, rz_next / rz, &mut self.p);
            rz = rz_next;
        }
        Ok(())
    }
}

fn positive(form: f64, what: &'static str, iteration: usize) -> Result<f64, KrylovError> {
    finite(form, iteration)?;
    if form > 0.0 { Ok(form) } else { Err(KrylovError::NotPositiveDefinite { what, iteration, form }) }
}
