//! Why the finite-element flow of a case fails.

use gluey_fem::MeshError;
use gluey_stokes::{NotDriven, StokesError, WarmStartError};
use thiserror::Error;

/// A failure of the finite-element flow.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FlowError {
    /// In mesh, assembly or solution.
    #[error(transparent)]
    Stokes(#[from] StokesError),
    /// The box is not made of cubes.
    #[error(
        "[domain]: a box of {extent:?} is not a small number of cubes; make the ratios of its edges simple, such as 2:1"
    )]
    Box {
        /// Edge lengths.
        extent: Vec<f64>,
    },
    /// What the next prediction starts from could not be turned into bytes or back.
    #[error("the flow to start from cannot be stored or read")]
    Stored(#[from] postcard::Error),
    /// A flow to start from that is of other particles.
    #[error("the flow to start from is one around {saved} particles, not {present}")]
    Particles {
        /// Particles of the stored flow.
        saved: usize,
        /// Particles here.
        present: usize,
    },
    /// What drives a suspension is less than what particles that repel each other need at rest.
    #[error(transparent)]
    NotDriven(#[from] NotDriven),
    /// A flow to start from that is of another mesh.
    #[error(transparent)]
    WarmStart(#[from] WarmStartError),
}

impl From<MeshError> for FlowError {
    fn from(error: MeshError) -> Self {
        Self::Stokes(error.into())
    }
}
