//! Keeps the record of a run.

use std::io;
use std::path::{Path, PathBuf};

use super::error::RunError;
use super::options::RunOptions;
use super::record::{RunRecord, RunState, in_full};
use crate::case::Case;
use crate::output::{FileError, ResultPaths, write_atomically};
use crate::progress::{Notice, Progress};
use crate::report::RunReport;

/// The record of a run in progress.
#[derive(Debug)]
pub(super) struct Recorder {
    path: PathBuf,
    record: RunRecord,
}

impl Recorder {
    /// Writes the case as it is run and the record of a run that begins after `step` steps and has its rows
    /// in the file `rows`, if `options` ask for them.
    pub fn begin(
        case: &Case,
        options: &RunOptions,
        step: usize,
        rows: &Path,
    ) -> Result<Option<Self>, FileError> {
        if options.record.is_none() {
            return Ok(None);
        }
        let paths = ResultPaths::of_csv(&options.csv);
        let mut record = RunRecord::new(&case.name, options);
        record.seed = case.seed;
        if options.resume.is_some()
            && let Ok(before) = RunRecord::read(&paths.record())
        {
            record.started = before.started;
            record.resumed = before.resumed + 1;
            record.seed = record.seed.or(before.seed);
        }
        (record.steps, record.steps_done) = (case.step_count(), step);
        record.rows = rows.file_name().map(|name| name.to_string_lossy().into_owned());
        write_case(case, &record, &paths)?;
        let recorder = Self { path: paths.record(), record };
        recorder.record.write(&recorder.path)?;
        Ok(Some(recorder))
    }

    /// Notes that a checkpoint after `step` steps is on disk.
    pub fn reached(&mut self, step: usize) -> Result<(), FileError> {
        self.record.steps_done = step;
        self.record.write(&self.path)
    }

    /// Notes that the run was asked to stop after `step` steps; gives what should be known if it cannot be
    /// noted.
    pub fn interrupted(&mut self, step: usize) -> Option<Notice> {
        self.record.end(RunState::Interrupted, step);
        self.write_or_tell()
    }

    fn write_or_tell(&self) -> Option<Notice> {
        let failed = self.record.write(&self.path).err();
        failed.map(|error| Notice::NoRecord { path: error.path, reason: error.source.to_string() })
    }

    /// Notes how the run ended after `step` steps, and hands that on. That a run failed is told even where it
    /// cannot be noted.
    pub fn close(
        mut self,
        step: usize,
        outcome: Result<Option<RunReport>, RunError>,
        progress: &dyn Progress,
    ) -> Result<Option<RunReport>, RunError> {
        match &outcome {
            Ok(report) => {
                self.record.end(RunState::Complete, report.as_ref().map_or(step, |report| report.steps));
                (self.record.report, self.record.rows) = (report.clone(), None);
                self.record.write(&self.path)?;
            }
            Err(error) => {
                let interrupted = matches!(error, RunError::Interrupted(_));
                self.record.end(if interrupted { RunState::Interrupted } else { RunState::Failed }, step);
                self.record.error = (!interrupted).then(|| in_full(error));
                self.write_or_tell().iter().for_each(|notice| progress.notice(notice));
            }
        }
        outcome
    }
}

fn write_case(case: &Case, record: &RunRecord, paths: &ResultPaths) -> Result<(), FileError> {
    let path = paths.case_file();
    let encoded = case.to_toml().map_err(io::Error::other);
    let text = encoded.map_err(|error| FileError::new(&path, "encode the case", error))?;
    let seed = record
        .seed
        .map_or(String::new(), |seed| format!(" Its particles were generated from the seed {seed}."));
    let head = format!(
        "# The case as gluey {} ran it, with all overrides and defaults; it alone suffices to run it again.{seed}\n",
        record.gluey
    );
    write_atomically(&path, format!("{head}{text}").as_bytes())
}
