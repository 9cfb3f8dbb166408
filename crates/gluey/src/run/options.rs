//! Output of a run, and its places.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::last_steps::LastSteps;
use crate::output::vtk::VtkEncoding;

/// Output of a run, and its places.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// The trajectory, one row per step; its folder is created when missing.
    pub csv: PathBuf,
    /// Fields and particles for ParaView.
    pub vtk: Option<VtkOptions>,
    /// Particles in extended XYZ, for OVITO and ASE.
    pub xyz: Option<XyzOptions>,
    /// Where to write checkpoints: at interrupts, and as often as `checkpoint_every` says.
    pub checkpoint: Option<PathBuf>,
    /// Steps between checkpoints, at least 1.
    pub checkpoint_every: Option<usize>,
    /// Minutes of wall time between checkpoints, beside those that `checkpoint_every` asks for.
    pub checkpoint_minutes: Option<f64>,
    /// Whether and how the case as run and a record of the run are written beside the trajectory.
    pub record: Option<RecordOptions>,
    /// A checkpoint of the same case to go on from.
    pub resume: Option<PathBuf>,
    /// Set from outside to stop after the current step.
    pub interrupt: Option<Arc<AtomicBool>>,
    /// Where the run keeps its last whole step for others to save.
    pub last_steps: Option<LastSteps>,
    /// The most bytes that the case may be expected to take, beside what there is.
    pub memory_limit: Option<u64>,
}

/// Options of the record of a run, see [`super::RunRecord`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordOptions {
    /// Whether the results of another run may be replaced.
    pub force: bool,
}

/// Output for ParaView.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VtkOptions {
    /// Folder for the files; a record of a run does without, for results can be moved.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Steps between files, at least 1.
    pub every: usize,
    /// How numbers are stored.
    pub encoding: VtkEncoding,
}

/// Output in extended XYZ, a file per frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct XyzOptions {
    /// Folder for the files; a record of a run does without, for results can be moved.
    #[serde(skip)]
    pub folder: PathBuf,
    /// Steps between files, at least 1.
    pub every: usize,
    /// Whether files are compressed (`.xyz.gz`).
    pub gzip: bool,
}

impl VtkOptions {
    /// Exact numbers every so many steps.
    pub fn new(folder: impl Into<PathBuf>, every: usize) -> Self {
        Self { folder: folder.into(), every, encoding: VtkEncoding::default() }
    }
}

impl RunOptions {
    /// Writes the trajectory to `csv` and nothing else.
    pub fn csv(csv: impl Into<PathBuf>) -> Self {
        Self { csv: csv.into(), ..Self::default() }
    }
}
