//! Why a simulation cannot go on.

use gluey_contact::{ContactError, FilmError, GapError, MemoryError};
use gluey_motion::{NoForces, ResumeError};
use thiserror::Error;

use super::part::Part;
use crate::number_text::shown;

/// A step could not be done.
#[derive(Debug, Error)]
pub enum StepError<E: std::error::Error + 'static> {
    /// The flow could not be computed.
    #[error("the flow failed in step {step} (t = {})", shown(*time))]
    Flow {
        /// Steps done before.
        step: usize,
        /// Time at the start of the step.
        time: f64,
        /// Why.
        source: E,
    },
    /// Particles repel each other, and the model of their motion does not answer to forces.
    #[error("forces failed in step {step} (t = {})", shown(*time))]
    Forces {
        /// Steps done before.
        step: usize,
        /// Time at the start of the step.
        time: f64,
        /// Why.
        source: NoForces,
    },
    /// Contact could not be resolved.
    #[error("contact failed in step {step} (t = {})", shown(*time))]
    Contact {
        /// Steps done before.
        step: usize,
        /// Time at the start of the step.
        time: f64,
        /// Why.
        source: ContactError,
    },
    /// A film could not be kept open.
    #[error("motion failed in step {step} (t = {}), also with a time step of {}", shown(*time), shown(*length))]
    Film {
        /// Steps done before.
        step: usize,
        /// Time at the start of the step, or of the part of it.
        time: f64,
        /// The time step, the smallest that was tried.
        length: f64,
        /// Why.
        source: FilmError,
    },
    /// A velocity is infinite or not a number.
    #[error("the velocity of particle {particle} is not finite in step {step} (t = {})", shown(*time))]
    NotFinite {
        /// Its number, from 1.
        particle: usize,
        /// Steps done before.
        step: usize,
        /// Time at the start of the step.
        time: f64,
    },
}

impl<E: std::error::Error + 'static> StepError<E> {
    /// The same for a wider type of flow errors.
    pub fn widen<W: std::error::Error + From<E> + 'static>(self) -> StepError<W> {
        match self {
            Self::Flow { step, time, source } => StepError::Flow { step, time, source: source.into() },
            Self::Forces { step, time, source } => StepError::Forces { step, time, source },
            Self::Contact { step, time, source } => StepError::Contact { step, time, source },
            Self::Film { step, time, length, source } => StepError::Film { step, time, length, source },
            Self::NotFinite { particle, step, time } => StepError::NotFinite { particle, step, time },
        }
    }
}

/// A simulation cannot go on from a state.
#[derive(Debug, Error)]
pub enum RestoreError<E: std::error::Error + 'static> {
    /// It is of other particles.
    #[error("the state is one of {saved} particles, which are not the {present} particles here")]
    Particles {
        /// Particles of the state.
        saved: usize,
        /// Particles of the simulation.
        present: usize,
    },
    /// Its flow does not fit.
    #[error(transparent)]
    Flow(#[from] ResumeError<E>),
    /// Its contacts are none.
    #[error(transparent)]
    Contact(#[from] MemoryError),
}

impl<E: std::error::Error + 'static> RestoreError<E> {
    /// The same for a wider type of flow errors.
    pub fn widen<W: std::error::Error + From<E> + 'static>(self) -> RestoreError<W> {
        match self {
            Self::Particles { saved, present } => RestoreError::Particles { saved, present },
            Self::Flow(error) => RestoreError::Flow(error.widen()),
            Self::Contact(error) => RestoreError::Contact(error),
        }
    }
}

/// Half of this part of a step, if that may help where gaps cannot be corrected in it.
pub(super) fn half_after(error: &GapError, part: Part, most_halvings: u32) -> Option<Part> {
    let is_given = matches!(error, GapError::Film(source) if source.is_given());
    part.halved(most_halvings).filter(|_| !is_given)
}

/// The end of a step that begins at this time, where the smallest one that was tried has this length.
pub(super) fn end_after<E: std::error::Error>(
    error: GapError,
    step: usize,
    time: f64,
    length: f64,
) -> StepError<E> {
    match error {
        GapError::Film(source) => StepError::Film { step, time, length, source },
        GapError::Contact(source) => StepError::Contact { step, time, source },
    }
}
