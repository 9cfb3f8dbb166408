//! Iterative refinement with a true residual (Wilkinson 1963; Skeel 1980, 10.1090/S0025-5718-1980-0572859-4).

use super::DirectError;
use crate::sparse::SparseMatrix;
use crate::vector;

/// Tuning of the refinement after a direct solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefinementParams {
    /// Asked for: `|b - A x| <= relative_tolerance |b|` in the Euclidean norm.
    pub relative_tolerance: f64,
    /// Refinement steps at most.
    pub max_refinements: usize,
}

impl Default for RefinementParams {
    fn default() -> Self {
        Self { relative_tolerance: 1e-12, max_refinements: 10 }
    }
}

/// Outcome of a solve whose residual was checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefinementReport {
    /// Refinement steps made.
    pub refinements: usize,
    /// Norm of the true residual.
    pub residual_norm: f64,
    /// Norm of the right-hand side.
    pub right_hand_side_norm: f64,
    /// The tolerance was not met, but the residual is rounding error: it is below `ROUNDING_UNITS` units of
    /// roundoff of the terms it is the sum of, and no solver in this precision does better.
    pub limited_by_rounding: bool,
}

/// A residual of so many units of roundoff of `|A| |x| + |b|` is rounding error: a row of n terms accumulates
/// at most n of them and about sqrt(n) in practice.
const ROUNDING_UNITS: f64 = 16.0;

/// Workspace of the refinement.
#[derive(Clone, Debug)]
pub(super) struct Refinement {
    params: RefinementParams,
    residual: Vec<f64>,
    history: Vec<f64>,
}

impl Refinement {
    pub fn new(dim: usize, params: RefinementParams) -> Self {
        let history = Vec::with_capacity(params.max_refinements + 1);
        Self { params, residual: vec![0.0; dim], history }
    }

    pub fn history(&self) -> &[f64] {
        &self.history
    }

    pub fn set_relative_tolerance(&mut self, tolerance: f64) {
        self.params.relative_tolerance = tolerance;
    }

    /// Solves `A x = b`, where `approximate` overwrites its argument with the approximate solution for it.
    /// Stops when a step no longer halves the residual.
    pub fn solve(
        &mut self,
        a: &SparseMatrix,
        mut approximate: impl FnMut(&mut [f64]),
        b: &[f64],
        x: &mut [f64],
    ) -> Result<RefinementReport, DirectError> {
        let right_hand_side_norm = vector::norm(b);
        let target_norm = self.params.relative_tolerance * right_hand_side_norm;
        self.history.clear();
        x.copy_from_slice(b);
        approximate(x);
        let mut norm = self.take_residual(a, b, x);
        while norm > target_norm && self.history.len() <= self.params.max_refinements {
            approximate(&mut self.residual);
            vector::axpy(1.0, &self.residual, x);
            let refined = self.take_residual(a, b, x);
            let stalled = refined > 0.5 * norm;
            norm = refined;
            if stalled {
                break;
            }
        }
        let limited_by_rounding = norm > target_norm && norm <= rounding_norm(a, b, x);
        if norm <= target_norm || limited_by_rounding {
            let refinements = self.history.len() - 1;
            Ok(RefinementReport {
                refinements,
                residual_norm: norm,
                right_hand_side_norm,
                limited_by_rounding,
            })
        } else {
            let history = self.history.clone();
            Err(DirectError::NotConverged { residual_norm: norm, target_norm, history })
        }
    }

    fn take_residual(&mut self, a: &SparseMatrix, b: &[f64], x: &[f64]) -> f64 {
        a.multiply(x, &mut self.residual);
        vector::residual_from_product(b, &mut self.residual);
        let norm = vector::norm(&self.residual);
        self.history.push(norm);
        norm
    }
}

/// Norm of the residual that rounding alone leaves.
pub(super) fn rounding_norm(a: &SparseMatrix, b: &[f64], x: &[f64]) -> f64 {
    let pattern = a.pattern();
    let mut sum = 0.0;
    for (row, b) in b.iter().enumerate() {
        let values = &a.values()[pattern.range(row)];
        let terms: f64 =
            pattern.columns_of(row).iter().zip(values).map(|(&c, v)| (v * x[c as usize]).abs()).sum();
        sum += (terms + b.abs()).powi(2);
    }
    ROUNDING_UNITS * f64::EPSILON * sum.sqrt()
}
