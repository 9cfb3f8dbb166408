//! Where a run writes its checkpoints: two generations of them.

use std::collections::VecDeque;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::options::RunOptions;
use crate::case::Case;
use crate::checkpoint::{Checkpoint, CheckpointSummary, FlowPieces};
use crate::output::{FileError, ResultPaths, set_aside};
use crate::progress::Notice;

/// Checkpoints that are there at a time.
const GENERATIONS: usize = 2;

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
#[derive(Debug)]
pub(super) struct CheckpointFile {
    path: PathBuf,
    found: Found,
    /// Pieces of the flow of the last checkpoint and of the one before.
    pieces: VecDeque<Option<FlowPieces>>,
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
        // The older first; those that stay for somebody else are not this run's to remove.
        let pieces = match found {
            Found::Wanted => VecDeque::new(),
            Found::OwnPrevious => [pieces_of(&ResultPaths::previous(&path))].into(),
            _ => [pieces_of(&ResultPaths::previous(&path)), pieces_of(&path)].into(),
        };
        Some(Self { path, found, pieces })
    }

    /// Whether what is there is the run's own, of the step that it goes on from.
    pub fn is_own(&self) -> bool {
        self.found == Found::Own
    }

    /// Whether what is there may be wanted by somebody else.
    pub fn is_wanted(&self) -> bool {
        self.found == Found::Wanted
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a checkpoint, whose pieces of the flow are there, and gives what should be known of files that
    /// were in its way. There is a whole one under one of the two names at every moment.
    pub fn write<const D: usize>(
        &mut self,
        checkpoint: &Checkpoint<D>,
        case: &Case,
    ) -> Result<Vec<Notice>, FileError> {
        let notices = self.keep_the_last()?;
        checkpoint.write(case, &self.path)?;
        self.pieces.push_back(checkpoint.pieces.clone());
        self.remove_old_pieces().map(|()| notices)
    }

    /// Removes pieces of checkpoints that are not there any more.
    fn remove_old_pieces(&mut self) -> Result<(), FileError> {
        while self.pieces.len() > GENERATIONS {
            let Some(old) = self.pieces.pop_front().flatten() else { continue };
            if self.pieces.contains(&Some(old.clone())) {
                continue;
            }
            for path in (0..old.count).map(|run| old.path(&self.path, run)) {
                remove(&path)
                    .map_err(|error| FileError::new(&path, "remove an old piece of a flow", error))?;
            }
        }
        Ok(())
    }

    /// Makes room for another checkpoint.
    fn keep_the_last(&mut self) -> Result<Vec<Notice>, FileError> {
        let older = ResultPaths::previous(&self.path);
        let failed = |error| FileError::new(&older, "keep the checkpoint before the last", error);
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
        let mut notices = Vec::new();
        for from in away {
            if let Some(to) = set_aside(from)? {
                notices.push(Notice::CheckpointSetAside { from: (*from).clone(), to });
            }
        }
        Ok(notices)
    }
}

/// The pieces that belong to a checkpoint, if it is one.
fn pieces_of(checkpoint: &Path) -> Option<FlowPieces> {
    CheckpointSummary::read(checkpoint).ok()?.pieces
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
