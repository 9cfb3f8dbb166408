//! The models that predict velocities for a case, and why they fail.

use gluey_motion::{LinearFlow, PairMobility, PairMobilityError};
use thiserror::Error;

use crate::case::{Case, Hydrodynamics};
use crate::flow::{FlowError, StokesFlow, stokes_flow};

/// The flow could not be computed.
#[derive(Debug, Error)]
pub enum HydrodynamicsError {
    /// By the analytic model of two spheres.
    #[error(transparent)]
    PairMobility(#[from] PairMobilityError),
    /// By the finite-element solver.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// By the finite-element solver on several ranks.
    #[cfg(feature = "ranks")]
    #[error(transparent)]
    Shared(#[from] gluey_distributed::SuspensionError),
    /// The model does not exist in this dimension.
    #[error("there is no {hydrodynamics} hydrodynamics in {dimension}D")]
    Unfit {
        /// The model.
        hydrodynamics: Hydrodynamics,
        /// The dimension.
        dimension: usize,
    },
}

impl HydrodynamicsError {
    /// The model of `case` does not exist in its dimension.
    pub(crate) fn unfit(case: &Case) -> Self {
        Self::Unfit { hydrodynamics: case.flow.hydrodynamics, dimension: case.dimension }
    }
}

/// The finite-element flow of `case`.
pub(crate) fn stokes<const D: usize>(case: &Case) -> Result<StokesFlow<D>, HydrodynamicsError> {
    Ok(stokes_flow(case)?)
}

/// Two spheres in the shear of `case`, unbounded.
pub(crate) fn pair_mobility(case: &Case) -> PairMobility {
    let middle = 0.5 * (case.lower()[1] + case.upper()[1]);
    let shear = LinearFlow::shear(case.shear_rate, middle);
    PairMobility::new(shear).with_gap_offset(case.flow.pair_mobility.gap_offset)
}
