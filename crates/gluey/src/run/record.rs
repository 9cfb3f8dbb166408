//! The record of a run, `<stem>-run.json` beside its results: what was run by whom, how, and how it went.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::options::{RunOptions, VtkOptions, XyzOptions};
use crate::output::{FileError, ResultPaths, write_atomically};
use crate::report::RunReport;

/// Counts changes of the layout of [`RunRecord`].
const LAYOUT: u32 = 1;

/// The record of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// Layout of this record.
    pub layout: u32,
    /// Version of gluey.
    pub gluey: String,
    /// Name of the case.
    pub case: String,
    /// Seed of the particles, where they were generated.
    pub seed: Option<u64>,
    /// Threads.
    pub threads: usize,
    /// The machine.
    pub machine: Machine,
    /// Number of the process.
    pub process: u32,
    /// When the run was started, in UTC.
    pub started: String,
    /// How often it was gone on with.
    pub resumed: usize,
    /// When it ended, in UTC; absent while it runs.
    pub ended: Option<String>,
    /// How it is.
    pub state: RunState,
    /// Why it stopped, where it did.
    pub error: Option<String>,
    /// Steps in all.
    pub steps: usize,
    /// Steps done when this was written; [`RunRecord::rows_on_disk`] knows of more.
    pub steps_done: usize,
    /// Name of the file that its rows are in until it is complete.
    #[serde(default)]
    pub rows: Option<String>,
    /// Output that was asked for.
    pub options: RecordedOptions,
    /// What came out, once the run is complete.
    pub report: Option<RunReport>,
}

/// The machine of a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Operating system.
    pub os: String,
    /// Architecture.
    pub arch: String,
    /// Processors that the run may use.
    pub cpus: usize,
}

/// The state of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunState {
    /// It runs, or its process was killed.
    Running,
    /// It came to its end.
    Complete,
    /// It was asked to stop.
    Interrupted,
    /// It stopped with an error.
    Failed,
}

impl fmt::Display for RunState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Running => "running",
            Self::Complete => "complete",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
        })
    }
}

/// Output of a run, as its record keeps it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordedOptions {
    /// Fields and particles for ParaView.
    pub vtk: Option<VtkOptions>,
    /// Particles in extended XYZ.
    pub xyz: Option<XyzOptions>,
    /// Steps between checkpoints.
    pub checkpoint_every: Option<usize>,
    /// Minutes between checkpoints.
    pub checkpoint_minutes: Option<f64>,
}

/// A record could not be read.
#[derive(Debug, Error)]
pub enum RecordError {
    /// The file could not be read.
    #[error(transparent)]
    Read(#[from] FileError),
    /// It is another kind of file.
    #[error("{}: not the record of a run", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Why.
        source: serde_json::Error,
    },
    /// It was written by another version of the program.
    #[error("{}: layout {found} of a record; this program reads layout {LAYOUT}", path.display())]
    Layout {
        /// The file.
        path: PathBuf,
        /// Its layout.
        found: u64,
    },
}

impl RunRecord {
    /// A run that starts now.
    pub(super) fn new(name: &str, options: &RunOptions) -> Self {
        Self {
            layout: LAYOUT,
            gluey: env!("CARGO_PKG_VERSION").to_owned(),
            case: name.to_owned(),
            seed: None,
            threads: rayon::current_num_threads(),
            machine: Machine::this(),
            process: std::process::id(),
            started: now(),
            resumed: 0,
            ended: None,
            state: RunState::Running,
            error: None,
            steps: 0,
            steps_done: 0,
            rows: None,
            options: RecordedOptions::of(options),
            report: None,
        }
    }

    /// Reads a record.
    ///
    /// # Errors
    /// [`RecordError`] if it is not there, not a record, or of another layout.
    pub fn read(path: &Path) -> Result<Self, RecordError> {
        let path = path.to_owned();
        let text = fs::read_to_string(&path).map_err(|error| FileError::unread(&path, error))?;
        let foreign = |source| RecordError::Foreign { path: path.clone(), source };
        let value: serde_json::Value = serde_json::from_str(&text).map_err(foreign)?;
        match value.get("layout").and_then(serde_json::Value::as_u64) {
            Some(found) if found != u64::from(LAYOUT) => Err(RecordError::Layout { path, found }),
            _ => serde_json::from_value(value).map_err(foreign),
        }
    }

    /// The file beside this record, of the run `paths`, that its rows are in now, and how many whole rows
    /// that are: one for each step done, and one for the step that it is at, or was when it ended.
    pub fn rows_on_disk(&self, paths: &ResultPaths) -> Option<(PathBuf, usize)> {
        let draft = self.rows.as_ref().map(|name| paths.csv().with_file_name(name));
        let file = draft.filter(|draft| draft.exists()).unwrap_or(paths.csv());
        let text = fs::read(&file).ok()?;
        let lines = text.iter().filter(|&&byte| byte == b'\n').count();
        Some((file, lines.saturating_sub(1)))
    }

    /// Writes it, all or nothing.
    pub(super) fn write(&self, path: &Path) -> Result<(), FileError> {
        let encoded = serde_json::to_string_pretty(self).map_err(io::Error::from);
        let text = encoded.map_err(|error| FileError::new(path, "encode the record", error))?;
        write_atomically(path, format!("{text}\n").as_bytes())
    }

    /// Notes that the run ended.
    pub(super) fn end(&mut self, state: RunState, steps_done: usize) {
        (self.state, self.steps_done, self.ended) = (state, steps_done, Some(now()));
    }
}

impl Machine {
    /// The machine this runs on.
    pub fn this() -> Self {
        Self {
            os: std::env::consts::OS.to_owned(),
            arch: std::env::consts::ARCH.to_owned(),
            cpus: available_parallelism().map_or(1, usize::from),
        }
    }
}

impl RecordedOptions {
    fn of(options: &RunOptions) -> Self {
        Self {
            vtk: options.vtk.clone(),
            xyz: options.xyz.clone(),
            checkpoint_every: options.checkpoint_every,
            checkpoint_minutes: options.checkpoint_minutes,
        }
    }
}

/// An error with all its causes.
pub fn in_full(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |cause| cause.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

/// The date and time in UTC (RFC 3339), to seconds.
pub(super) fn now() -> String {
    humantime::format_rfc3339_seconds(std::time::SystemTime::now()).to_string()
}
