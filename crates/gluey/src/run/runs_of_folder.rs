//! The runs that left records in a folder.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::output::{FileError, ResultPaths};

/// What `gluey sweep` leaves in its folder.
pub(crate) const TABLE_OF_STUDY: &str = "sweep.csv";

/// A folder in which no run can be found.
#[derive(Debug, Error)]
pub enum FolderError {
    /// It cannot be listed.
    #[error(transparent)]
    Read(#[from] FileError),
    /// It has no record of any run.
    #[error("{}: no run is recorded there (no file *-run.json)", folder.display())]
    NoRun {
        /// The folder.
        folder: PathBuf,
    },
    /// It is that of a study.
    #[error("{}: a study, whose table is {TABLE_OF_STUDY}: name the folder of one of its points", folder.display())]
    Study {
        /// The folder.
        folder: PathBuf,
    },
}

/// The runs, sorted by name; one at least.
///
/// # Errors
/// [`FolderError`] if there is none.
pub fn recorded_runs(folder: &Path) -> Result<Vec<ResultPaths>, FolderError> {
    let folder = folder.to_owned();
    match ResultPaths::in_folder(&folder) {
        Ok(runs) if runs.is_empty() && folder.join(TABLE_OF_STUDY).exists() => {
            Err(FolderError::Study { folder })
        }
        Ok(runs) if runs.is_empty() => Err(FolderError::NoRun { folder }),
        Ok(runs) => Ok(runs),
        Err(error) => Err(FileError::unread(&folder, error).into()),
    }
}
