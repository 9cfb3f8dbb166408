//! `gluey info`.

use std::path::{Path, PathBuf};

use clap::Args;
use gluey::sweep::{PointStage, StudyProgress, SweepError};
use gluey::{
    Case, CaseSummary, CheckpointSummary, FileError, FolderError, RecordError, ResultPaths, RunRecord,
    RunState, recorded_runs, shown,
};
use serde::Serialize;
use thiserror::Error;

use super::failure::Failure;
use crate::terminal::{print_json, print_lines};

/// Arguments of `gluey info`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  gluey info pair.toml\n  gluey info out --json\n  gluey info \
                        out/pair-gluey.checkpoint")]
pub struct InfoArguments {
    /// A case file, a checkpoint, a record of a run, or a folder of results or of a study.
    path: PathBuf,
    /// Print it as JSON.
    #[arg(long)]
    json: bool,
}

/// A path of which there is nothing to say.
#[derive(Debug, Error)]
enum InfoError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] FileError),
    /// A folder without runs.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A record cannot be read.
    #[error("the record of a run cannot be used")]
    Record(#[from] RecordError),
    /// A study cannot be read.
    #[error(transparent)]
    Study(#[from] SweepError),
}

/// The facts about a path.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Info {
    Case(CaseSummary),
    Checkpoint(CheckpointInfo),
    Folder { runs: Vec<RunInfo> },
    Study(StudyProgress),
}

/// The facts that a checkpoint tells of itself.
#[derive(Debug, Serialize)]
struct CheckpointInfo {
    file: PathBuf,
    case: CaseSummary,
    step: usize,
    time: f64,
    wall_s: f64,
    gluey: String,
    layout: u32,
}

/// A run that left a record.
#[derive(Debug, Serialize)]
struct RunInfo {
    /// What its files begin with.
    name: String,
    /// `running`, `complete`, `interrupted`, `failed`, or `killed`: it was running, and no process writes its
    /// results now.
    state: String,
    /// Steps done: those that rows on disk tell of where the run is going on or was killed.
    steps_done: usize,
    /// Time after them; absent where the case as run cannot be read.
    time: Option<f64>,
    /// The file of its rows, and how many whole ones are in it.
    rows: Option<(PathBuf, usize)>,
    case: Option<CaseSummary>,
    record: RunRecord,
    checkpoints: Vec<CheckpointState>,
}

/// A checkpoint of a run.
#[derive(Debug, Serialize)]
struct CheckpointState {
    file: PathBuf,
    /// Steps done, where it is whole.
    step: Option<usize>,
    /// What is wrong with it, where it is not.
    error: Option<String>,
}

impl InfoArguments {
    /// Says what the path is.
    pub fn run(&self) -> Result<(), Failure> {
        let info = Info::of(&self.path)?;
        match (self.json, &info) {
            (true, _) => print_json(&info),
            (_, Info::Case(case)) => print_lines(&case.lines()),
            (_, Info::Checkpoint(checkpoint)) => print_lines(&checkpoint.lines()),
            (_, Info::Study(study)) => print_lines(&lines_of(study)),
            (_, Info::Folder { runs }) => runs.iter().for_each(|run| print_lines(&run.lines())),
        }
        Ok(())
    }
}

impl Info {
    fn of(path: &Path) -> Result<Self, Failure> {
        if let Some(study) = StudyProgress::read(path).map_err(|error| failure(error.into()))? {
            return Ok(Self::Study(study));
        }
        if path.is_dir() {
            return Ok(Self::Folder { runs: runs(path).map_err(failure)? });
        }
        if let Some(paths) = ResultPaths::of_record(path) {
            return Ok(Self::Folder { runs: vec![RunInfo::of(&paths).map_err(failure)?] });
        }
        if CheckpointSummary::is_announced_by(path).map_err(|error| failure(error.into()))? {
            let info = CheckpointInfo::of(path).map_err(|error| Failure::new(error, None))?;
            return Ok(Self::Checkpoint(info));
        }
        Ok(Self::Case(CaseSummary::of(&Case::load(path)?)))
    }
}

fn failure(error: InfoError) -> Failure {
    let hint = match &error {
        InfoError::Record(_) | InfoError::Study(_) | InfoError::Folder(FolderError::Study { .. }) => None,
        _ => Some("give a case file, a checkpoint, or the folder that a run wrote to".to_owned()),
    };
    Failure::new(error, hint)
}

