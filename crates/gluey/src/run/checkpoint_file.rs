//! Where a run writes its checkpoints: two generations of them.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use gluey_geom::{Dim, Space};

use super::options::RunOptions;
use super::paths::ResultPaths;
use crate::case::Case;
use crate::checkpoint::Checkpoint;
use crate::output::{OutputError, set_aside};
use crate::progress::{Notice, Progress};

/// Whose the files are that a run finds where it is to write its first checkpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Found {
    /// Its own: the newer one becomes the previous one.
    Own,
    /// The previous one is its own; the newer one could not be used.
    OwnPrevious,
    /// Those of an earlier run, whose drafts are still there: it may want to go on from them.
    Wanted,
    /// Those of an earlier run that came to its end.
    Unwanted,
}

/// The checkpoint of a run, and the one before it.
pub(super) struct CheckpointFile {
    path: PathBuf,
    found: Found,
}

impl CheckpointFile {
    /// Where `options` say; `has_drafts` tells whether earlier runs left rows.
    pub fn new(options: &RunOptions, has_drafts: bool) -> Option<Self> {
        let path = options.checkpoint.clone()?;
        let full = |path: &Path| path.canonicalize().ok();
        let resumes = |path: &Path| options.resume.as_deref().is_some_and(|file| full(file) == full(path));
        let found = match (resumes(&path), resumes(&ResultPaths::previous(&path)), has_drafts) {
            (true, ..) => Found::Own,
            (_, true, _) => Found::OwnPrevious,
            (.., true) => Found::Wanted,
            _ => Found::Unwanted,
        };
        Some(Self { path, found })
    }

    /// Writes a checkpoint. There is a whole one under one of the two names at every moment.
    pub fn write<const D: usize>(
        &mut self,
        checkpoint: &Checkpoint<D>,
        case: &Case,
        progress: &dyn Progress,
    ) -> Result<(), OutputError>
    where
        Dim<D>: Space<D>,
    {
        let older = ResultPaths::previous(&self.path);
        let failed = |error| OutputError::new(&older, "keep the checkpoint before the last", error);
        let away: &[&PathBuf] = match std::mem::replace(&mut self.found, Found::Own) {
            Found::Own => {
                keep(&self.path, &older).map_err(failed)?;
                &[]
            }
            Found::OwnPrevious => &[&self.path],
            Found::Wanted => &[&self.path, &older],
            Found::Unwanted => {
                remove(&older).map_err(failed)?;
                &[]
            }
        };
        for from in away {
            if let Some(to) = set_aside(from)? {
                progress.notice(&Notice::CheckpointSetAside { from: (*from).clone(), to });
            }
        }
        checkpoint.write(case, &self.path)
    }
}

/// Makes `older` another name of the file `path`, which keeps its own, or a copy where files have one name.
fn keep(path: &Path, older: &Path) -> io::Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let fresh = older.with_extension("previous-new");
    remove(&fresh)?;
    fs::hard_link(path, &fresh).or_else(|_| fs::copy(path, &fresh).map(|_| ()))?;
    fs::rename(&fresh, older)
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
