//! The last whole step of a run: what a checkpoint holds. It can be saved at any moment, also from another
//! thread than that of the run, which may be busy for long.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::checkpoint_file::CheckpointFile;
use super::last_steps::{Ended, OfRun, locked};
use super::log;
use super::options::RunOptions;
use super::recorder::Recorder;
use crate::case::Case;
use crate::checkpoint::{Checkpoint, FlowPieces};
use crate::output::vtk::OnTheirWay;
use crate::output::{FileError, ResultPaths, sync_drafts};
use crate::progress::Notice;

/// The last whole step of a run, and the files that tell of it.
#[derive(Debug)]
pub(super) struct LastStep<const D: usize> {
    case: Case,
    paths: ResultPaths,
    /// Where it is saved, if it is to be.
    file: Option<CheckpointFile>,
    pub recorder: Option<Recorder>,
    frames: OnTheirWay,
    /// The run before the step that is being done, where there is a file for it.
    pub checkpoint: Option<Checkpoint<D>>,
    /// The step that was saved last.
    saved: Option<usize>,
    /// Whether the run comes to its end without another step.
    pub is_ending: bool,
}

impl<const D: usize> LastStep<D> {
    /// That of a run that goes on after `step` steps, before it keeps any.
    pub fn before(
        case: &Case,
        options: &RunOptions,
        file: Option<CheckpointFile>,
        recorder: Option<Recorder>,
        frames: OnTheirWay,
        step: usize,
    ) -> Arc<Mutex<Self>> {
        let saved = file.as_ref().filter(|file| file.is_own()).map(|_| step);
        let (case, paths) = (case.clone(), ResultPaths::of_csv(&options.csv));
        let (checkpoint, is_ending) = (None, false);
        Arc::new(Mutex::new(Self { case, paths, file, recorder, frames, checkpoint, saved, is_ending }))
    }

    /// Steps done at the last whole step, where it is kept.
    pub fn step(&self) -> Option<usize> {
        self.checkpoint.as_ref().map(|checkpoint| checkpoint.state.step)
    }

    /// Whether there is a checkpoint to write; what it counts on is on disk then.
    pub fn is_due(&self) -> Result<bool, FileError> {
        let (Some(file), Some(step)) = (&self.file, self.step()) else { return Ok(false) };
        // Before the first step there is nothing to lose that is worth more than another run's checkpoint.
        if self.saved == Some(step) || (step == 0 && file.is_wanted()) {
            return Ok(false);
        }
        sync_drafts(&self.paths.tables())?;
        self.frames.wait();
        Ok(true)
    }

    /// A name for files of the checkpoint, by its content.
    pub fn name(&self) -> Result<u64, FileError> {
        let Some(checkpoint) = &self.checkpoint else { return Ok(0) };
        let path = self.file.as_ref().map_or(Path::new(""), CheckpointFile::path);
        let encode = |error| FileError::new(path, "encode the checkpoint", io::Error::other(error));
        let digest = blake3::hash(&postcard::to_stdvec(&checkpoint.state).map_err(encode)?);
        Ok(digest.as_bytes()[..8].iter().fold(0, |name, &byte| name << 8 | u64::from(byte)))
    }

    /// Writes a checkpoint with these pieces of the flow, if one is due, and gives what should be known.
    pub fn save(&mut self, pieces: Option<FlowPieces>) -> Result<Vec<Notice>, FileError> {
        let is_due = self.is_due()?;
        let (true, Some(file), Some(checkpoint)) = (is_due, &mut self.file, &mut self.checkpoint) else {
            return Ok(Vec::new());
        };
        let step = checkpoint.state.step;
        checkpoint.pieces = pieces;
        let notices = file.write(checkpoint, &self.case)?;
        self.saved = Some(step);
        self.recorder.as_mut().map_or(Ok(()), |recorder| recorder.reached(step)).map(|()| notices)
    }

    /// The same where a failure is told and no more.
    fn save_or_tell(&mut self) -> Vec<Notice> {
        let path = self.file.as_ref().map_or(PathBuf::new(), |file| file.path().to_owned());
        self.save(None).unwrap_or_else(|error| {
            let reason = error.source.to_string();
            vec![Notice::NoCheckpoint { path, reason }]
        })
    }

    /// That the run ended at this step.
    fn ended(&self) -> Ended {
        let step = self.step().unwrap_or(0);
        let time = step as f64 * self.case.time.step;
        let checkpoint = self.saved.and(self.file.as_ref()).map(|file| file.path().to_owned());
        Ended { step, steps: self.case.step_count(), time, checkpoint }
    }
}

impl<const D: usize> OfRun for Mutex<LastStep<D>> {
    fn save(&self) -> Vec<Notice> {
        let mut last = locked(self);
        if last.is_ending { Vec::new() } else { last.save_or_tell() }
    }

    fn end(&self) -> Option<(Ended, Vec<Notice>)> {
        let mut last = locked(self);
        if last.is_ending {
            return None;
        }
        let mut notices = last.save_or_tell();
        let ended = last.ended();
        log::note(&last.paths, &ended.to_string());
        notices.extend(last.recorder.as_mut().and_then(|recorder| recorder.interrupted(ended.step)));
        // The run waits for this lock before it writes anything else of its state.
        std::mem::forget(last);
        Some((ended, notices))
    }
}
