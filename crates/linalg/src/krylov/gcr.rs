//! Generalised conjugate residuals with a preconditioner that may change, in two precisions.
//!
//! Step `k` takes a direction `z = M_k^-1 r`, makes `c = A z` orthogonal to those before it and takes `c` out
//! of the residual `r`: with `A Z = C R` for the stored directions, orthogonal `C` and upper triangular `R`,
//! the residual `r - C C^T r` is the smallest that any combination of the directions leaves, and belongs to
//! `x + Z R^-1 C^T r` (Eisenstat, Elman and Schultz 1983, 10.1137/0720023; with inner iterations van der
//! Vorst and Vuik 1994, 10.1002/nla.1680010404). Flexible GMRES finds the same residuals; here they are at
//! hand in every step. Where a step hardly makes the residual smaller, the next direction starts from `c` in
//! place of `r`, which would give the last direction again (Jiranek and Rozloznik 2010,
//! 10.1007/s11075-009-9311-6).
//!
//! `Gcr<f64, f32>` takes its steps in single precision: preconditioner, operator and all vectors that are
//! kept. They work in stages: when the residual has become smaller by `epsilon^(2/3)`, or no longer becomes
//! smaller, `x` is updated and the residual computed anew, both in double precision. `Z`, `C` and `R` stay,
//! so a new stage loses nothing. The true residual decides when to stop, and reaches what double precision
//! allows.
//!
//! `Gcr<f64, f64, f32>` takes its steps in double precision and keeps `Z` alone in single: a direction is
//! what the preconditioner gave, rounded, and `C` are the images of rounded directions.

use super::basis::{Basis, Directions};
use super::{KrylovError, KrylovReport, Reference, Target, check_dimensions, finite, norm, true_residual};
use crate::operator::{LinOp, Preconditioner};
use crate::scalar::Scalar;
use crate::vector;

/// A step from the residual that leaves more than this of it is followed by one that starts from `c`.
const SLOW: f64 = 0.9;
/// So many of them in a row end a stage: what is left of the residual may be rounding.
const MOST_SLOW_STEPS: usize = 3;

/// Tuning of [`Gcr`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GcrParams {
    /// Stop at this fraction of the [`Reference`] norm.
    pub relative_tolerance: f64,
    /// Stop at this norm in any case; zero for none.
    pub absolute_floor: f64,
    /// Give up after this many iterations.
    pub max_iterations: usize,
    /// Iterations between restarts; each keeps two vectors.
    pub restart: usize,
}

impl Default for GcrParams {
    fn default() -> Self {
        Self { relative_tolerance: 1e-8, absolute_floor: 0.0, max_iterations: 300, restart: 60 }
    }
}

/// Flexible generalised conjugate residuals. Owns its workspace, which grows to what the longest solve needed
/// and is then reused.
///
/// `Gcr<f64, f32>` takes its steps in single precision, see [`Gcr::with_steps`]. It reaches the same true
/// residual.
#[derive(Clone, Debug)]
pub struct Gcr<T, S = T, Z = S> {
    params: GcrParams,
    /// `b - A x`.
    residual: Vec<T>,
    /// The part of it that the steps of a stage have left, over its norm at their start.
    r: Vec<S>,
    /// `Z`, and the last of them as the operator takes it.
    directions: Directions<Z>,
    direction: Vec<S>,
    /// `C`.
    images: Basis<S>,
    /// `R`.
    triangle: Triangle,
    /// `C^T r` of the present stage, then `R^-1 C^T r`.
    coefficients: Vec<f64>,
    history: Vec<f64>,
}

impl<T: Scalar> Gcr<T> {
    /// A solver with an empty workspace that takes its steps in the precision of the problem.
    pub fn new(params: GcrParams) -> Self {
        Self::with_steps(params)
    }
}

impl<T: Scalar, S: Scalar> Gcr<T, S> {
    /// A solver with an empty workspace that takes its steps in `S`: half the memory and half the traffic
    /// where that is narrower than `T`.
    ///
    /// For a good preconditioner, with convergence in a few dozen iterations: rounded vectors no longer span
    /// a Krylov space, which delays convergence through hundreds of iterations.
    pub fn with_steps(params: GcrParams) -> Self {
        Self::with_directions(params)
    }
}

