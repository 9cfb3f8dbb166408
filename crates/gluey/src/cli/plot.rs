//! Arguments of `gluey plot`.

use std::path::PathBuf;

use clap::Args;
use gluey::plot::{AnimationOptions, Figure, Format, FrameChoice, PlotOptions};

use super::Failure;
use crate::terminal;

/// Arguments of `gluey plot`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Example:\n  gluey run suspension.toml --out out --xyz 5\n  gluey plot out --width 85\n  gluey plot out --animation"
)]
pub struct PlotArguments {
    /// Folder of a run.
    folder: PathBuf,
    /// What to draw: gaps, trajectories, rheology, solver; whatever there are results for when absent.
    #[arg(long, value_name = "FIGURE", value_delimiter = ',')]
    only: Vec<Figure>,
    /// Draw the particles of a frame that was written with --xyz: last, or the number of a step.
    #[arg(long, value_name = "STEP")]
    frame: Option<FrameChoice>,
    /// Animate the particles of all frames that were written with --xyz, as a GIF.
    #[arg(long)]
    animation: bool,
    /// Pixels across of an animation.
    #[arg(long, value_name = "N", default_value_t = 720, requires = "animation")]
    #[arg(value_parser = clap::value_parser!(u32).range(100..=4000))]
    pixels: u32,
    /// Frames a second of an animation.
    #[arg(long, value_name = "FPS", default_value_t = 12.0, requires = "animation", value_parser = rate)]
    rate: f64,
    /// How to write it: svg, png.
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', default_value = "svg,png")]
    format: Vec<Format>,
    /// Width on paper in millimetres.
    #[arg(long, value_name = "MM", default_value_t = 120.0, value_parser = width)]
    width: f64,
}

impl PlotArguments {
    /// Draws.
    pub fn run(&self) -> Result<(), Failure> {
        let pictures =
            gluey::plot::plot(&self.options()).map_err(|error| Failure::of_results(error, &self.folder))?;
        terminal::print_pictures(&pictures);
        Ok(())
    }

    fn options(&self) -> PlotOptions {
        let Self { folder, only, frame, animation, pixels, rate, format, width } = self.clone();
        let animation = animation.then_some(AnimationOptions { pixels, rate });
        PlotOptions { folder, only, frame, animation, formats: format, width_mm: width }
    }
}

fn width(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(width) if (60.0..=400.0).contains(&width) => Ok(width),
        _ => Err("must be a number from 60 to 400 (millimetres)".into()),
    }
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(rate) if (0.1..=50.0).contains(&rate) => Ok(rate),
        _ => Err("must be a number from 0.1 to 50 (frames a second)".into()),
    }
}
