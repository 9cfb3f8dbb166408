//! How rigidity is imposed: [`Formulation`] names the ways, each of which implements [`Method`] and
//! [`problem::Rigidity`].
//!
//! Another formulation is a file or folder of this room and an arm of [`Formulation::method`]. `paper` is
//! compiled with the feature of that name.

mod load;
#[cfg(feature = "paper")]
mod paper;
mod problem;
mod unfitted;

use std::sync::Arc;

use gluey_fem::TreeMesh;
use gluey_levelset::Ball;

use crate::dimension::in_dimension;
use crate::error::StokesError;
use crate::film::Lubrication;
use crate::space::Discretisation;

#[cfg(feature = "paper")]
pub use paper::{PaperParams, ParticleVelocity, PointMatrices, SolidRegion};
pub use problem::{FlowData, Method, Problem, check_viscosity, symmetric, symmetric_and_traceless};
#[cfg(test)]
pub use unfitted::Unfitted;

/// Formulation: the way in which rigidity is imposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Formulation {
    /// Penalty and Uzawa multiplier of the paper.
    #[cfg(feature = "paper")]
    Paper(PaperParams),
    /// Nitsche's conditions on the true surfaces, with aggregated elements.
    Unfitted {
        /// Treatment of films that are too thin for the mesh.
        lubrication: Lubrication,
    },
}

impl Formulation {
    /// The formulation with all it keeps from mesh to mesh.
    ///
    /// # Errors
    /// [`StokesError::Parameter`] for a value out of range.
    pub(crate) fn method<const D: usize>(&self) -> Result<Arc<dyn Method<D>>, StokesError> {
        self.check()?;
        Ok(in_dimension(|| self.method_in_2d(), || self.method_in_3d()))
    }

    fn method_in_2d(&self) -> Arc<dyn Method<2>> {
        self.checked_method()
    }

    fn method_in_3d(&self) -> Arc<dyn Method<3>> {
        self.checked_method()
    }

    fn checked_method<const D: usize>(&self) -> Arc<dyn Method<D>> {
        match *self {
            #[cfg(feature = "paper")]
            Self::Paper(params) => Arc::new(paper::Paper::new(params)),
            Self::Unfitted { lubrication } => Arc::new(unfitted::Unfitted::new(lubrication)),
        }
    }

    /// # Errors
    /// [`StokesError::Parameter`] for a value out of range.
    pub(crate) fn check(&self) -> Result<(), StokesError> {
        match self {
            #[cfg(feature = "paper")]
            Self::Paper(params) => params.check(),
            Self::Unfitted { .. } => Ok(()),
        }
    }
}

impl<const D: usize> Problem<D> {
    /// The problem on `mesh` around `bodies` in a fluid of the given viscosity.
    ///
    /// # Errors
    /// [`StokesError::Parameter`] for values out of range, [`StokesError::Unresolved`] for a body smaller
    /// than a cell.
    pub fn new(
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
        viscosity: f64,
        formulation: Formulation,
    ) -> Result<Self, StokesError> {
        Self::on(&Discretisation::new(mesh), bodies, viscosity, formulation.method()?.as_ref())
    }
}
