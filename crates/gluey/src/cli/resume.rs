//! `gluey resume`.

use std::path::PathBuf;

use clap::Args;
use gluey::{Case, FolderError, ResumeError, Resumption, RunOptions};

use super::failure::Failure;
use super::interrupt::interrupt_flag;
use super::manner::Manner;
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

impl ResumeArguments {
    /// Runs to the end.
    pub fn run(&self) -> Result<(), Failure> {
        self.manner.set_threads()?;
        let found = Resumption::find(&self.folder, self.case.as_deref(), self.previous);
        let Resumption { case_file, options } = found.map_err(|error| {
            let hint = self.hint(&error);
            Failure::new(error, hint)
        })?;
        let case = Case::load(&case_file)?;
        let options = RunOptions { interrupt: Some(interrupt_flag()), ..options };
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
            ResumeError::Complete { .. } | ResumeError::Record(_) => return None,
        })
    }
}
