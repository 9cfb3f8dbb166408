//! Arguments of the command, and what they ask of the library.

mod plot;
mod view;

use std::path::PathBuf;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Args, Parser, Subcommand};
use gluey::analyse::AnalyseOptions;
use gluey::case::Override;
use gluey::output::vtk::{Precision, VtkEncoding};
use gluey::{
    Case, Formulation, RecordOptions, RunError, RunOptions, RunReport, Strategy, VtkOptions, XyzOptions,
};

use crate::diagnostic::Diagnosed;
use crate::terminal::{Reporter, say};

pub use plot::PlotArguments;
pub use view::ViewArguments;

/// What a shell reports for a program ended by Ctrl-C.
const INTERRUPTED: u8 = 130;

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
    /// Structure and statistics of the particles that a run wrote with --xyz.
    Analyse(AnalyseArguments),
    /// A page for the browser that shows the particles that a run wrote with --xyz.
    View(ViewArguments),
    /// Pictures of the results of a run, as SVG and PNG.
    Plot(PlotArguments),
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
    /// What they ask of the library.
    pub fn options(&self) -> AnalyseOptions {
        let Self { folder, out, reach, skip } = self.clone();
        AnalyseOptions { folder, out, reach_over_a: reach, skip }
    }
}

/// Arguments of `gluey run`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  gluey run pair.toml --out out --set time.step=0.01 --checkpoint-minutes 30"
)]
pub struct RunArguments {
    /// The case file.
    case: PathBuf,
    /// Set a key of the case: time.step=0.01, particles.0.radius=0.06, contact.strategy=gluey; repeatable.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// What keeps particles from overlapping, instead of the case's choice: none, velocity-correction,
    /// inelastic, gluey.
    #[arg(long)]
    strategy: Option<Strategy>,
    /// How rigidity enters the flow, instead of the case's choice: paper, rigid-dofs, unfitted.
    #[arg(long)]
    formulation: Option<Formulation>,
    /// Folder for all output.
    #[arg(long, default_value = "out", value_name = "DIR")]
    out: PathBuf,
    /// Replace the results of another run in that folder.
    #[arg(long)]
    force: bool,
    /// Write fields, particles and contacts for ParaView every N steps.
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    vtk: Option<usize>,
    /// Compression of the files for ParaView, from 0 (none) over 1 (fast) to 9 (small).
    #[arg(long, value_name = "LEVEL", default_value_t = 1)]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=9))]
    vtk_compression: u32,
    /// Precision of the files for ParaView: f64 (as computed), f32 (half the size).
    #[arg(long, value_name = "PRECISION", default_value_t = Precision::Double)]
    vtk_precision: Precision,
    /// Write particles in extended XYZ, which OVITO and ASE read, every N steps.
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    xyz: Option<usize>,
    /// Compress the files in extended XYZ by gzip.
    #[arg(long, requires = "xyz")]
    xyz_gzip: bool,
    /// Write a checkpoint every N steps (one is written at Ctrl-C, at a request to terminate and
    /// when a step fails in any case).
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    checkpoint_every: Option<usize>,
    /// Write a checkpoint every T minutes.
    #[arg(long, value_name = "T", value_parser = minutes)]
    checkpoint_minutes: Option<f64>,
    /// Go on from a checkpoint of the same case.
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
}

/// Why a command failed, and what the program's exit says about it.
#[derive(Debug)]
pub struct Failure {
    /// What to show.
    pub diagnostic: Box<Diagnosed>,
    /// Not 0.
    pub exit_code: u8,
}

/// Runs the case that `arguments` name.
pub fn run(arguments: &RunArguments) -> Result<RunReport, Failure> {
    let case =
        arguments.case().map_err(|error| Failure { diagnostic: Box::new(error.into()), exit_code: 1 })?;
    let options = arguments.options(&case);
    let reporter = Reporter::new(&case.name);
    let outcome = gluey::run(&case, &options, &reporter);
    reporter.finish();
    outcome.map_err(|error| Failure {
        exit_code: if matches!(error, RunError::Interrupted { .. }) { INTERRUPTED } else { 1 },
        diagnostic: Box::new(Diagnosed::new(error, &arguments.case)),
    })
}

impl RunArguments {
    fn case(&self) -> Result<Case, gluey::CaseError> {
        let mut case = Case::load_with(&self.case, &self.set)?;
        case.contact.strategy = self.strategy.unwrap_or(case.contact.strategy);
        case.flow.formulation = self.formulation.unwrap_or(case.flow.formulation);
        Ok(case)
    }

    fn options(&self, case: &Case) -> RunOptions {
        let stem = case.file_stem();
        RunOptions {
            csv: self.out.join(format!("{stem}.csv")),
            vtk: self.vtk.map(|every| VtkOptions {
                folder: self.out.join(format!("{stem}-vtk")),
                every,
                encoding: VtkEncoding { compression: self.vtk_compression, precision: self.vtk_precision },
            }),
            xyz: self.xyz.map(|every| XyzOptions {
                folder: self.out.join(format!("{stem}-xyz")),
                every,
                gzip: self.xyz_gzip,
            }),
            checkpoint: Some(self.out.join(format!("{stem}.checkpoint"))),
            checkpoint_every: self.checkpoint_every,
            checkpoint_minutes: self.checkpoint_minutes,
            record: Some(RecordOptions { force: self.force }),
            resume: self.resume.clone(),
            interrupt: Some(interrupt_flag()),
        }
    }
}

/// A flag that the first Ctrl-C sets, or the first request to terminate or hang up; the second ends the
/// program at once.
fn interrupt_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = flag.clone();
    let installed = ctrlc::set_handler(move || {
        if shared.swap(true, Ordering::Relaxed) {
            process::exit(i32::from(INTERRUPTED));
        }
        say("stopping after this step; once more to stop at once");
    });
    if let Err(error) = installed {
        say(&format!("Ctrl-C will end the program without a checkpoint: {error}"));
    }
    flag
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("must be at least 1".into()),
        Ok(number) => Ok(number),
        Err(_) => Err("must be a whole number, at least 1".into()),
    }
}

fn minutes(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(minutes) if minutes > 0.0 && f64::is_finite(minutes) => Ok(minutes),
        _ => Err("must be a number greater than 0".into()),
    }
}
