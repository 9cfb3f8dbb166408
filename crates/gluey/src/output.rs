//! Files of a run on disk. Nothing appears under its final name before it is complete, nothing is deleted
//! that a run did not make, and what another run is writing is not touched.

mod append_log;
mod claim;
pub mod csv;
pub mod forces;
mod pair_forces;
mod paths;
pub mod product_names;
mod pvd;
pub mod rheology;
pub mod solver_log;
pub mod vtk;
pub mod xyz;

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

pub(crate) use append_log::Draft;
pub use append_log::{DraftMark, RowsError};
pub use claim::ClaimError;
pub(crate) use claim::{ResultClaim, is_claimed};
pub use pair_forces::PairForces;
pub use paths::ResultPaths;

/// A file or folder could not be read or written.
#[derive(Debug, Error)]
#[error("{}: cannot {action}", path.display())]
pub struct FileError {
    /// The file or folder.
    pub path: PathBuf,
    /// The action that failed.
    pub action: &'static str,
    /// Why it failed.
    #[source]
    pub source: io::Error,
}

impl FileError {
    /// What failed, in words that follow "cannot".
    pub fn new(path: &Path, action: &'static str, source: io::Error) -> Self {
        Self { path: path.to_owned(), action, source }
    }

    /// That it cannot be read.
    pub fn unread(path: &Path, source: io::Error) -> Self {
        Self::new(path, "be read", source)
    }
}

/// A line of a table: numbers with so many decimals behind the first digit, 16 to read back exactly, and
/// empty cells where there is none.
pub fn line_of(numbers: impl IntoIterator<Item: Into<Option<f64>>>, decimals: usize) -> String {
    let cell = |number: Option<f64>| number.map_or(String::new(), |number| format!("{number:.decimals$e}"));
    let cells: Vec<String> = numbers.into_iter().map(|number| cell(number.into())).collect();
    cells.join(",") + "\n"
}

/// `path` with something behind its name.
fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

/// The name of draft `number` of `path`: what it is called while it is not complete.
fn draft_path(path: &Path, number: u32) -> PathBuf {
    with_suffix(path, &format!(".partial-{number}"))
}

/// The name of the complete file, if `name` is that of a draft.
pub fn undrafted(name: &str) -> Option<&str> {
    let (complete, number) = name.rsplit_once(".partial-")?;
    number.parse::<u32>().is_ok().then_some(complete)
}

/// Creates the first draft of `path` that is not there yet.
fn create_draft(path: &Path) -> io::Result<(u32, File)> {
    for number in 1..u32::MAX {
        match File::options().read(true).write(true).create_new(true).open(draft_path(path, number)) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            opened => return opened.map(|file| (number, file)),
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// All drafts of `path`, sorted by name.
pub(crate) fn drafts(path: &Path) -> Result<Vec<PathBuf>, FileError> {
    let Some(complete) = path.file_name().map(OsStr::to_string_lossy) else { return Ok(Vec::new()) };
    let failed = |error| FileError::new(folder_of(path), "list the folder", error);
    let entries = entries(folder_of(path)).map_err(failed)?;
    let names = entries.iter().filter_map(|entry| entry.file_name()?.to_str());
    let drafts = names.filter(|name| undrafted(name) == Some(&*complete));
    Ok(drafts.map(|name| path.with_file_name(name)).collect())
}

/// What is in a folder, sorted.
pub fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut paths = entries.collect::<io::Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}

/// The name of a file or folder.
pub fn name_of(path: &Path) -> String {
    path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned())
}

/// Makes sure that all drafts of these files outlive a power failure.
pub(crate) fn sync_drafts(paths: &[PathBuf]) -> Result<(), FileError> {
    for path in paths {
        for draft in drafts(path)? {
            let synced = File::options().write(true).open(&draft).and_then(|file| file.sync_data());
            synced.map_err(|error| FileError::new(&draft, "write the file", error))?;
        }
    }
    Ok(())
}

/// Where the rows of `path` are: in the complete file or, where there is none, in the last draft of it.
pub fn rows_of(path: &Path) -> Option<PathBuf> {
    if path.exists() {
        return Some(path.to_owned());
    }
    let number = |draft: &PathBuf| draft.to_str()?.rsplit_once('-')?.1.parse::<u32>().ok();
    drafts(path).ok()?.into_iter().max_by_key(number)
}

/// The text of a table up to its last whole line: that of a run that goes on, or was killed, may be half.
pub fn whole_lines(path: &Path) -> Result<String, FileError> {
    let mut text = crate::text::read(path).map_err(|error| FileError::unread(path, error))?;
    if path.to_str().is_some_and(|name| undrafted(name).is_some()) {
        text.truncate(text.rfind('\n').map_or(0, |end| end + 1));
    }
    Ok(text)
}

/// The folder of a file; `.` for the present one.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Creates the folder of `path` if it is missing, and makes sure that `path` can be a file in it.
pub fn prepare_folder_of(path: &Path) -> Result<(), FileError> {
    if path.file_name().is_none() || path.is_dir() {
        let source = io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, not a file");
        return Err(FileError::new(path, "write the file", source));
    }
    let folder = folder_of(path);
    fs::create_dir_all(folder).map_err(|error| FileError::new(folder, "create the folder", error))
}

/// Gives a complete draft its name, for good: after a power failure it is there, too.
fn rename(draft: &Path, path: &Path) -> io::Result<()> {
    fs::rename(draft, path)?;
    sync_folder_of(path)
}

/// Folders can be opened, and so be written back, on Unix only.
fn sync_folder_of(path: &Path) -> io::Result<()> {
    if cfg!(unix) { File::open(folder_of(path))?.sync_all() } else { Ok(()) }
}

/// Writes `bytes` so that `path` holds either all of them or what it held before.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let write = || {
        let (number, mut file) = create_draft(path)?;
        let draft = draft_path(path, number);
        let written =
            file.write_all(bytes).and_then(|()| file.sync_all()).and_then(|()| rename(&draft, path));
        if written.is_err() {
            // Half a file is of no use; that it stays is the lesser fault.
            let _ = fs::remove_file(&draft);
        }
        written
    };
    write().map_err(|error| FileError::new(path, "write the file", error))
}

/// Removes a file that another one takes the place of, if it is there.
pub(crate) fn remove_stale(path: &Path) -> Result<(), FileError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(FileError::new(path, "remove what an earlier run left", error))
        }
        _ => Ok(()),
    }
}

/// Puts a file of an earlier run out of the way, as the first `<path>.earlier-K` that is not there yet;
/// `None` if there is no such file.
pub(crate) fn set_aside(path: &Path) -> Result<Option<PathBuf>, FileError> {
    if !path.exists() {
        return Ok(None);
    }
    let names = (1..u32::MAX).map(|number| with_suffix(path, &format!(".earlier-{number}")));
    let Some(free) = names.into_iter().find(|name| !name.exists()) else { return Ok(None) };
    rename(path, &free).map_err(|error| FileError::new(path, "set the file aside", error))?;
    Ok(Some(free))
}
