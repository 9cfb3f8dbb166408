//! Rigid particles in a Stokes flow, kept apart by the gluey contact model of Verdon et al. (2010).
//!
//! A [`Case`] says what to run, [`run()`] runs it, a [`RunReport`] says what came out.

pub mod case;
pub mod progress;
pub mod reference;
mod report;
mod run;

pub use case::{Case, CaseError, Formulation, Strategy};
pub use progress::{Progress, ProgressState, Silent};
pub use report::RunReport;
pub use run::{RunError, RunOptions, VtkOptions, run};
