//! Why a flow could not be computed.

use gluey_fem::MeshError;
use gluey_linalg::{BlockError, DirectError, KrylovError, SparseError};

/// Failure of a Stokes solve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StokesError {
    /// The mesh cannot be built.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A body is too small for the mesh.
    #[error(
        "body {body} (radius {radius}) has too few nodes on cells of size {cell_size}: refine the mesh to cells \
         smaller than the radius"
    )]
    Unresolved {
        /// Index of the body, from 0.
        body: usize,
        /// Its radius.
        radius: f64,
        /// Size of the finest cells.
        cell_size: f64,
    },
    /// A parameter is out of range.
    #[error("{name} = {value}: {wanted}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        wanted: &'static str,
    },
    /// A matrix could not be assembled.
    #[error(transparent)]
    Assembly(#[from] SparseError),
    /// The matrix of a cell is not positive definite.
    #[error(transparent)]
    Cell(#[from] BlockError),
    /// The direct solver failed.
    #[error(transparent)]
    Direct(#[from] DirectError),
    /// The Krylov method failed; the error holds the residual history.
    #[error(transparent)]
    Krylov(#[from] KrylovError),
    /// A level of the multigrid has an unknown without stiffness.
    #[error("level {level} of the multigrid cannot be smoothed: {reason}")]
    Smoother {
        /// Level, 0 is the coarsest.
        level: usize,
        /// What is wrong.
        reason: String,
    },
    /// A solve was asked for before the solver was prepared.
    #[error("the solver was not prepared for this system")]
    NotPrepared,
}
