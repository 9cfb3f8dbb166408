//! Pictures of the results of a run, as SVG and PNG: gaps against time, paths, rheology against strain, what
//! the steps cost.
//!
//! ```text
//! gaps           against time: of all pairs of up to nine particles, else the smallest and all near ones
//! trajectories   y against x; in 3D also z against x
//! rheology       relative viscosity and normal stresses against strain
//! solver         iterations and seconds of each phase of a step against time
//! contacts       contacts of a particle, largest cluster and fabric against strain
//! correlations   g(r), g(theta) near contact, S(k)
//! profiles       fraction and velocity across the shear
//! diffusion      mean squares of the displacements beside the shear, and the lines that fit them
//! particles      those of a frame that is asked for, or of all frames as an animation, with their images,
//!                coloured by speed, spin, gap or the force of their contacts
//! flow           of a frame with fields that is asked for, with arrows and particles
//! ```
//!
//! They are read from `<stem>.csv`, `<stem>-gaps.csv`, `<stem>-rheology.csv`, `<stem>-solver.csv` and
//! `<stem>-xyz` and go to `<stem>-plots`; from `contacts` on of the tables of `gluey analyse`, and to
//! `structure-plots`. The folder of a study has one picture, the viscosity against a swept key, in
//! `sweep-plots`.

mod animation;
mod error;
mod figure;
mod figures;
mod flow;
mod look;
mod read;
mod snapshot;
mod structure;
mod study;
mod told;

use std::path::{Path, PathBuf};
use std::str::FromStr;

use gluey::output::{prepare_folder_of, write_atomically};
use gluey::sweep::StudyProgress;
use gluey_pictures::Canvas;

pub use animation::AnimationOptions;
pub use error::PlotError;
pub use figure::Figure;
pub use flow::{FlowOptions, Quantity, SliceChoice};
pub use look::{Coloring, Lines, Look, Viewpoint};
pub use snapshot::FrameChoice;

use read::{Results, StructureTables};

/// The format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// Scalable, with its font.
    Svg,
    /// Pixels, 381 to the inch.
    Png,
}

impl PictureFormat {
    fn extension(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Png => "png",
        }
    }
}

impl FromStr for PictureFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "svg" => Ok(Self::Svg),
            "png" => Ok(Self::Png),
            _ => Err("expected svg or png".into()),
        }
    }
}

/// Options of the pictures of a run or a study.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotOptions {
    /// Folder of results, or of a study.
    pub folder: PathBuf,
    /// A frame whose particles to draw, or whose flow, instead of all that is not in `only`.
    pub frame: Option<FrameChoice>,
    /// The flow of the frame, the last one if none is named, instead of its particles.
    pub flow: Option<FlowOptions>,
    /// How particles are shown in pictures of frames and in animations.
    pub look: Look,
    /// An animation of all frames, instead of all that is not in `only`.
    pub animation: Option<AnimationOptions>,
    /// What to draw; what there are results for when empty and no frame is named.
    pub only: Vec<Figure>,
    /// How to write it.
    pub formats: Vec<PictureFormat>,
    /// Width on paper in millimetres.
    pub width_mm: f64,
}

/// Draws the results of every run in a folder, or of a study, and gives the paths of the pictures.
pub fn plot(options: &PlotOptions) -> Result<Vec<PathBuf>, PlotError> {
    let mut written = Vec::new();
    let PlotOptions { folder, width_mm, .. } = options;
    if let Some(study) = StudyProgress::read(folder)? {
        let asks_for_run = options.frame.is_some() || options.flow.is_some() || options.animation.is_some();
        if asks_for_run || !options.only.is_empty() {
            return Err(PlotError::OfPoint { folder: folder.clone() });
        }
        let canvas = study::draw(&study, *width_mm)?;
        return write(&canvas, &folder.join("sweep-plots").join("viscosity"), &options.formats);
    }
    let picture = match (options.flow, options.frame) {
        (Some(flow), frame) => Some(flow::flow(folder, flow, frame, *width_mm)?),
        (None, Some(frame)) => Some(snapshot::snapshot(folder, frame, &options.look, *width_mm)?),
        (None, None) => None,
    };
    let is_of_frames = picture.is_some() || options.animation.is_some();
    if let Some((canvas, stem)) = picture {
        written.extend(write(&canvas, &stem, &options.formats)?);
    }
    if let Some(animation) = options.animation {
        let (bytes, path) = animation::animation(folder, animation, &options.look)?;
        prepare_folder_of(&path)?;
        write_atomically(&path, &bytes)?;
        written.push(path);
    }
    if options.only.is_empty() && is_of_frames {
        return Ok(written);
    }
    let tables = StructureTables::new(&options.folder);
    for results in runs(options, &tables)? {
        for figure in wanted(options).filter(|figure| !figure.is_of_structure()) {
            if let Some(canvas) = draw(figure, &results, options)? {
                let stem = results.plots().join(figure.as_str());
                written.extend(write(&canvas, &stem, &options.formats)?);
            }
        }
    }
    for figure in wanted(options).filter(|figure| figure.is_of_structure()) {
        if let Some(canvas) =
            structure::draw(figure, &tables, options.width_mm, options.only.contains(&figure))?
        {
            let stem = tables.plots().join(figure.as_str());
            written.extend(write(&canvas, &stem, &options.formats)?);
        }
    }
    Ok(written)
}

