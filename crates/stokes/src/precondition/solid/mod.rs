//! The preconditioner of the penalised solid, beside the rigid levels.

mod correction;
mod multigrid;
mod smoother;

pub use correction::PenalisedCorrection;
