//! Arguments of the command, and what they ask of the library.

mod check;
mod completions;
mod failure;
mod info;
mod interrupt;
mod new;
mod output;
mod plot;
mod resume;
mod run;
mod run_mode;
mod schema;
mod sweep;
mod view;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use gluey_view::AnalyseOptions;

use crate::terminal;
use check::CheckArguments;
use completions::CompletionsArguments;
pub use failure::Failure;
use info::InfoArguments;
use new::NewArguments;
use plot::PlotArguments;
use resume::ResumeArguments;
use run::RunArguments;
use schema::SchemaArguments;
use sweep::SweepArguments;
use view::ViewArguments;

/// What `gluey --help` ends with; the exit codes are also in the README.
const AFTER_HELP: &str = "\
Examples:
  gluey new doublet
  gluey run doublet.toml --out out
  gluey resume out

Exit codes:
  0    done
  1    failed: what, where and what to do about it is on standard error
  2    arguments that make no sense
  130  interrupted (Ctrl-C, SIGTERM, SIGHUP); `gluey resume` goes on";

/// Rigid particles in a Stokes flow with the gluey contact model.
#[derive(Debug, Parser)]
#[command(name = "gluey", version, about, after_help = AFTER_HELP)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a case and write its trajectory.
    Run(RunArguments),
    /// Go on with a run that was interrupted, killed or stopped by an error.
    Resume(ResumeArguments),
    /// Run a case with all combinations of values of some keys.
    Sweep(SweepArguments),
    /// Check a case, and say what its run would be: unknowns, memory, time.
    Check(CheckArguments),
    /// What a case file, a checkpoint or a folder of results is, and how far it is.
    Info(InfoArguments),
    /// Structure and statistics of the particles that a run wrote with --xyz.
    Analyse(AnalyseArguments),
    /// A page for the browser that shows the particles that a run wrote with --xyz.
    View(ViewArguments),
    /// Gaps, paths and rheology of a run as pictures, in SVG and PNG.
    Plot(PlotArguments),
    /// Write a new case file, with comments, to begin with.
    New(NewArguments),
    /// The JSON schema of case files, with which editors complete and check them.
    Schema(SchemaArguments),
    /// What a shell needs to complete arguments.
    Completions(CompletionsArguments),
}

impl Command {
    /// Does it.
    pub fn run(&self) -> Result<(), Failure> {
        match self {
            Self::Run(arguments) => arguments.run(),
            Self::Resume(arguments) => arguments.run(),
            Self::Sweep(arguments) => arguments.run(),
            Self::Check(arguments) => arguments.run(),
            Self::Info(arguments) => arguments.run(),
            Self::Analyse(arguments) => arguments.run(),
            Self::View(arguments) => arguments.run(),
            Self::Plot(arguments) => arguments.run(),
            Self::New(arguments) => arguments.run(),
            Self::Schema(arguments) => arguments.run(),
            Self::Completions(arguments) => arguments.run::<Cli>(),
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
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

impl AnalyseArguments {
    fn run(&self) -> Result<(), Failure> {
        let summary =
            gluey_view::analyse(&self.options()).map_err(|error| Failure::of_results(error, &self.folder))?;
        match self.json {
            true => terminal::print_json(&summary),
            false => terminal::print(&summary.to_string()),
        }
        let tables = self.out.as_ref().unwrap_or(&self.folder).display();
        terminal::say(&format!("tables: {tables}/series.csv and beside it; pictures: gluey plot {tables}"));
        Ok(())
    }

    fn options(&self) -> AnalyseOptions {
        let Self { folder, out, reach, skip, .. } = self.clone();
        AnalyseOptions { folder, out, reach_over_a: reach, skip }
    }
}