/// The runs to draw; a folder that has the tables of `gluey analyse` needs none, nor do pictures of them.
fn runs(options: &PlotOptions, tables: &StructureTables<'_>) -> Result<Vec<Results>, PlotError> {
    let only = &options.only;
    if !only.is_empty() && only.iter().all(|figure| figure.is_of_structure()) {
        return Ok(Vec::new());
    }
    match read::results_in(&options.folder) {
        Err(PlotError::NoResults { .. }) if only.is_empty() && tables.are_there() => Ok(Vec::new()),
        found => found,
    }
}

fn wanted(options: &PlotOptions) -> impl Iterator<Item = Figure> {
    let is_wanted = |figure: &Figure| options.only.is_empty() || options.only.contains(figure);
    Figure::ALL.iter().copied().filter(is_wanted)
}

/// A picture; none where there is nothing for it and it was not asked for by name.
fn draw(figure: Figure, results: &Results, options: &PlotOptions) -> Result<Option<Canvas>, PlotError> {
    let is_named = options.only.contains(&figure);
    match figure {
        Figure::Gaps => figures::gaps(results, options.width_mm, is_named),
        Figure::Trajectories => figures::trajectories(results, options.width_mm).map(Some),
        Figure::Rheology => figures::rheology(results, options.width_mm, is_named),
        Figure::Solver => figures::solver(results, options.width_mm, is_named),
        Figure::Contacts | Figure::Correlations | Figure::Profiles | Figure::Diffusion => Ok(None),
    }
}

/// Writes a picture beside `stem` in every format.
fn write(canvas: &Canvas, stem: &Path, formats: &[PictureFormat]) -> Result<Vec<PathBuf>, PlotError> {
    let mut paths = Vec::new();
    for format in formats {
        // Names may have a dot in a number: nothing is an extension of theirs.
        let mut path = stem.as_os_str().to_owned();
        path.push(format!(".{}", format.extension()));
        let path = PathBuf::from(path);
        let bytes = match format {
            PictureFormat::Svg => canvas.svg_for_print().into_bytes(),
            PictureFormat::Png => {
                canvas.png().map_err(|source| PlotError::Png { path: path.clone(), source })?
            }
        };
        prepare_folder_of(&path)?;
        write_atomically(&path, &bytes)?;
        paths.push(path);
    }
    Ok(paths)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey::output::product_names::is_picture;

    /// A run that replaces another one takes its pictures away, by their names.
    #[test]
    fn pictures_are_known_by_their_names() {
        for &figure in Figure::ALL {
            for format in [PictureFormat::Svg, PictureFormat::Png] {
                assert!(is_picture(&format!("{}.{}", figure.as_str(), format.extension())), "{figure:?}");
            }
        }
        for name in [
            "particles-000012.png",
            "flow-speed-000100.svg",
            "flow-pressure-z=0.5-0000100.png",
            "particles.gif",
        ] {
            assert!(is_picture(name), "{name}");
        }
        for name in ["notes.txt", "mine.png", "gaps.pdf", "gaps-2.svg", "particles-final.png", "flow.svg"] {
            assert!(!is_picture(name), "{name}");
        }
    }
}
