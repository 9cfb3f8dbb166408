//! The linear solvers by name.

use super::SaddleSolver;
use super::direct::DirectSolver;
use super::multigrid::MultigridSolver;
use crate::dimension::in_dimension;

/// A linear solver by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolverKind {
    /// Sparse direct factorisation.
    Direct,
    /// Krylov method with a multigrid preconditioner.
    Multigrid,
}

impl SolverKind {
    /// A solver of this kind.
    pub(crate) fn solver<const D: usize>(self) -> Box<dyn SaddleSolver<D> + Send> {
        in_dimension(|| self.in_2d(), || self.in_3d())
    }

    fn in_2d(self) -> Box<dyn SaddleSolver<2> + Send> {
        match self {
            Self::Direct => Box::new(DirectSolver::default()),
            Self::Multigrid => Box::new(MultigridSolver::default()),
        }
    }

    fn in_3d(self) -> Box<dyn SaddleSolver<3> + Send> {
        match self {
            Self::Direct => Box::new(DirectSolver::default()),
            Self::Multigrid => Box::new(MultigridSolver::default()),
        }
    }
}
