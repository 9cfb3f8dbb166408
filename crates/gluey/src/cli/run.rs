//! `gluey run`.

use std::path::PathBuf;

use clap::Args;
use gluey::case::Override;
use gluey::output::vtk::{Precision, VtkEncoding};
use gluey::{Case, Formulation, RecordOptions, ResultPaths, RunOptions, Strategy, VtkOptions, XyzOptions};

use super::failure::Failure;
use super::interrupt::interrupt_flag;
use super::manner::Manner;
use crate::terminal::print_report;

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
    #[command(flatten)]
    manner: Manner,
}

impl RunArguments {
    /// Runs the case that they name, and tells what came out.
    pub fn run(&self) -> Result<(), Failure> {
        self.manner.set_threads()?;
        let case = self.case()?;
        let options = self.options(&case);
        let report = self.manner.run(&case, &options, &self.case)?;
        self.manner.tell(&report, print_report);
        Ok(())
    }

    fn case(&self) -> Result<Case, gluey::CaseError> {
        let set = |option, path: &[&str], name: &dyn std::fmt::Display| {
            Override::of_option(option, path, &name.to_string())
        };
        let strategy = self.strategy.map(|name| set("--strategy", &["contact", "strategy"], &name));
        let formulation = self.formulation.map(|name| set("--formulation", &["flow", "formulation"], &name));
        let overrides: Vec<Override> = self.set.iter().cloned().chain(strategy).chain(formulation).collect();
        Case::load_with(&self.case, &overrides)
    }

    fn options(&self, case: &Case) -> RunOptions {
        let paths = ResultPaths::new(&self.out, case.file_stem());
        RunOptions {
            csv: paths.csv(),
            vtk: self.vtk.map(|every| VtkOptions {
                folder: paths.vtk(),
                every,
                encoding: VtkEncoding { compression: self.vtk_compression, precision: self.vtk_precision },
            }),
            xyz: self.xyz.map(|every| XyzOptions { folder: paths.xyz(), every, gzip: self.xyz_gzip }),
            checkpoint: Some(paths.checkpoint()),
            checkpoint_every: self.checkpoint_every,
            checkpoint_minutes: self.checkpoint_minutes,
            record: Some(RecordOptions { force: self.force }),
            resume: self.resume.clone(),
            interrupt: Some(interrupt_flag()),
        }
    }
}

pub(super) fn at_least_one(text: &str) -> Result<usize, String> {
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