impl<T: Scalar, S: Scalar, Z: Scalar> Gcr<T, S, Z> {
    /// A solver with an empty workspace that takes its steps in `S` and keeps the directions in `Z`, for a
    /// preconditioner that is no more accurate than that.
    pub fn with_directions(params: GcrParams) -> Self {
        let restart = params.restart.max(1);
        Self {
            params: GcrParams { restart, ..params },
            residual: Vec::new(),
            r: Vec::new(),
            directions: Directions::default(),
            direction: Vec::new(),
            images: Basis::default(),
            triangle: Triangle::default(),
            coefficients: Vec::with_capacity(restart),
            history: Vec::with_capacity(params.max_iterations + 1),
        }
    }

    /// The tuning in use.
    pub fn params(&self) -> &GcrParams {
        &self.params
    }

    /// Changes the tolerance of later solves.
    pub fn set_relative_tolerance(&mut self, tolerance: f64) {
        self.params.relative_tolerance = tolerance;
    }

    /// Residual norms of the last solve: the initial one, then one for each iteration. The last is the true
    /// one.
    pub fn residual_history(&self) -> &[f64] {
        &self.history
    }

    /// Solves `A x = b` from the guess in `x`.
    ///
    /// Converged means that the residual recomputed from `x` is small, not the one of the recurrence. On an
    /// error `x` holds the last finite iterate.
    pub fn solve(
        &mut self,
        a: &mut (impl LinOp<T> + LinOp<S> + ?Sized),
        m: &mut (impl Preconditioner<S> + ?Sized),
        b: &[T],
        x: &mut [T],
        reference: Reference,
    ) -> Result<KrylovReport, KrylovError> {
        check_dimensions(LinOp::<T>::dim(a), b, x)?;
        self.history.clear();
        self.residual.resize(b.len(), T::ZERO);
        self.r.resize(b.len(), S::ZERO);
        self.direction.resize(b.len(), S::ZERO);
        self.forget();
        let right_hand_side_norm = finite(norm::<T>(a, b), 0)?;
        LinOp::<T>::settle(a, b, x);
        let norm = finite(true_residual(a, b, x, &mut self.residual), 0)?;
        let GcrParams { relative_tolerance, absolute_floor, max_iterations, .. } = self.params;
        let target = Target::new(reference, right_hand_side_norm, norm, relative_tolerance, absolute_floor);
        self.history.push(norm);
        let mut now = Progress { iterations: 0, norm, stage: StageEnd::Regular };
        while now.norm > target.norm {
            if now.iterations == max_iterations {
                return Err(target.not_converged(now.iterations, now.norm, &self.history));
            }
            now.stage = self.stage(a, m, &target, &mut now)?;
            let before = now.norm;
            now.norm = self.update(a, b, x, &now)?;
            if now.stage == StageEnd::BrokeDown && now.norm > target.norm.max(0.5 * before) {
                return Err(target.not_converged(now.iterations, now.norm, &self.history));
            }
        }
        Ok(target.report(now.iterations, now.norm))
    }

    /// Drops all directions.
    fn forget(&mut self) {
        self.directions.reset(self.r.len());
        self.images.reset(self.r.len());
        self.triangle.clear();
    }

    /// Takes steps from the true residual until it is small, the precision of the steps is used up or they no
    /// longer help: none if the images known already leave little of it, but at least one if there was none
    /// in the last stage.
    fn stage(
        &mut self,
        a: &mut (impl LinOp<S> + ?Sized),
        m: &mut (impl Preconditioner<S> + ?Sized),
        target: &Target,
        progress: &mut Progress,
    ) -> Result<StageEnd, KrylovError> {
        let Progress { iterations, norm, stage: last } = progress;
        let norm = *norm;
        if self.images.len() >= self.params.restart {
            self.forget();
        }
        vector::convert(1.0 / norm, &self.residual, &mut self.r);
        self.coefficients.clear();
        let complete = |sums: &mut [f64]| a.complete(sums);
        let mut now = self.images.take_out(&mut self.r, complete, |c| self.coefficients.push(c));
        let enough = (target.norm / norm).max(S::EPSILON.powf(2.0 / 3.0));
        if now <= enough && *last != StageEnd::NoStep {
            return Ok(StageEnd::NoStep);
        }
        let (mut is_slow, mut is_first, mut slow_steps) = (false, true, 0);
        while (now > enough || is_first)
            && slow_steps < MOST_SLOW_STEPS
            && self.images.len() < self.params.restart
            && *iterations < self.params.max_iterations
        {
            is_first = false;
            *iterations += 1;
            let before = now;
            let step = self.step(a, m, is_slow);
            now = finite(step.unwrap_or(before), *iterations)?;
            self.history.push(now * norm);
            if step.is_none() {
                return Ok(StageEnd::BrokeDown);
            }
            let is_stalled = now > SLOW * before;
            slow_steps = if is_stalled { slow_steps + 1 } else { 0 };
            is_slow = !is_slow && is_stalled;
        }
        Ok(StageEnd::Regular)
    }

