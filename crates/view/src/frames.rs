//! The frames of a run: where they lie, and whether they belong together.

use std::path::{Path, PathBuf};

use gluey::ResultPaths;
use gluey::output::xyz::{self, XyzError, XyzFrame, read_text};
use gluey::output::{FileError, entries, name_of, rows_of};
use gluey::table::TableError;
use thiserror::Error;

/// Frames could not be found or read.
#[derive(Debug, Error)]
pub enum FramesError {
    /// A folder could not be listed.
    #[error(transparent)]
    List(#[from] FileError),
    /// No frames.
    #[error(
        "{}: no particles in extended XYZ: run with --xyz N, or with an [[output]] of kind \"xyz\" in the case",
        folder.display()
    )]
    None {
        /// The folder.
        folder: PathBuf,
    },
    /// Frames of several runs.
    #[error(
        "{}: frames of several runs: name one of the folders {} and {}",
        folder.display(),
        first.display(),
        second.display()
    )]
    Several {
        /// The folder.
        folder: PathBuf,
        /// A folder of frames.
        first: PathBuf,
        /// Another one.
        second: PathBuf,
    },
    /// Frames that are not of one run.
    #[error("{}: other particles or another box than in {}", path.display(), first.display())]
    Strangers {
        /// The frame.
        path: PathBuf,
        /// The first frame.
        first: PathBuf,
    },
    /// A table of their run is none, or lacks a column.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: TableError,
    },
    /// A frame could not be read.
    #[error(transparent)]
    Frame(#[from] XyzError),
}

/// The files of a run's frames, in the order of the steps: in `folder`, or in the only folder in it whose
/// name ends in `-xyz`.
pub fn frame_files(folder: &Path) -> Result<Vec<PathBuf>, FramesError> {
    let entries = list(folder)?;
    let is_series = |path: &&PathBuf| path.is_dir() && name_of(path).ends_with("-xyz");
    let mut folders = entries.iter().filter(is_series);
    let own: Vec<PathBuf> = entries.iter().filter(|path| is_frame(path)).cloned().collect();
    let found = match (own.is_empty(), folders.next(), folders.next()) {
        (false, ..) => own,
        (true, Some(first), Some(second)) => {
            let (first, second) = (first.clone(), second.clone());
            return Err(FramesError::Several { folder: folder.to_owned(), first, second });
        }
        (true, Some(only), None) => list(only)?.into_iter().filter(|path| is_frame(path)).collect(),
        (true, None, _) => Vec::new(),
    };
    if found.is_empty() {
        return Err(FramesError::None { folder: folder.to_owned() });
    }
    Ok(found)
}

/// Where a run whose frames are in `<name>-<label>` has this table, if it has any.
pub fn table_beside(frame: &Path, table: fn(&ResultPaths) -> PathBuf) -> Option<PathBuf> {
    let folder = std::path::absolute(frame).ok()?.parent()?.to_owned();
    let (beside, name) = (folder.parent()?, folder.file_name()?.to_str()?);
    let runs = name.rmatch_indices('-').map(|(end, _)| ResultPaths::new(beside, &name[..end]));
    runs.map(|run| table(&run)).find(|table| rows_of(table).is_some())
}

/// Sorted by the length of the names first, so that steps are in order however many digits they have.
fn list(folder: &Path) -> Result<Vec<PathBuf>, FramesError> {
    let mut paths = entries(folder).map_err(|error| FileError::new(folder, "be listed", error))?;
    paths.sort_by_key(|path| (name_of(path).len(), name_of(path)));
    Ok(paths)
}

fn is_frame(path: &Path) -> bool {
    let name = name_of(path);
    name.starts_with("particles-") && (name.ends_with(".xyz") || name.ends_with(".xyz.gz"))
}

/// The dimension of the first frame.
pub fn dimension(files: &[PathBuf]) -> Result<usize, FramesError> {
    let first = &files[0];
    Ok(xyz::dimension(first, &read_text(first)?)?)
}

/// All frames; each has the particles and the box of the first, whatever its tilt.
pub fn read_frames<const D: usize>(files: &[PathBuf]) -> Result<Vec<XyzFrame<D>>, FramesError> {
    let mut frames: Vec<XyzFrame<D>> = Vec::with_capacity(files.len());
    for path in files {
        let frame = XyzFrame::parse(path, &read_text(path)?)?;
        let is_stranger = frames.first().is_some_and(|first| {
            first.radii != frame.radii || first.container.tilted(0.0) != frame.container.tilted(0.0)
        });
        if is_stranger {
            return Err(FramesError::Strangers { path: path.clone(), first: files[0].clone() });
        }
        frames.push(frame);
    }
    Ok(frames)
}
