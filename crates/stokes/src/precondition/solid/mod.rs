//! The preconditioner of the penalised solid, beside the rigid levels.

mod assembly;
mod correction;
mod multigrid;
mod numbered;
mod smoother;

pub use correction::PenalisedCorrection;
