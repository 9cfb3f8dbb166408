//! The Delassus operator of a set of contacts, from the rows of their Jacobian.
//!
//! The gap of contact `k` opens at the rate `G_k V`, and its force `lambda_k` acts as `G_k^T lambda_k`; for
//! round particles the rows are `(-e, e)`, for bodies that turn they have the moments of `e` besides. A unit
//! force opens its own gap by the compliance `A_kk`, `A = c G M^-1 G^T`. Rows are scaled to the same
//! compliance: with `s_k = sqrt(max A / A_kk)` the solvers see `S A S`, gaps `s_k w_k` and forces
//! `lambda_k / s_k`.

use crate::solver::{DelassusOperator, Factor};

/// A row `G_k` of the Jacobian of the gaps: a contact between two bodies.
pub(crate) trait JacobianRow: Copy {
    /// Motion of a body: a velocity, or a velocity with a spin; also the force on it, or force and moment.
    type Motion: Copy;
    /// `c` times the mobility of a body.
    type Weight: Copy;

    /// The body at rest, or without a force.
    fn zero() -> Self::Motion;
    /// The row times a factor.
    fn scaled(&self, factor: f64) -> Self;
    /// `A_kk` of a row that is not scaled.
    fn compliance(&self, weights: &[Self::Weight]) -> f64;
    /// Adds `G_k^T force` to the forces on the bodies.
    fn add_force(&self, force: f64, loads: &mut [Self::Motion]);
    /// `G_k V`.
    fn opening(&self, motions: &[Self::Motion]) -> f64;
}

/// Scales rows to equal compliance, and writes their scales; `complete` makes the largest compliance here
/// that of all rows.
pub(crate) fn scale_rows<R: JacobianRow>(
    weights: &[R::Weight],
    rows: &mut [R],
    scales: &mut [f64],
    complete: impl FnOnce(&mut [f64; 1]),
) {
    for (row, scale) in rows.iter().zip(&mut *scales) {
        *scale = row.compliance(weights);
    }
    let mut largest = [scales.iter().copied().fold(0.0, f64::max)];
    complete(&mut largest);
    for (row, scale) in rows.iter_mut().zip(scales) {
        *scale = (largest[0] / *scale).sqrt();
        *row = row.scaled(*scale);
    }
}

/// The mobility of all bodies of a problem, `c M^-1`.
pub(crate) trait Response<R: JacobianRow> {
    /// Whether a force on one body moves others.
    const IS_COUPLED: bool;

    /// Replaces forces on bodies by `c` times the velocities they cause.
    fn respond(&self, motions: &mut [R::Motion]);

    /// `R` with `S A S = R R^T`, if it is known and sparse.
    fn factor(&self, _rows: &[R]) -> Option<Factor> {
        None
    }

    /// See [`DelassusOperator::complete`].
    fn complete(&self, _sums: &mut [f64], _largest: &mut [f64]) {}

    /// See [`DelassusOperator::place`].
    fn place(&self) -> Option<usize> {
        None
    }

    /// See [`DelassusOperator::gather`].
    fn gather(&self, numbers: &[f64]) -> Vec<Vec<f64>> {
        vec![numbers.to_vec()]
    }
}

/// `S A S` of scaled rows.
pub(crate) struct ScaledDelassus<'a, R: JacobianRow, C> {
    pub rows: &'a [R],
    pub response: C,
    pub motions: &'a mut [R::Motion],
}

impl<R: JacobianRow, C: Response<R>> ScaledDelassus<'_, R, C> {
    /// Leaves `c M^-1 G^T S forces` in the motions: forces are added up body by body in the order of the
    /// rows.
    pub(crate) fn move_bodies(&mut self, forces: &[f64]) {
        self.motions.fill(R::zero());
        for (row, force) in self.rows.iter().zip(forces) {
            row.add_force(*force, self.motions);
        }
        self.response.respond(self.motions);
    }
}

impl<R: JacobianRow, C: Response<R>> DelassusOperator for ScaledDelassus<'_, R, C> {
    fn apply(&mut self, forces: &[f64], gaps: &mut [f64]) {
        self.move_bodies(forces);
        for (gap, row) in gaps.iter_mut().zip(self.rows) {
            *gap = row.opening(self.motions);
        }
    }

    fn factor(&self) -> Option<Factor> {
        self.response.factor(self.rows)
    }

    fn complete(&self, sums: &mut [f64], largest: &mut [f64]) {
        self.response.complete(sums, largest);
    }

    fn place(&self) -> Option<usize> {
        self.response.place()
    }

    fn gather(&self, numbers: &[f64]) -> Vec<Vec<f64>> {
        self.response.gather(numbers)
    }
}
