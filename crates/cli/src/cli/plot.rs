//! Arguments of `gluey plot`.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::Args;
use gluey_view::{
    AnimationOptions, Coloring, Figure, FlowOptions, FrameChoice, Lines, Look, PictureFormat, PlotOptions,
    Quantity, SliceChoice, Viewpoint,
};

use super::Failure;
use crate::terminal;

/// Arguments of `gluey plot`.
#[derive(Clone, Debug, Args)]
#[command(
    group = clap::ArgGroup::new("frames").multiple(true),
    after_help = "Example:\n  gluey run suspension.toml --out out --xyz 5\n  gluey plot out --width 85\n  gluey plot out --animation\n  gluey run suspension.toml --out out --vtk 5 --xyz 5\n  gluey plot out --flow speed\n  gluey analyse out && gluey plot out"
)]
pub struct PlotArguments {
    /// Folder of a run.
    folder: PathBuf,
    /// What to draw: gaps, trajectories, rheology, solver, and of the tables of `gluey analyse` contacts,
    /// correlations, profiles, diffusion; whatever there are results for when absent.
    #[arg(long, value_name = "FIGURE", value_delimiter = ',')]
    only: Vec<Figure>,
    /// Draw the particles of a frame that was written with --xyz (its flow with --flow): last, or the number
    /// of a step.
    #[arg(long, value_name = "STEP", group = "frames")]
    frame: Option<FrameChoice>,
    /// Draw the flow of a frame that was written with --vtk, the last unless --frame names one: speed,
    /// pressure, strain-rate, vorticity.
    #[arg(long, value_name = "QUANTITY")]
    flow: Option<Quantity>,
    /// In 3D, the plane in which the flow is drawn, such as x=0.5; across z through the middle when absent.
    #[arg(long, value_name = "AXIS=PLACE", requires = "flow")]
    slice: Option<SliceChoice>,
    /// From where spheres are seen, in degrees: around the vertical from the front to the right, and above.
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION",
        default_value = "31.5,20",
        allow_hyphen_values = true,
        requires = "frames"
    )]
    view: Viewpoint,
    /// Colours of particles in frames and animations: speed, spin, gap (the smallest), or contact-force.
    #[arg(long, value_name = "WHAT", default_value = "speed", requires = "frames")]
    colour: Coloring,
    /// Join the centres of particles in frames and animations: those with gaps up to this, in mean radii, or
    /// by `force` those in contact, in lines as thick as their normal force, dashed where they slip.
    #[arg(long, value_name = "GAP|force", allow_negative_numbers = true, requires = "frames")]
    contacts: Option<Lines>,
    /// Animate the particles of all frames that were written with --xyz, as a GIF.
    #[arg(long, group = "frames")]
    animation: bool,
    /// Pixels across of an animation.
    #[arg(long, value_name = "N", default_value_t = 720, requires = "animation")]
    #[arg(value_parser = clap::value_parser!(u32).range(100..=4000))]
    pixels: u32,
    /// Frames a second of an animation.
    #[arg(long, value_name = "FPS", default_value_t = 12.0, requires = "animation", value_parser = number(0.1..=50.0, "frames a second"))]
    rate: f64,
    /// How to write it: svg, png.
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', default_value = "svg,png")]
    format: Vec<PictureFormat>,
    /// Width on paper in millimetres.
    #[arg(long, value_name = "MM", default_value_t = 120.0, value_parser = number(60.0..=400.0, "millimetres"))]
    width: f64,
}

impl PlotArguments {
    /// Draws.
    pub fn run(&self) -> Result<(), Failure> {
        let pictures =
            gluey_view::plot(&self.options()).map_err(|error| Failure::of_results(error, &self.folder))?;
        pictures.iter().for_each(|picture| terminal::print(&format!("{}\n", picture.display())));
        Ok(())
    }

    fn options(&self) -> PlotOptions {
        let Self { folder, only, frame, format, .. } = self.clone();
        let Self { flow, slice, view, colour, contacts, animation, pixels, rate, width, .. } = *self;
        let animation = animation.then_some(AnimationOptions { pixels, rate });
        let flow = flow.map(|quantity| FlowOptions { quantity, slice });
        let look = Look { viewpoint: view, coloring: colour, network: contacts };
        PlotOptions { folder, frame, flow, look, animation, only, formats: format, width_mm: width }
    }
}

/// Reads a number in a range, in this unit.
fn number(
    range: RangeInclusive<f64>,
    unit: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| match text.parse() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => Err(format!("must be a number from {} to {} ({unit})", range.start(), range.end())),
    }
}
