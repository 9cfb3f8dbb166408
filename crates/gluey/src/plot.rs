//! Pictures of the results of a run, as SVG and PNG: gaps against time, paths, rheology against strain, what
//! the steps cost.
//!
//! ```text
//! gaps           against time: of all pairs of up to nine particles, else the smallest and all near ones
//! trajectories   y against x; in 3D also z against x
//! rheology       relative viscosity and normal stresses against strain
//! solver         iterations and seconds of each phase of a step against time
//! particles      those of a frame that is asked for, or of all frames as an animation, with their images,
//!                coloured by speed
//! ```
//!
//! They are read from `<stem>.csv`, `<stem>-gaps.csv`, `<stem>-rheology.csv`, `<stem>-solver.csv` and
//! `<stem>-xyz` and go to `<stem>-plots`.

mod animation;
mod error;
mod figure;
mod figures;
mod read;
mod snapshot;

use std::path::{Path, PathBuf};
use std::str::FromStr;

use gluey_pictures::Canvas;

pub use animation::AnimationOptions;
pub use error::PlotError;
pub use figure::Figure;
pub use snapshot::FrameChoice;

use crate::output::{prepare_folder_of, write_atomically};
use read::Results;

/// How a picture is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Scalable, with its font.
    Svg,
    /// Pixels, 381 to the inch.
    Png,
}

impl Format {
    fn extension(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}

impl FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "svg" => Ok(Self::Svg),
            "png" => Ok(Self::Png),
            _ => Err("expected svg or png".into()),
        }
    }
}

/// What to draw, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotOptions {
    /// Folder of results.
    pub folder: PathBuf,
    /// A frame whose particles to draw, instead of all that is not in `only`.
    pub frame: Option<FrameChoice>,
    /// An animation of all frames, instead of all that is not in `only`.
    pub animation: Option<AnimationOptions>,
    /// What to draw; what there are results for when empty and no frame is named.
    pub only: Vec<Figure>,
    /// How to write it.
    pub formats: Vec<Format>,
    /// Width on paper in millimetres.
    pub width_mm: f64,
}

/// Draws the results of every run in a folder and gives the paths of the pictures.
pub fn plot(options: &PlotOptions) -> Result<Vec<PathBuf>, PlotError> {
    let mut written = Vec::new();
    if let Some(frame) = options.frame {
        let (canvas, stem) = snapshot::snapshot(&options.folder, frame, options.width_mm)?;
        written.extend(write(&canvas, &stem, &options.formats)?);
    }
    if let Some(animation) = options.animation {
        let (bytes, path) = animation::animation(&options.folder, animation)?;
        prepare_folder_of(&path)?;
        write_atomically(&path, &bytes)?;
        written.push(path);
    }
    if options.only.is_empty() && (options.frame.is_some() || options.animation.is_some()) {
        return Ok(written);
    }
    for results in read::results_in(&options.folder)? {
        for figure in Figure::ALL {
            let is_wanted = options.only.is_empty() || options.only.contains(&figure);
            if is_wanted && let Some(canvas) = draw(figure, &results, options)? {
                let stem = results.plots().join(figure.as_str());
                written.extend(write(&canvas, &stem, &options.formats)?);
            }
        }
    }
    Ok(written)
}

/// A picture; none where there is nothing for it and it was not asked for by name.
fn draw(figure: Figure, results: &Results, options: &PlotOptions) -> Result<Option<Canvas>, PlotError> {
    let is_named = options.only.contains(&figure);
    match figure {
        Figure::Gaps => figures::gaps(results, options.width_mm, is_named),
        Figure::Trajectories => figures::trajectories(results, options.width_mm).map(Some),
        Figure::Rheology => figures::rheology(results, options.width_mm, is_named),
        Figure::Solver => figures::solver(results, options.width_mm, is_named),
    }
}

/// Writes a picture beside `stem` in every format.
fn write(canvas: &Canvas, stem: &Path, formats: &[Format]) -> Result<Vec<PathBuf>, PlotError> {
    let mut paths = Vec::new();
    for format in formats {
        let path = stem.with_extension(format.extension());
        let bytes = match format {
            Format::Svg => canvas.svg_for_print().into_bytes(),
            Format::Png => canvas.png().map_err(|source| PlotError::Png { path: path.clone(), source })?,
        };
        prepare_folder_of(&path)?;
        write_atomically(&path, &bytes)?;
        paths.push(path);
    }
    Ok(paths)
}
