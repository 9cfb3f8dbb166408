//! Why a run failed.

use std::path::PathBuf;

use gluey_parallel::RankFailure;
use thiserror::Error;

use super::last_steps::Ended;
use super::overwrite_guard::OccupiedError;
use crate::case::CaseError;
use crate::checkpoint::CheckpointError;
use crate::hydrodynamics::HydrodynamicsError;
use crate::memory::TooLarge;
use crate::number_text::shown;
use crate::output::{ClaimError, FileError, RowsError};
use crate::rheology::RheologyError;
use crate::simulation::StepError;

/// A reason why a run failed.
#[derive(Debug, Error)]
pub enum RunError {
    /// The case makes no sense.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// Nothing in the case is wrong, but its mesh does not fit into this machine.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// Something could not be written.
    #[error(transparent)]
    Output(#[from] FileError),
    /// Another run is writing the same results.
    #[error(transparent)]
    InUse(ClaimError),
    /// The results of another run are where this one would write.
    #[error(transparent)]
    Occupied(#[from] OccupiedError),
    /// Rows on disk could not be gone on with.
    #[error(transparent)]
    Rows(RowsError),
    /// A checkpoint could not be used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// Several ranks cannot share such a case.
    #[error("several ranks cannot share {what}")]
    NotShared {
        /// What the case or the options ask for.
        what: &'static str,
    },
    /// Another rank of those that share the run failed.
    #[error(transparent)]
    Elsewhere(RankFailure),
    /// The flow could not be set up.
    #[error("the flow could not be set up")]
    Flow(#[from] HydrodynamicsError),
    /// What the next step starts from could not be kept.
    #[error("the flow could not be kept for a checkpoint")]
    Store(#[source] HydrodynamicsError),
    /// The means of the rheology could not be taken.
    #[error(transparent)]
    Rheology(#[from] RheologyError),
    /// A step failed.
    #[error(transparent)]
    Step(#[from] StepError<HydrodynamicsError>),
    /// A particle touched the boundary of the box, where the flow is prescribed.
    #[error(
        "particle {particle} reached the boundary of the box in step {step} (t = {}): it sticks out by {excess:.3e}",
        shown(*time)
    )]
    LeftBox {
        /// Its number, from 1.
        particle: usize,
        /// Steps done.
        step: usize,
        /// Time.
        time: f64,
        /// How far.
        excess: f64,
    },
    /// The program is at fault: something that it takes for granted did not hold, in any of its threads.
    #[error("an internal error in step {step} (t = {}): {message}", shown(*time))]
    Panicked {
        /// Steps done.
        step: usize,
        /// Time.
        time: f64,
        /// What did not hold.
        message: String,
    },
    /// The run was asked to stop.
    #[error(transparent)]
    Interrupted(#[from] Ended),
    /// The run failed, and can go on from the last good step.
    #[error("the run stopped; {} holds it after {step} good steps", checkpoint.display())]
    Stopped {
        /// Steps done.
        step: usize,
        /// Where the run can go on from.
        checkpoint: PathBuf,
        /// The error.
        #[source]
        cause: Box<RunError>,
    },
}

impl From<ClaimError> for RunError {
    fn from(error: ClaimError) -> Self {
        match error {
            ClaimError::Output(error) => Self::Output(error),
            in_use => Self::InUse(in_use),
        }
    }
}

impl From<RowsError> for RunError {
    fn from(error: RowsError) -> Self {
        match error {
            RowsError::Output(error) => Self::Output(error),
            other => Self::Rows(other),
        }
    }
}
