//! Arguments of the command, and what they ask of the library.

mod failure;
mod interrupt;
mod manner;
mod resume;
mod run;
mod view;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use gluey::analyse::AnalyseOptions;

use crate::terminal;
pub use failure::Failure;
use resume::ResumeArguments;
use run::RunArguments;
use view::ViewArguments;

/// Rigid particles in a Stokes flow with the gluey contact model.
#[derive(Debug, Parser)]
#[command(version, about)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a case and write its trajectory.
    Run(RunArguments),
    /// Go on with a run that was interrupted, killed or stopped by an error.
    Resume(ResumeArguments),
    /// Structure and statistics of the particles that a run wrote with --xyz.
    Analyse(AnalyseArguments),
    /// A page for the browser that shows the particles that a run wrote with --xyz.
    View(ViewArguments),
}

impl Command {
    /// Does it.
    pub fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Run(arguments) => arguments.run(),
            Self::Resume(arguments) => arguments.run(),
            Self::Analyse(arguments) => arguments.run(),
            Self::View(arguments) => arguments.run(),
        }
    }
}

/// Arguments of `gluey analyse`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example:\n  gluey run suspension.toml --out out --xyz 10\n  gluey analyse out")]
pub struct AnalyseArguments {
    /// Folder of a run, or of its files in extended XYZ.
    folder: PathBuf,
    /// Folder for the tables; that of the run when absent.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Gap up to which particles count as in contact, in mean radii.
    #[arg(long, value_name = "GAP", default_value_t = 0.05)]
    reach: f64,
    /// Frames to leave out at the beginning, instead of the transient that is found.
    #[arg(long, value_name = "N")]
    skip: Option<usize>,
}

impl AnalyseArguments {
    fn run(&self) -> Result<(), Failure> {
        let summary = gluey::analyse::analyse(&self.options()).map_err(|error| Failure::new(error, None))?;
        terminal::print_summary(&summary);
        Ok(())
    }

    fn options(&self) -> AnalyseOptions {
        let Self { folder, out, reach, skip } = self.clone();
        AnalyseOptions { folder, out, reach_over_a: reach, skip }
    }
}
