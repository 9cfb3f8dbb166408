//! How to go on with a run of which a folder holds the results.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::options::{RecordOptions, RunOptions};
use super::record::{RecordError, RunRecord, RunState};
use super::runs_of_folder::{FolderError, recorded_runs};
use crate::output::ResultPaths;

/// A run to go on with: its case file and its options, at the places where its results are now.
#[derive(Clone, Debug)]
pub struct Resumption {
    /// The case as it was run.
    pub case_file: PathBuf,
    /// The options of the run, with the checkpoint to go on from.
    pub options: RunOptions,
    /// Its steps, where it is complete: it can go on to a later end only.
    pub complete: Option<usize>,
}

/// There is nothing to resume.
#[derive(Debug, Error)]
pub enum ResumeError {
    /// The folder has no runs.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// It has several.
    #[error("{}: {} runs are recorded there: {}", folder.display(), names.len(), names.join(", "))]
    Several {
        /// The folder.
        folder: PathBuf,
        /// What the files of each begin with.
        names: Vec<String>,
    },
    /// It has others.
    #[error("{}: no run `{name}` is recorded there, but {}", folder.display(), names.join(", "))]
    Unknown {
        /// The folder.
        folder: PathBuf,
        /// The one that was asked for.
        name: String,
        /// What the files of each begin with.
        names: Vec<String>,
    },
    /// The record cannot be read.
    #[error("the record of the run cannot be used")]
    Record(#[from] RecordError),
    /// The run is complete.
    #[error("{}: the run is complete ({steps} steps): nothing is left to do", record.display())]
    Complete {
        /// The record.
        record: PathBuf,
        /// Steps in all.
        steps: usize,
        /// Whether it left a checkpoint, from which it can go on to a later end.
        has_checkpoint: bool,
    },
    /// There is no checkpoint, as when the run ended before its first one.
    #[error("{}: there is no such checkpoint", checkpoint.display())]
    NoCheckpoint {
        /// The file that is not there.
        checkpoint: PathBuf,
        /// Whether the other generation is.
        has_other: bool,
        /// The case as it was run.
        case_file: PathBuf,
    },
}

impl Resumption {
    /// Finds the run in `folder`, the one of this name if there are several, that goes on from its last
    /// checkpoint or from the one before it.
    ///
    /// # Errors
    /// [`ResumeError`] if there is no such run or checkpoint, or nothing left to do.
    pub fn find(folder: &Path, name: Option<&str>, previous: bool) -> Result<Self, ResumeError> {
        Self::find_to_prolong(folder, name, previous)?.to_end_at(0)
    }

    /// The same, but for runs that are complete, too: [`Resumption::to_end_at`] tells whether anything is
    /// left to do.
    ///
    /// # Errors
    /// [`ResumeError`] if there is no such run or checkpoint.
    pub fn find_to_prolong(folder: &Path, name: Option<&str>, previous: bool) -> Result<Self, ResumeError> {
        let paths = choose(folder, name)?;
        let record = RunRecord::read(&paths.record())?;
        let complete = (record.state == RunState::Complete).then_some(record.steps);
        let (last, before) = (paths.checkpoint(), paths.previous_checkpoint());
        let (checkpoint, other) = if previous { (before, last) } else { (last, before) };
        if let (Some(steps), false) = (complete, checkpoint.exists()) {
            let record = paths.record();
            return Err(ResumeError::Complete { record, steps, has_checkpoint: false });
        }
        if !checkpoint.exists() {
            let (has_other, case_file) = (other.exists(), paths.case_file());
            return Err(ResumeError::NoCheckpoint { checkpoint, has_other, case_file });
        }
        Ok(Self { case_file: paths.case_file(), options: options(&paths, record, checkpoint), complete })
    }

    /// This, if the run does not end before so many steps.
    ///
    /// # Errors
    /// [`ResumeError::Complete`] if nothing is left to do.
    pub fn to_end_at(self, steps: usize) -> Result<Self, ResumeError> {
        match self.complete {
            Some(done) if steps <= done => {
                let record = ResultPaths::of_csv(&self.options.csv).record();
                Err(ResumeError::Complete { record, steps: done, has_checkpoint: true })
            }
            _ => Ok(self),
        }
    }
}

/// The run of this name in a folder, or the only one.
fn choose(folder: &Path, name: Option<&str>) -> Result<ResultPaths, ResumeError> {
    let folder = folder.to_owned();
    let runs = recorded_runs(&folder)?;
    let names: Vec<String> = runs.iter().map(ResultPaths::stem).collect();
    match (name, &runs[..]) {
        (Some(name), _) => match runs.iter().find(|run| run.stem() == name) {
            Some(run) => Ok(run.clone()),
            None => Err(ResumeError::Unknown { folder, name: name.to_owned(), names }),
        },
        (None, [run]) => Ok(run.clone()),
        (None, _) => Err(ResumeError::Several { folder, names }),
    }
}

/// The options of the run that left `record`, at the places where its results are now.
fn options(paths: &ResultPaths, record: RunRecord, checkpoint: PathBuf) -> RunOptions {
    let recorded = record.options;
    let (mut vtk, mut xyz) = (recorded.vtk, recorded.xyz);
    if let Some(vtk) = &mut vtk {
        vtk.folder = paths.vtk();
    }
    if let Some(xyz) = &mut xyz {
        xyz.folder = paths.xyz();
    }
    RunOptions {
        csv: paths.csv(),
        vtk,
        xyz,
        checkpoint: Some(paths.checkpoint()),
        checkpoint_every: recorded.checkpoint_every,
        checkpoint_minutes: recorded.checkpoint_minutes,
        record: Some(RecordOptions { force: false }),
        resume: Some(checkpoint),
        ..RunOptions::default()
    }
}
