//! How far a study is, by what lies in its folder.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::SweepError;
use super::study::Manifest;
use crate::output::ResultPaths;
use crate::report::RunReport;
use crate::run::{RunRecord, RunState};

/// A study and its points.
#[derive(Clone, Debug, Serialize)]
pub struct StudyProgress {
    /// Folder of the study.
    pub folder: PathBuf,
    /// The swept keys.
    pub keys: Vec<String>,
    /// Its points, in the order in which they are run.
    pub points: Vec<PointProgress>,
}

/// A point of a study.
#[derive(Clone, Debug, Serialize)]
pub struct PointProgress {
    /// Name of the point and of its folder.
    pub name: String,
    /// Values of the swept keys, as they were written.
    pub values: Vec<String>,
    /// How it is.
    pub state: PointStage,
    /// Why it failed, where it did.
    pub error: Option<String>,
    /// Its report, where it is done.
    pub report: Option<RunReport>,
}

/// The stage that a point is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PointStage {
    /// Complete.
    Done,
    /// It ended with an error.
    Failed,
    /// A process writes its results now.
    Running,
    /// Not begun, or not run to its end.
    Left,
}

impl StudyProgress {
    /// Of the study in a folder; `None` if there is none.
    ///
    /// # Errors
    /// When what it says of itself, or a record of a point, cannot be read.
    pub fn read(folder: &Path) -> Result<Option<Self>, SweepError> {
        let manifest = if folder.is_dir() { Manifest::read(folder)? } else { None };
        let Some(Manifest { keys, points, .. }) = manifest else { return Ok(None) };
        let points = points.into_iter().map(|point| {
            let record = record(&folder.join(&point.name))?;
            let (state, error, report) = record.map_or((PointStage::Left, None, None), |(record, state)| {
                (state, record.error, record.report)
            });
            Ok(PointProgress { name: point.name, values: point.values, state, error, report })
        });
        let points = points.collect::<Result<_, SweepError>>()?;
        Ok(Some(Self { folder: folder.to_owned(), keys, points }))
    }

    /// Number of points in a state.
    pub fn count(&self, state: PointStage) -> usize {
        self.points.iter().filter(|point| point.state == state).count()
    }
}

/// The record of the run of a point, and how it is.
fn record(folder: &Path) -> Result<Option<(RunRecord, PointStage)>, SweepError> {
    let runs = ResultPaths::in_folder(folder).unwrap_or_default();
    let Some(paths) = runs.first() else { return Ok(None) };
    let record = RunRecord::read(&paths.record())?;
    let state = match record.state {
        RunState::Complete => PointStage::Done,
        RunState::Failed => PointStage::Failed,
        RunState::Running if paths.are_being_written() => PointStage::Running,
        RunState::Running | RunState::Interrupted => PointStage::Left,
    };
    Ok(Some((record, state)))
}
