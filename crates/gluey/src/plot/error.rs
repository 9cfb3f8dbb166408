//! Why results could not be drawn.

use std::io;
use std::path::PathBuf;

use gluey_pictures::{EncodingError, PngError};
use thiserror::Error;

use super::figure::Figure;
use crate::analyse::FramesError;
use crate::output::OutputError;
use crate::table::TableError;

/// Why results could not be drawn.
#[derive(Debug, Error)]
pub enum PlotError {
    /// The folder could not be listed.
    #[error("{}: cannot be listed", folder.display())]
    List {
        /// The folder.
        folder: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// No trajectory.
    #[error("{}: no complete trajectory <name>.csv of `gluey run`", folder.display())]
    NoResults {
        /// The folder.
        folder: PathBuf,
    },
    /// A file could not be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
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
    /// A picture could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// The first, the second and the last.
fn listed(steps: &[usize]) -> String {
    match steps {
        [first, second, .., last] => format!("{first}, {second}, ... {last}"),
        _ => steps.iter().map(usize::to_string).collect::<Vec<_>>().join(", "),
    }
}
