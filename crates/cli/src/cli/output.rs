//! What a run writes beside its trajectory.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use gluey::case::UnknownName;
use gluey::output::vtk::{Precision, VtkEncoding};
use gluey::{RecordOptions, ResultPaths, RunOptions, VtkOptions, XyzOptions};

use super::interrupt::Requests;

/// Arguments about what a run writes beside its trajectory.
#[derive(Debug, Args)]
pub struct OutputArguments {
    /// Write fields, particles and contacts for ParaView every N steps.
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    vtk: Option<usize>,
    /// Compression of the files for ParaView, from 0 (none) over 1 (fast) to 9 (small).
    #[arg(long, value_name = "LEVEL", default_value_t = 1, requires = "vtk")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=9))]
    vtk_compression: u32,
    /// Precision of the files for ParaView: f64 (as computed), f32 (half the size).
    #[arg(long, value_name = "PRECISION", default_value_t = Precision::Double, requires = "vtk")]
    #[arg(value_parser = by_name::<Precision>)]
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
}

impl OutputArguments {
    /// The options of a run with these results.
    pub fn options(
        &self,
        paths: &ResultPaths,
        force: bool,
        resume: Option<PathBuf>,
        requests: &Requests,
    ) -> RunOptions {
        requests.heeded_by(RunOptions {
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
            record: Some(RecordOptions { force }),
            resume,
            ..RunOptions::default()
        })
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

/// A choice by its name; what is none is told with the names there are.
pub(super) fn by_name<T: FromStr<Err = UnknownName>>(text: &str) -> Result<T, String> {
    text.parse().map_err(|unknown: UnknownName| {
        let known: Vec<String> = unknown.known.iter().map(|name| format!("`{name}`")).collect();
        format!("{unknown}: expected {}", known.join(" or "))
    })
}
