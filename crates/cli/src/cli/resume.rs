//! `gluey resume`.

use std::path::PathBuf;

use clap::Args;
use gluey::case::Override;
use gluey::{Case, FolderError, ResumeError, Resumption};

use super::failure::Failure;
use super::interrupt::Requests;
use super::run_mode::Manner;
use crate::terminal::print_report;

/// Arguments of `gluey resume`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gluey resume out\n  gluey resume out --case pair-2d-gluey --previous\n  gluey resume out \
                  --set time.end=20"
)]
pub struct ResumeArguments {
    /// Folder of the results.
    folder: PathBuf,
    /// The run to go on with, where there are several in the folder: what its files begin with.
    #[arg(long, value_name = "NAME")]
    case: Option<String>,
    /// Go on to another end, time.end=20, also with a run that is complete; repeatable.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// Go on from the checkpoint before the last.
    #[arg(long)]
    previous: bool,
    #[command(flatten)]
    manner: Manner,
}

impl ResumeArguments {
    /// Runs to the end.
    pub fn run(&self) -> Result<(), Failure> {
        self.manner.set_threads()?;
        let failure = |error| {
            let hint = self.hint(&error);
            Failure::new(error, hint)
        };
        let found = Resumption::find_to_prolong(&self.folder, self.case.as_deref(), self.previous);
        let found = found.map_err(failure)?;
        let case = Case::load_with(&found.case_file, &self.set)?;
        let Resumption { case_file, options, .. } = found.to_end_at(case.step_count()).map_err(failure)?;
        let options = Requests::listen(&case_file).heeded_by(options);
        let report = self.manner.run(&case, &options, &case_file)?;
        self.manner.tell(&report, |report| print_report(report, &options.csv));
        Ok(())
    }

    /// What can be done instead.
    fn hint(&self, error: &ResumeError) -> Option<String> {
        Some(match error {
            ResumeError::Folder(FolderError::Study { .. }) => {
                "all of it goes on with the same `gluey sweep` once more".into()
            }
            ResumeError::Folder(_) => "give the folder that a run wrote to, the DIR of its --out".into(),
            ResumeError::Several { names, .. } | ResumeError::Unknown { names, .. } => {
                format!("choose one, such as --case {}", names[0])
            }
            ResumeError::NoCheckpoint { has_other: true, .. } if self.previous => {
                "go on from the last one, without --previous".into()
            }
            ResumeError::NoCheckpoint { has_other: true, .. } => {
                "go on from the one before it, with --previous".into()
            }
            ResumeError::NoCheckpoint { case_file, .. } => {
                format!("start again: gluey run {} --out {}", case_file.display(), self.folder.display())
            }
            ResumeError::Complete { has_checkpoint: false, .. } => {
                "it left no checkpoint to go on from to a later end: start again, with gluey run".into()
            }
            ResumeError::Complete { .. } => {
                format!("to go on to a later end: gluey resume {} --set time.end=T", self.folder.display())
            }
            ResumeError::Record(_) => return None,
        })
    }
}
