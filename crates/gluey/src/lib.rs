//! Rigid particles in a Stokes flow, kept apart by the gluey contact model of Verdon et al. (2010).
//!
//! A [`Case`] says what to run, [`run()`] runs it, a [`RunReport`] says what came out:
//!
//! ```
//! use gluey::{Case, RunOptions, Silent};
//!
//! fn main() -> Result<(), gluey::RunError> {
//!     let case = Case::load("../../data/cases/pair-3d-mobility.toml")?;
//!     let report = gluey::run(&case, &RunOptions::csv("../../target/pair.csv"), &Silent)?;
//!     println!("{report}");
//!     Ok(())
//! }
//! ```
//!
//! One step predicts the velocities of all particles from the flow, corrects them for contact and moves the
//! particles: `x^{n+1} = x^n + c P(u*) + drift`. [`Simulation`] does it step by step, for any
//! [`gluey_motion::Hydrodynamics`] and any [`gluey_contact::ContactModel`].
//!
//! Not for inertia (Stokes flow only), and not for particles that are not round.

pub mod case;
mod checkpoint;
mod checksum;
pub mod flow;
mod hydrodynamics;
mod interpolate;
mod measures;
pub mod memory;
mod near_pairs;
mod number_text;
pub mod output;
mod phases;
pub mod progress;
pub mod reference;
mod report;
pub mod rheology;
mod run;
mod simulation;
pub mod summary;
pub mod sweep;
pub mod table;
mod tally;
mod text;
mod trajectory;

pub use case::{Case, CaseError, Formulation, Strategy};
pub use checkpoint::{
    CaseDifference, Checkpoint, CheckpointError, CheckpointSummary, FlowPieces, TableMarks,
};
pub use flow::FlowError;
pub use hydrodynamics::HydrodynamicsError;
pub use memory::TooLarge;
pub use number_text::{shown, shown_to};
pub use output::{ClaimError, FileError, ResultPaths, RowsError};
pub use phases::PhaseTable;
pub use progress::{Notice, Progress, ProgressState, Silent};
pub use report::RunReport;
#[cfg(feature = "ranks")]
pub use run::run_shared;
pub use run::{
    Ended, FolderError, LastSteps, Machine, OccupiedError, RecordError, RecordOptions, RecordedOptions,
    ResumeError, Resumption, RunError, RunOptions, RunRecord, RunState, VtkOptions, XyzOptions, in_full,
    recorded_runs, run,
};
pub use simulation::{
    FlowIteration, RestoreError, Simulation, SimulationState, Sliding, StepError, StrainClock,
};
pub use summary::CaseSummary;
pub use tally::{StepMotion, Tally};
pub use text::NotText;
pub use trajectory::TrajectoryRow;

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// The example of the README of the repository.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct ReadmeOfAll;

/// The page of the book on another contact law.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/tutorial/contact-law.md")]
struct ContactLawTutorial;

/// The page of the book on another formulation of rigidity.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/tutorial/formulation.md")]
struct FormulationTutorial;

/// The page of the book on another flow.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/tutorial/hydrodynamics.md")]
struct HydrodynamicsTutorial;
