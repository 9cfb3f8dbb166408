//! What a run leaves on disk. Nothing appears under its final name before it is complete.

pub mod csv;
mod pvd;
pub mod vtk;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A file could not be written.
#[derive(Debug, Error)]
#[error("{}: cannot {action}", path.display())]
pub struct OutputError {
    /// The file or folder.
    pub path: PathBuf,
    /// What was tried.
    pub action: &'static str,
    /// Why it failed.
    #[source]
    pub source: io::Error,
}

impl OutputError {
    pub(crate) fn new(path: &Path, action: &'static str, source: io::Error) -> Self {
        Self { path: path.to_owned(), action, source }
    }
}

/// The name a file has while it is not complete.
pub(crate) fn partial(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".partial");
    PathBuf::from(name)
}

/// Creates the folder of `path` if it is missing, and makes sure that a file can be written there.
pub(crate) fn prepare_folder_of(path: &Path) -> Result<(), OutputError> {
    if path.file_name().is_none() || path.is_dir() {
        let source = io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, not a file");
        return Err(OutputError::new(path, "write the file", source));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(|error| OutputError::new(folder, "create the folder", error))?;
    let probe = partial(path);
    File::options()
        .create(true)
        .append(true)
        .open(&probe)
        .and_then(|_| fs::remove_file(&probe))
        .map_err(|error| OutputError::new(folder, "write into the folder", error))
}

/// Writes `bytes` so that `path` holds either all of them or what it held before.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let draft = partial(path);
    let write = || {
        let mut file = File::create(&draft)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&draft, path)
    };
    write().map_err(|error| OutputError::new(path, "write the file", error))
}
