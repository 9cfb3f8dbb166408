//! `gluey resume`.

use std::path::PathBuf;

use clap::Args;
use gluey::{Case, RecordError, RecordOptions, ResultPaths, RunOptions, RunRecord, RunState};
use thiserror::Error;

use super::failure::Failure;
use super::interrupt::interrupt_flag;
use super::manner::Manner;
use super::recorded::{FolderError, recorded_runs};
use crate::terminal::print_report;

/// Arguments of `gluey resume`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  gluey resume out\n  gluey resume out --case pair-2d-gluey --previous")]
pub struct ResumeArguments {
    /// Folder of the results.
    folder: PathBuf,
    /// The run to go on with, where there are several in the folder: what its files begin with.
    #[arg(long, value_name = "NAME")]
    case: Option<String>,
    /// Go on from the checkpoint before the last.
    #[arg(long)]
    previous: bool,
    #[command(flatten)]
    manner: Manner,
}

/// There is nothing to resume.
#[derive(Debug, Error)]
enum ResumeError {
    /// The folder has no runs.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// It has several.
    #[error("{}: {} runs are recorded there: {}", folder.display(), names.len(), names.join(", "))]
    Several { folder: PathBuf, names: Vec<String> },
    /// It has others.
    #[error("{}: no run `{name}` is recorded there, but {}", folder.display(), names.join(", "))]
    Unknown { folder: PathBuf, name: String, names: Vec<String> },
    /// The record cannot be read.
    #[error("the record of the run cannot be used")]
    Record(#[from] RecordError),
    /// The run is complete.
    #[error("{}: the run is complete ({steps} steps): nothing is left to do", record.display())]
    Complete { record: PathBuf, steps: usize },
    /// The run ended before its first checkpoint.
    #[error("{}: there is no such checkpoint", checkpoint.display())]
    NoCheckpoint { checkpoint: PathBuf, again: String },
}

impl ResumeError {
    fn hint(&self) -> Option<String> {
        Some(match self {
            Self::Folder(_) => "give the folder that a run wrote to, the DIR of its --out".into(),
            Self::Several { names, .. } | Self::Unknown { names, .. } => {
                format!("choose one, such as --case {}", names[0])
            }
            Self::NoCheckpoint { again, .. } => again.clone(),
            Self::Complete { .. } | Self::Record(_) => return None,
        })
    }
}

impl From<ResumeError> for Failure {
    fn from(error: ResumeError) -> Self {
        let hint = error.hint();
        Self::new(error, hint)
    }
}

impl ResumeArguments {
    /// Runs to the end.
    pub fn run(&self) -> Result<(), Failure> {
        self.manner.set_threads()?;
        let paths = self.find()?;
        let record = RunRecord::read(&paths.record()).map_err(ResumeError::from)?;
        if record.state == RunState::Complete {
            return Err(ResumeError::Complete { record: paths.record(), steps: record.steps }.into());
        }
        let checkpoint = if self.previous { paths.previous_checkpoint() } else { paths.checkpoint() };
        if !checkpoint.exists() {
            let again = self.instead(&paths);
            return Err(ResumeError::NoCheckpoint { checkpoint, again }.into());
        }
        let file = paths.case_file();
        let case = Case::load(&file)?;
        let report = self.manner.run(&case, &options(&paths, record, checkpoint), &file)?;
        self.manner.tell(&report, print_report);
        Ok(())
    }

    fn find(&self) -> Result<ResultPaths, ResumeError> {
        let folder = self.folder.clone();
        let runs = recorded_runs(&folder)?;
        let names: Vec<String> = runs.iter().map(ResultPaths::stem).collect();
        match (&self.case, &runs[..]) {
            (Some(name), _) => match runs.iter().find(|run| run.stem() == *name) {
                Some(run) => Ok(run.clone()),
                None => Err(ResumeError::Unknown { folder, name: name.clone(), names }),
            },
            (None, [run]) => Ok(run.clone()),
            (None, _) => Err(ResumeError::Several { folder, names }),
        }
    }

    /// What can be done without the checkpoint that was asked for.
    fn instead(&self, paths: &ResultPaths) -> String {
        let (case, folder) = (paths.case_file(), self.folder.display().to_string());
        match (self.previous, paths.checkpoint().exists(), paths.previous_checkpoint().exists()) {
            (true, true, _) => "go on from the last one, without --previous".into(),
            (false, _, true) => "go on from the one before it, with --previous".into(),
            _ => format!("start again: gluey run {} --out {folder}", case.display()),
        }
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
        interrupt: Some(interrupt_flag()),
    }
}
