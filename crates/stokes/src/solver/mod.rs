//! The linear solvers behind one trait.

mod direct;
mod kind;
mod multigrid;

use crate::error::StokesError;
use crate::formulation::Problem;
use crate::operator::StokesSystem;
use crate::space::Discretisation;

pub use direct::DirectSolver;
pub use kind::SolverKind;
pub use multigrid::MultigridSolver;

/// Effort and residuals of a linear solve.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveReport {
    /// Krylov iterations, or corrections by a direct solver.
    pub iterations: usize,
    /// Applications of the operator on the finest mesh, in `f64` or `f32`, by the Krylov method, by smoothers
    /// and for residuals. One that leaves cells out counts as its share of the mesh's cells that are not
    /// rigid.
    pub fine_operator_applications: f64,
    /// Norm of the residual at the start and after each iteration; the last is the true one.
    pub residuals: Vec<f64>,
    /// The norm that the tolerance is relative to, see [`StokesSystem::fluid_norm`].
    pub reference: f64,
}

/// Solves `[A, -B^T; -B, 0] x = b` for reduced vectors of a [`StokesSystem`].
pub trait SaddleSolver<const D: usize> {
    /// Builds what depends on the system: factors, levels, preconditioners.
    fn prepare(&mut self, problem: &Problem<D>) -> Result<(), StokesError>;

    /// Solves from the guess in `x` to a true residual of at most `tolerance` times
    /// [`StokesSystem::fluid_norm`] of `b` and says what it took; rows of the films' motions hold exactly.
    /// The divergences in `b` sum to zero, as those of [`StokesSystem::residual`] do.
    fn solve(
        &mut self,
        system: &StokesSystem<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<SolveReport, StokesError>;

    /// Takes parts of meshes for the levels below those of the systems, which ranks share, and gives up after
    /// so many iterations.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] for solvers on whole meshes only.
    fn share(&mut self, _coarser: &[Discretisation<D>], _max_iterations: usize) -> Result<(), StokesError> {
        Err(StokesError::Unsupported { what: "flows on ranks by this solver" })
    }
}
