//! Why results could not be drawn.

use std::path::PathBuf;

use gluey::case::CaseError;
use gluey::output::FileError;
use gluey::output::vtk::VtkReadError;
use gluey::sweep::SweepError;
use gluey::table::TableError;
use gluey_pictures::{EncodingError, PngError};
use thiserror::Error;

use super::figure::Figure;
use crate::frames::FramesError;

/// A reason why results could not be drawn.
#[derive(Debug, Error)]
pub enum PlotError {
    /// No trajectory.
    #[error("{}: no trajectory <name>.csv of `gluey run`", folder.display())]
    NoResults {
        /// The folder.
        folder: PathBuf,
    },
    /// A file is no table, or lacks a column.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: TableError,
    },
    /// Nothing to draw a line through.
    #[error("{}: {rows} rows, a picture of {} needs at least 2", path.display(), figure.as_str())]
    TooShort {
        /// The file.
        path: PathBuf,
        /// The picture.
        figure: Figure,
        /// Rows that are there.
        rows: usize,
    },
    /// What was asked for has no results.
    #[error("{}: not there, and a picture of {} needs it: {hint}", path.display(), figure.as_str())]
    Missing {
        /// The file.
        path: PathBuf,
        /// The picture.
        figure: Figure,
        /// Where it would come from.
        hint: &'static str,
    },
    /// The frames could not be read.
    #[error(transparent)]
    Frames(#[from] FramesError),
    /// No frame of that step.
    #[error("{}: no frame of this step; there are {}", folder.display(), listed(steps))]
    NoFrame {
        /// The folder.
        folder: PathBuf,
        /// Steps that have frames.
        steps: Vec<usize>,
    },
    /// No forces in the frames.
    #[error(
        "{}: no column `contact_force`, so there are no colours by contact-force: the run had no contact model \
         ([contact] strategy = \"none\"), or an older gluey wrote the frames",
        path.display()
    )]
    NoContactForces {
        /// The frame.
        path: PathBuf,
    },
    /// No forces between the particles of frames.
    #[error(
        "{}: no <name>-gaps.csv with forces of contacts beside its folder, so there are no lines of them: runs of ten \
         particles and more with a contact model write it",
        path.display()
    )]
    NoForcesOfPairs {
        /// The frame.
        path: PathBuf,
    },
    /// No fields of the flow.
    #[error(
        "{}: no fields of the flow: run with --vtk N, or with an [[output]] of kind \"vtk\" in the case, \
         and a flow on a mesh",
        folder.display()
    )]
    NoFields {
        /// The folder.
        folder: PathBuf,
    },
    /// Fields of several runs or streams.
    #[error("{}: fields in {} and in {}: name one of them", folder.display(), first.display(), second.display())]
    SeveralFields {
        /// The folder.
        folder: PathBuf,
        /// A folder of frames.
        first: PathBuf,
        /// Another one.
        second: PathBuf,
    },
    /// No case of a folder of frames.
    #[error("{}: no <name>-case.toml of its run beside it, which says where the box is periodic", folder.display())]
    NoCase {
        /// The folder of frames.
        folder: PathBuf,
    },
    /// The case of a run could not be read.
    #[error("{}: cannot be read as a case", file.display())]
    Case {
        /// The file.
        file: PathBuf,
        /// Why.
        source: Box<CaseError>,
    },
    /// A file for ParaView could not be read back.
    #[error(transparent)]
    Fields(#[from] VtkReadError),
    /// Fields without cells.
    #[error("{}: no cells", path.display())]
    NoCells {
        /// The file.
        path: PathBuf,
    },
    /// A slice of a plane.
    #[error("--slice: the case is plane; slices are of cases in 3D")]
    SliceOfPlane,
    /// A slice that misses the box.
    #[error("--slice {axis}={at}: the box reaches from {axis} = {} to {}", ends[0], ends[1])]
    SliceOutside {
        /// The axis across the slice.
        axis: char,
        /// Where the slice would be.
        at: f64,
        /// Where the box ends.
        ends: [f64; 2],
    },
    /// A study could not be read.
    #[error(transparent)]
    Study(#[from] SweepError),
    /// Pictures of a run, of a study.
    #[error("{}: a study has one picture, that of its viscosities: name the folder of a point", folder.display())]
    OfPoint {
        /// The folder.
        folder: PathBuf,
    },
    /// A study of keys without numbers.
    #[error("{}: none of the swept keys ({}) has two numbers to draw viscosities against", folder.display(), keys.join(", "))]
    NoNumbers {
        /// The folder.
        folder: PathBuf,
        /// The keys.
        keys: Vec<String>,
    },
    /// A study without viscosities.
    #[error(
        "{}: no point that is done has a viscosity ({done} of {of} are done); runs in boxes with domain.boundary = \
         \"sheared\" have one",
        folder.display()
    )]
    NoViscosity {
        /// The folder.
        folder: PathBuf,
        /// Points that are done.
        done: usize,
        /// Points in all.
        of: usize,
    },
    /// A picture could not be drawn.
    #[error("{}: cannot be drawn", path.display())]
    Png {
        /// The picture.
        path: PathBuf,
        /// Why.
        source: PngError,
    },
    /// An animation could not be made.
    #[error("{}: cannot be animated", path.display())]
    Animation {
        /// The animation.
        path: PathBuf,
        /// Why.
        source: EncodingError,
    },
    /// A file could not be read or written, or a folder not listed.
    #[error(transparent)]
    File(#[from] FileError),
}

/// The first, the second and the last.
fn listed(steps: &[usize]) -> String {
    match steps {
        [first, second, .., last] => format!("{first}, {second}, ... {last}"),
        _ => steps.iter().map(usize::to_string).collect::<Vec<_>>().join(", "),
    }
}
