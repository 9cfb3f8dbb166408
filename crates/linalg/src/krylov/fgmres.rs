//! Flexible GMRES with restarts (Saad 1993, 10.1137/0914028).
//!
//! Right preconditioned, `A M_j^-1 y = b`, where the preconditioner may change from one iteration to the next: an
//! inner iteration or a cycle in single precision is welcome. Gram-Schmidt by groups, Givens rotations. Convergence is
//! decided by the true residual, whatever the precision in which vectors are kept.

use super::basis::{Basis, Directions};
use super::{KrylovError, KrylovReport, Reference, Target, check_dimensions, finite, true_residual};
use crate::{LinOp, Preconditioner, Scalar, vector};

/// Tuning of [`Fgmres`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FgmresParams {
    /// Stop at this fraction of the [`Reference`] norm.
    pub relative_tolerance: f64,
    /// Stop at this norm in any case; zero for none.
    pub absolute_floor: f64,
    /// Give up after this many iterations.
    pub max_iterations: usize,
    /// Iterations between restarts; each keeps two vectors.
    pub restart: usize,
}

impl Default for FgmresParams {
    fn default() -> Self {
        Self { relative_tolerance: 1e-8, absolute_floor: 0.0, max_iterations: 300, restart: 60 }
    }
}

/// Flexible GMRES. Owns its workspace, which grows to what the longest cycle needed and is then reused.
///
/// `Fgmres<f64, f32>` keeps preconditioned vectors in single precision, see [`Fgmres::with_storage`]. It reaches the same
/// true residual.
#[derive(Clone, Debug)]
pub struct Fgmres<T, S = T> {
    params: FgmresParams,
    /// Orthogonal basis `v_0 .. v_k` of the Krylov space.
    basis: Basis<T>,
    /// Preconditioned basis `z_j = M_j^-1 v_j`.
    directions: Directions<S>,
    least_squares: LeastSquares,
    history: Vec<f64>,
}

impl<T: Scalar> Fgmres<T> {
    /// A solver with an empty workspace that keeps its vectors in the precision of the problem.
    pub fn new(params: FgmresParams) -> Self {
        Self::with_storage(params)
    }
}

impl<T: Scalar, S: Scalar> Fgmres<T, S> {
    /// A solver with an empty workspace that keeps preconditioned vectors in `S`, which the preconditioner writes and the
    /// operator reads. The preconditioner may scale each by a positive factor of its choice.
    ///
    /// For a good preconditioner, with convergence in a few dozen iterations: rounded directions no longer span a Krylov
    /// space, which delays convergence through hundreds of iterations, and an exact preconditioner takes two.
    pub fn with_storage(params: FgmresParams) -> Self {
        let restart = params.restart.max(1);
        Self {
            params: FgmresParams { restart, ..params },
            basis: Basis::default(),
            directions: Directions::default(),
            least_squares: LeastSquares::default(),
            history: Vec::with_capacity(params.max_iterations + 1),
        }
    }

    /// The tuning in use.
    pub fn params(&self) -> &FgmresParams {
        &self.params
    }

    /// Changes the tolerance of later solves.
    pub fn set_relative_tolerance(&mut self, tolerance: f64) {
        self.params.relative_tolerance = tolerance;
    }

    /// Residual norms of the last solve: the initial one, then one for each iteration. The last is the true one.
    pub fn residual_history(&self) -> &[f64] {
        &self.history
    }

    /// Solves `A x = b` from the guess in `x`.
    ///
    /// Converged means that the residual recomputed from `x` is small, not the one of the recurrence. On an error `x`
    /// holds the last finite iterate.
    pub fn solve(
        &mut self,
        a: &mut (impl LinOp<T> + LinOp<T, S> + ?Sized),
        m: &mut (impl Preconditioner<T, S> + ?Sized),
        b: &[T],
        x: &mut [T],
        reference: Reference,
    ) -> Result<KrylovReport, KrylovError> {
        check_dimensions(LinOp::<T>::dim(a), b, x)?;
        self.history.clear();
        let right_hand_side_norm = finite(vector::norm(b), 0)?;
        let mut norm = finite(self.residual(a, b, x), 0)?;
        let FgmresParams { relative_tolerance, absolute_floor, max_iterations, .. } = self.params;
        let target = Target::new(reference, right_hand_side_norm, norm, relative_tolerance, absolute_floor);
        self.history.push(norm);
        let mut iterations = 0;
        while norm > target.norm {
            if iterations == max_iterations {
                return Err(target.not_converged(iterations, norm, &self.history));
            }
            let cycle = self.cycle(a, m, norm, &target, &mut iterations)?;
            let before = norm;
            norm = self.update(a, b, x, cycle.steps, iterations)?;
            if cycle.broke_down && norm > 0.5 * before {
                return Err(target.not_converged(iterations, norm, &self.history));
            }
        }
        Ok(target.report(iterations, norm))
    }

    /// Starts a basis with the true residual and returns its norm.
    fn residual(&mut self, a: &mut (impl LinOp<T> + ?Sized), b: &[T], x: &[T]) -> f64 {
        self.basis.reset(b.len());
        self.directions.reset(b.len());
        true_residual(a, b, x, self.basis.next())
    }

