//! Structure and statistics of the particles that a run wrote in extended XYZ.
//!
//! ```text
//! series.csv             t, strain, gaps, contacts, clusters, percolation, fabric: a row per frame
//! g_of_r.csv             pair correlation by distance
//! g_of_theta.csv         pair correlation near contact by the angle to the flow
//! structure_factor.csv   S(k), where there is a period
//! profile_y.csv          volume fraction and velocity across the shear
//! diffusion.csv          mean squares of the displacements beside the shear, by lag
//! summary.txt            means with confidence intervals, diffusivities, rheology
//! ```
//!
//! Lengths are in mean radii. Means and distributions leave out the transient, which is that of the median
//! gap by the rule MSER-5 unless it is given. The rheology that a sheared run wrote beside its frames has a
//! transient of its own, that of its viscosity.

mod observe;
mod summary;
mod tables;

use std::path::{Path, PathBuf};

use gluey::ResultPaths;
use gluey::output::product_names::is_table;
use gluey::output::{FileError, prepare_folder_of, write_atomically};
use gluey::rheology::{RheologyError, RheologyMeans};
use gluey_contact::ContactError;
use gluey_suspension::statistics::mser;
use thiserror::Error;

pub use summary::StructureSummary;

use crate::frames::{FramesError, dimension, frame_files, read_frames, table_beside};
use observe::{Distributions, FrameNumbers};

/// Options of an analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalyseOptions {
    /// Folder of a run, or of its files in extended XYZ.
    pub folder: PathBuf,
    /// Folder for the tables; `folder` when absent.
    pub out: Option<PathBuf>,
    /// Gap up to which particles count as in contact, in mean radii.
    pub reach_over_a: f64,
    /// Frames to leave out at the beginning, instead of the transient that is found.
    pub skip: Option<usize>,
}

impl AnalyseOptions {
    /// Everything about the run in `folder`, with contacts up to a gap of 0.05.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), out: None, reach_over_a: 0.05, skip: None }
    }
}

/// A reason why a run could not be analysed.
#[derive(Debug, Error)]
pub enum AnalyseError {
    /// Its frames could not be read.
    #[error(transparent)]
    Frames(#[from] FramesError),
    /// An option out of its range.
    #[error("--reach {found}: it must be from 0 to 10 mean radii")]
    Reach {
        /// The value.
        found: f64,
    },
    /// Fewer frames than are to be left out.
    #[error("{}: {count} frames, but --skip {skip} leaves none", folder.display())]
    AllSkipped {
        /// The folder.
        folder: PathBuf,
        /// Frames that are there.
        count: usize,
        /// Frames to be left out.
        skip: usize,
    },
    /// The rheology of the run could not be read.
    #[error(transparent)]
    Rheology(#[from] RheologyError),
    /// Contacts make no sense.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// A table could not be written.
    #[error(transparent)]
    Output(#[from] FileError),
}

/// Reads the frames of a run, writes the tables and gives the summary.
pub fn analyse(options: &AnalyseOptions) -> Result<StructureSummary, AnalyseError> {
    if !(0.0..=10.0).contains(&options.reach_over_a) {
        return Err(AnalyseError::Reach { found: options.reach_over_a });
    }
    let files = frame_files(&options.folder)?;
    match dimension(&files)? {
        2 => analyse_in::<2>(options, &files),
        _ => analyse_in::<3>(options, &files),
    }
}

fn analyse_in<const D: usize>(
    options: &AnalyseOptions,
    files: &[PathBuf],
) -> Result<StructureSummary, AnalyseError> {
    let frames = read_frames::<D>(files)?;
    let series: Vec<FrameNumbers<D>> = frames
        .iter()
        .map(|frame| FrameNumbers::of(frame, options.reach_over_a))
        .collect::<Result<_, ContactError>>()?;
    let medians: Vec<f64> =
        series.iter().filter_map(|instant| instant.gaps.map(|gaps| gaps.median)).collect();
    let skip = options.skip.unwrap_or_else(|| mser(&medians).length);
    let Some(kept) = frames.get(skip..).filter(|kept| !kept.is_empty()) else {
        let (folder, count) = (options.folder.clone(), frames.len());
        return Err(AnalyseError::AllSkipped { folder, count, skip });
    };
    let distributions = Distributions::of(kept);
    let begin = options.skip.map(|_| kept[0].time);
    let rheology = table_beside(&files[0], ResultPaths::rheology)
        .map(|table| RheologyMeans::read(&table, begin))
        .transpose()?;
    let summary = StructureSummary::of(&series, skip, &distributions, rheology.flatten());
    let out = options.out.as_deref().unwrap_or(&options.folder);
    write(out, &tables::all(&series, &distributions))?;
    write(out, &[("summary.txt", summary.to_string())])?;
    Ok(summary)
}

fn write(folder: &Path, files: &[(&str, String)]) -> Result<(), FileError> {
    files.iter().try_for_each(|(name, text)| {
        debug_assert!(is_table(name), "{name} is not known as a table");
        let path = folder.join(name);
        prepare_folder_of(&path)?;
        write_atomically(&path, text.as_bytes())
    })
}
