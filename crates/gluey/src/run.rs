//! Runs a case from beginning to end.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use thiserror::Error;

use crate::case::{Case, CaseError};
use crate::progress::Progress;
use crate::report::RunReport;

/// What a run writes, and where.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// The trajectory, one row a step; its folder is created when missing.
    pub csv: PathBuf,
    /// Fields and particles for ParaView.
    pub vtk: Option<VtkOptions>,
    /// Where to write checkpoints: at interrupts, and as often as `checkpoint_every` says.
    pub checkpoint: Option<PathBuf>,
    /// Steps between checkpoints.
    pub checkpoint_every: Option<usize>,
    /// A checkpoint of the same case to go on from.
    pub resume: Option<PathBuf>,
    /// Set from outside to stop after the current step.
    pub interrupt: Option<Arc<AtomicBool>>,
}

/// Output for ParaView.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VtkOptions {
    /// Folder for the files.
    pub folder: PathBuf,
    /// Steps between files, at least 1.
    pub every: usize,
}

impl RunOptions {
    /// Writes the trajectory to `csv` and nothing else.
    pub fn csv(csv: impl Into<PathBuf>) -> Self {
        Self { csv: csv.into(), ..Self::default() }
    }
}

/// A run came to nothing.
#[derive(Debug, Error)]
pub enum RunError {
    /// The case makes no sense.
    #[error(transparent)]
    Case(#[from] CaseError),
}

/// Runs `case`, writes what `options` ask for and reports to `progress`.
pub fn run(case: &Case, _options: &RunOptions, _progress: &dyn Progress) -> Result<RunReport, RunError> {
    case.check()?;
    Err(RunError::Case(CaseError::Read {
        path: PathBuf::from(&case.name),
        source: std::io::ErrorKind::Unsupported.into(),
    }))
}