    /// Builds the Krylov space of the residual, of this norm, until its least-squares residual is small.
    fn cycle(
        &mut self,
        a: &mut (impl LinOp<T> + LinOp<T, S> + ?Sized),
        m: &mut (impl Preconditioner<T, S> + ?Sized),
        norm: f64,
        target: &Target,
        iterations: &mut usize,
    ) -> Result<Cycle, KrylovError> {
        self.least_squares.reset(norm);
        self.basis.push(norm);
        let mut steps = 0;
        while steps < self.params.restart && *iterations < self.params.max_iterations {
            *iterations += 1;
            let left = finite(self.arnoldi_step(a, m), *iterations)?;
            let column = self.least_squares.column_norm();
            let residual = finite(self.least_squares.close_column(), *iterations)?;
            self.history.push(residual);
            steps += 1;
            let broke_down = left <= T::EPSILON * column;
            if residual <= target.norm || broke_down {
                return Ok(Cycle { steps, broke_down });
            }
            self.basis.push(left);
        }
        Ok(Cycle { steps, broke_down: false })
    }

    /// `z = M^-1 v`, `w = A z` orthogonalised against the basis, for its last vector `v`; returns the norm of `w`.
    fn arnoldi_step(
        &mut self,
        a: &mut (impl LinOp<T, S> + ?Sized),
        m: &mut (impl Preconditioner<T, S> + ?Sized),
    ) -> f64 {
        let Self { basis, directions, least_squares, .. } = self;
        let z = directions.push_with(|z| m.apply(basis.last(), z));
        a.apply(z, basis.next());
        let left = basis.orthogonalise(|h| least_squares.push(h));
        least_squares.push(left);
        left
    }

    /// `x += Z y`, unless `y` is not finite, and the true residual for the next cycle; returns its norm.
    fn update(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        b: &[T],
        x: &mut [T],
        steps: usize,
        iterations: usize,
    ) -> Result<f64, KrylovError> {
        let y = self.least_squares.solve(steps);
        finite(y.iter().map(|y| y.abs()).sum(), iterations)?;
        self.directions.add(y, x);
        let norm = finite(self.residual(a, b, x), iterations)?;
        if let Some(last) = self.history.last_mut() {
            *last = norm;
        }
        Ok(norm)
    }
}

/// What a cycle did.
struct Cycle {
    steps: usize,
    /// The Krylov space is invariant: more steps would add nothing.
    broke_down: bool,
}

/// The small least-squares problem `min |beta e_0 - H y|`, kept triangular by Givens rotations.
#[derive(Clone, Debug, Default)]
struct LeastSquares {
    /// Columns of `R`, packed; while a column is open, it ends with its Hessenberg entries.
    columns: Vec<f64>,
    rotations: Vec<(f64, f64)>,
    /// Rotated right-hand side.
    g: Vec<f64>,
    y: Vec<f64>,
}

impl LeastSquares {
    fn reset(&mut self, norm: f64) {
        self.columns.clear();
        self.rotations.clear();
        self.g.clear();
        self.g.push(norm);
    }

    fn push(&mut self, h: f64) {
        self.columns.push(h);
    }

    /// Norm of the open column.
    fn column_norm(&self) -> f64 {
        let column = &self.columns[Self::start(self.rotations.len())..];
        column.iter().map(|h| h * h).sum::<f64>().sqrt()
    }

    /// Start of the packed column `j` of `R`.
    fn start(j: usize) -> usize {
        j * (j + 1) / 2
    }

    /// Rotates the open column to triangular form and returns the norm of the least-squares residual.
    fn close_column(&mut self) -> f64 {
        let j = self.rotations.len();
        let column = &mut self.columns[Self::start(j)..];
        for (i, &(c, s)) in self.rotations.iter().enumerate() {
            let (upper, lower) = (column[i], column[i + 1]);
            column[i] = c * upper + s * lower;
            column[i + 1] = c * lower - s * upper;
        }
        let radius = column[j].hypot(column[j + 1]);
        let (c, s) = if radius == 0.0 { (1.0, 0.0) } else { (column[j] / radius, column[j + 1] / radius) };
        column[j] = radius;
        self.columns.pop();
        self.rotations.push((c, s));
        let last = self.g[j];
        self.g[j] = c * last;
        self.g.push(-s * last);
        (s * last).abs()
    }

    /// Back substitution in the leading `steps` columns. A zero pivot, the mark of a singular operator, adds nothing.
    fn solve(&mut self, steps: usize) -> &[f64] {
        self.y.clear();
        self.y.extend_from_slice(&self.g[..steps]);
        for j in (0..steps).rev() {
            let column = &self.columns[Self::start(j)..=Self::start(j) + j];
            let pivot = column[j];
            self.y[j] = if pivot == 0.0 { 0.0 } else { self.y[j] / pivot };
            for i in 0..j {
                self.y[i] -= column[i] * self.y[j];
            }
        }
        &self.y
    }
}
