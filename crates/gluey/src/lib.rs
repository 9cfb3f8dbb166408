//! Rigid particles in a Stokes flow, kept apart by the gluey contact model of Verdon et al. (2010).
//!
//! A [`Case`] says what to run, [`run()`] runs it, a [`RunReport`] says what came out.

pub mod case;
mod checkpoint;
mod interpolate;
pub mod output;
mod phases;
pub mod progress;
pub mod reference;
mod report;
mod run;
mod simulation;
mod trajectory;

pub use case::{Case, CaseError, Formulation, Strategy};
pub use checkpoint::{CaseDifference, Checkpoint, CheckpointError};
pub use output::OutputError;
pub use phases::PhaseTable;
pub use progress::{Progress, ProgressState, Silent};
pub use report::RunReport;
pub use run::{HydrodynamicsError, RunError, RunOptions, VtkOptions, run};
pub use simulation::{Simulation, SimulationState, StepError};
pub use trajectory::{Row, Trajectory};