/// How many points of a study are done, failed and left, and which those are that need a look.
fn lines_of(study: &StudyProgress) -> Vec<(&'static str, String)> {
    let count = |state| study.count(state);
    let [done, failed, running, left] =
        [PointStage::Done, PointStage::Failed, PointStage::Running, PointStage::Left].map(count);
    let now = if running > 0 { format!(", {running} running") } else { String::new() };
    let mut lines = vec![
        ("study", format!("{}, of {}", study.folder.display(), study.keys.join(", "))),
        ("points", format!("{}: {done} done, {failed} failed{now}, {left} left", study.points.len())),
    ];
    for point in &study.points {
        let error = || point.error.as_deref().unwrap_or("no reason is recorded");
        match point.state {
            PointStage::Failed => lines.push(("failed", format!("{}: {}", point.name, error()))),
            PointStage::Running => lines.push(("running", point.name.clone())),
            PointStage::Left => lines.push(("left", point.name.clone())),
            PointStage::Done => {}
        }
    }
    lines
}

fn runs(folder: &Path) -> Result<Vec<RunInfo>, InfoError> {
    recorded_runs(folder)?.iter().map(RunInfo::of).collect()
}

impl CheckpointInfo {
    fn of(path: &Path) -> Result<Self, gluey::CheckpointError> {
        let CheckpointSummary { layout, gluey, case, step, wall_s, .. } = CheckpointSummary::read(path)?;
        let (file, time) = (path.to_owned(), step as f64 * case.time.step);
        Ok(Self { file, case: CaseSummary::without_end(&case), step, time, wall_s, gluey, layout })
    }

    fn lines(&self) -> Vec<(&'static str, String)> {
        let Self { file, step, time, wall_s, gluey, layout, .. } = self;
        let mut lines = vec![
            ("checkpoint", file.display().to_string()),
            ("state", format!("after step {step}, t = {}, {wall_s:.1} s of wall time", shown(*time))),
            ("written by", format!("gluey {gluey}, layout {layout}")),
        ];
        lines.extend(self.case.lines());
        lines
    }
}

impl RunInfo {
    fn of(paths: &ResultPaths) -> Result<Self, InfoError> {
        let record = RunRecord::read(&paths.record())?;
        let case = Case::load(paths.case_file()).ok();
        let files = [paths.checkpoint(), paths.previous_checkpoint()];
        let rows = record.rows_on_disk(paths);
        let steps_done = match (record.state, &rows) {
            (RunState::Running, Some((_, count))) => record.steps_done.max(count.saturating_sub(1)),
            _ => record.steps_done,
        };
        Ok(Self {
            name: paths.stem(),
            state: match record.state {
                RunState::Running if !paths.are_being_written() => "killed".into(),
                state => state.to_string(),
            },
            steps_done,
            time: case.as_ref().map(|case| steps_done as f64 * case.time.step),
            rows,
            case: case.as_ref().map(CaseSummary::of),
            record,
            checkpoints: files.into_iter().filter(|file| file.exists()).map(CheckpointState::of).collect(),
        })
    }

    fn lines(&self) -> Vec<(&'static str, String)> {
        let record = &self.record;
        let time = self.time.map_or(String::new(), |time| format!(", t = {}", shown(time)));
        let mut lines = vec![
            ("run", self.name.clone()),
            ("state", format!("{}, {} of {} steps done{time}", self.state, self.steps_done, record.steps)),
        ];
        lines
            .extend(self.rows.iter().map(|(file, count)| ("rows", format!("{count} in {}", file.display()))));
        lines.extend(record.error.iter().map(|error| ("error", error.clone())));
        let ended = record.ended.as_ref().map_or(String::new(), |ended| format!(", ended {ended}"));
        lines.push(("started", format!("{}{ended}, resumed {} times", record.started, record.resumed)));
        let machine = &record.machine;
        lines.push((
            "machine",
            format!(
                "{} {}, {} threads on {} processors",
                machine.os, machine.arch, record.threads, machine.cpus
            ),
        ));
        lines.push(("written by", format!("gluey {}", record.gluey)));
        lines.extend(self.checkpoints.iter().map(|checkpoint| ("checkpoint", checkpoint.line())));
        if self.checkpoints.is_empty() && record.state != RunState::Complete {
            lines.push(("checkpoint", "none".to_owned()));
        }
        // The record has the number of steps.
        lines.extend(self.case.iter().flat_map(CaseSummary::lines).filter(|(key, _)| *key != "run"));
        lines
    }
}

impl CheckpointState {
    fn of(file: PathBuf) -> Self {
        match CheckpointSummary::read(&file) {
            Ok(summary) => Self { file, step: Some(summary.step), error: None },
            Err(error) => Self { file, step: None, error: Some(error.to_string()) },
        }
    }

    fn line(&self) -> String {
        match (&self.error, self.step) {
            (Some(error), _) => error.clone(),
            (None, step) => format!("{}, after step {}", self.file.display(), step.unwrap_or_default()),
        }
    }
}
