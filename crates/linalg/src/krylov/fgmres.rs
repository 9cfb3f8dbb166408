//! Flexible GMRES with restarts (Saad 1993, 10.1137/0914028).
//!
//! Right preconditioned, `A M_j^-1 y = b`, where the preconditioner may change from one iteration to the next: an
//! inner iteration or a cycle in single precision is welcome. Modified Gram-Schmidt, Givens rotations.

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
#[derive(Clone, Debug)]
pub struct Fgmres<T> {
    params: FgmresParams,
    /// Orthonormal basis `v_0 .. v_k` of the Krylov space.
    basis: Vec<Vec<T>>,
    /// Preconditioned basis `z_j = M_j^-1 v_j`.
    directions: Vec<Vec<T>>,
    least_squares: LeastSquares,
    history: Vec<f64>,
}

impl<T: Scalar> Fgmres<T> {
    /// A solver with an empty workspace.
    pub fn new(params: FgmresParams) -> Self {
        let restart = params.restart.max(1);
        Self {
            params: FgmresParams { restart, ..params },
            basis: Vec::with_capacity(restart + 1),
            directions: Vec::with_capacity(restart),
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
        a: &mut (impl LinOp<T> + ?Sized),
        m: &mut (impl Preconditioner<T> + ?Sized),
        b: &[T],
        x: &mut [T],
        reference: Reference,
    ) -> Result<KrylovReport, KrylovError> {
        check_dimensions(a.dim(), b, x)?;
        self.history.clear();
        self.grow_basis(0, b.len());
        let right_hand_side_norm = finite(vector::norm(b), 0)?;
        let mut norm = finite(true_residual(a, b, x, &mut self.basis[0]), 0)?;
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

    /// Builds the Krylov space of the residual in `basis[0]` until its least-squares residual is small.
    fn cycle(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        m: &mut (impl Preconditioner<T> + ?Sized),
        norm: f64,
        target: &Target,
        iterations: &mut usize,
    ) -> Result<Cycle, KrylovError> {
        vector::scale(1.0 / norm, &mut self.basis[0]);
        self.least_squares.reset(norm);
        let mut steps = 0;
        while steps < self.params.restart && *iterations < self.params.max_iterations {
            *iterations += 1;
            let (size_before, size_after) = self.arnoldi_step(a, m, steps);
            finite(size_after, *iterations)?;
            let residual = finite(self.least_squares.close_column(), *iterations)?;
            self.history.push(residual);
            steps += 1;
            let broke_down = size_after <= T::EPSILON * size_before;
            if residual <= target.norm || broke_down {
                return Ok(Cycle { steps, broke_down });
            }
            vector::scale(1.0 / size_after, &mut self.basis[steps]);
        }
        Ok(Cycle { steps, broke_down: false })
    }

    /// `z_j = M^-1 v_j`, `w = A z_j` orthogonalised against the basis; returns the norm of `w` before and after.
    fn arnoldi_step(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        m: &mut (impl Preconditioner<T> + ?Sized),
        j: usize,
    ) -> (f64, f64) {
        self.grow_basis(j + 1, a.dim());
        let (basis, rest) = self.basis.split_at_mut(j + 1);
        let (w, z) = (&mut rest[0], &mut self.directions[j]);
        m.apply(&basis[j], z);
        a.apply(z, w);
        let before = vector::norm(w);
        for v in basis.iter() {
            let h = vector::dot(v, w);
            vector::axpy(-h, v, w);
            self.least_squares.push(h);
        }
        let after = vector::norm(w);
        self.least_squares.push(after);
        (before, after)
    }

    /// `x += Z y`, unless that is not finite, and the true residual in `basis[0]`; returns its norm.
    fn update(
        &mut self,
        a: &mut (impl LinOp<T> + ?Sized),
        b: &[T],
        x: &mut [T],
        steps: usize,
        iterations: usize,
    ) -> Result<f64, KrylovError> {
        let y = self.least_squares.solve(steps);
        let mut size = 0.0;
        for (&y, z) in y.iter().zip(&self.directions) {
            size += y.abs() * vector::norm(z);
        }
        finite(size, iterations)?;
        for (&y, z) in y.iter().zip(&self.directions) {
            vector::axpy(y, z, x);
        }
        let norm = finite(true_residual(a, b, x, &mut self.basis[0]), iterations)?;
        if let Some(last) = self.history.last_mut() {
            *last = norm;
        }
        Ok(norm)
    }

    /// Makes room for `basis[index]` and the direction before it.
    fn grow_basis(&mut self, index: usize, dim: usize) {
        if self.basis.first().is_some_and(|v| v.len() != dim) {
            self.basis.clear();
            self.directions.clear();
        }
        while self.basis.len() <= index {
            self.basis.push(vec![T::ZERO; dim]);
        }
        while self.directions.len() < index {
            self.directions.push(vec![T::ZERO; dim]);
        }
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