    /// One more direction, from the last image or from the residual; returns the norm of what it leaves of
    /// the residual, or nothing where its image is a combination of those before.
    fn step(
        &mut self,
        a: &mut (impl LinOp<S> + ?Sized),
        m: &mut (impl Preconditioner<S> + ?Sized),
        from_image: bool,
    ) -> Option<f64> {
        let Self { r, directions, direction, images, triangle, coefficients, .. } = self;
        let source = if from_image { images.last() } else { &r[..] };
        m.apply(source, direction);
        let kept = directions.push_with(|z| vector::convert(1.0, direction, z));
        vector::convert(1.0, kept, direction);
        a.apply(direction, images.next());
        let complete = |sums: &mut [f64]| a.complete(sums);
        let left = images.orthogonalise(r, complete, |h| triangle.push(h));
        triangle.push(left.norm);
        // Not the other way round: a norm that is not a number goes on to the caller.
        if left.norm <= S::EPSILON * triangle.close() {
            triangle.pop();
            directions.pop();
            return None;
        }
        images.push(left.norm);
        coefficients.push(left.product);
        Some(images.take_out_last(left.product, r, complete))
    }

    /// `x += norm Z R^-1 C^T r`, unless that is not finite, and the true residual for the next stage; returns
    /// its norm.
    fn update(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        b: &[T],
        x: &mut [T],
        &Progress { iterations, norm, .. }: &Progress,
    ) -> Result<f64, KrylovError> {
        self.triangle.solve(&mut self.coefficients);
        self.coefficients.iter_mut().for_each(|c| *c *= norm);
        finite(self.coefficients.iter().map(|c| c.abs()).sum(), iterations)?;
        self.directions.add(&self.coefficients, x);
        a.settle(b, x);
        let norm = finite(true_residual(a, b, x, &mut self.residual), iterations)?;
        if let Some(last) = self.history.last_mut() {
            *last = norm;
        }
        Ok(norm)
    }
}

/// State of a solve: how far it has come.
struct Progress {
    iterations: usize,
    /// Norm of the true residual.
    norm: f64,
    /// How the last stage ended.
    stage: StageEnd,
}

/// End of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StageEnd {
    Regular,
    /// The images known already left little of the residual.
    NoStep,
    /// The last direction added nothing.
    BrokeDown,
}

/// An upper triangular matrix that grows by columns.
#[derive(Clone, Debug, Default)]
struct Triangle {
    /// Columns, packed, and the entries of an open one.
    entries: Vec<f64>,
    columns: usize,
}

impl Triangle {
    fn clear(&mut self) {
        self.entries.clear();
        self.columns = 0;
    }

    /// Start of column `j`.
    fn start(j: usize) -> usize {
        j * (j + 1) / 2
    }

    /// One more entry of the open column.
    fn push(&mut self, entry: f64) {
        self.entries.push(entry);
    }

    /// Ends the open column and returns its norm.
    fn close(&mut self) -> f64 {
        let column = &self.entries[Self::start(self.columns)..];
        self.columns += 1;
        column.iter().map(|h| h * h).sum::<f64>().sqrt()
    }

    /// Drops the last column.
    fn pop(&mut self) {
        self.columns -= 1;
        self.entries.truncate(Self::start(self.columns));
    }

    /// `y = R^-1 y`.
    fn solve(&self, y: &mut [f64]) {
        for j in (0..self.columns).rev() {
            let column = &self.entries[Self::start(j)..=Self::start(j) + j];
            y[j] /= column[j];
            for i in 0..j {
                y[i] -= column[i] * y[j];
            }
        }
    }
}
