//! A run of a study.

use std::path::Path;

use gluey::case::Override;
use gluey::table::{Table, TableError};
use gluey::{
    Case, CaseError, OccupiedError, RecordError, RecordOptions, ResultPaths, RunError, RunOptions, RunRecord,
    RunReport,
};
use thiserror::Error;

use crate::book::chain;
use crate::book::progress::Board;
use gluey::progress::duration;

/// Minutes between checkpoints.
const CHECKPOINT_MINUTES: f64 = 2.0;

/// A case of `data/studies` with keys set otherwise.
#[derive(Clone, Debug)]
pub struct Point {
    /// Name of its folder.
    pub name: String,
    /// What is run, a line for each model.
    pub model: &'static str,
    /// Where it stands on the axis of the study.
    pub at: f64,
    file: &'static str,
    set: Vec<String>,
}

/// A point with its results.
pub struct Done {
    /// The point.
    pub point: Point,
    /// The case that was run.
    pub case: Case,
    /// What came out.
    pub report: RunReport,
    /// The trajectory.
    pub trajectory: Table,
    /// The rheology, where there is one.
    pub rheology: Option<Table>,
}

/// A point has no results.
#[derive(Debug, Error)]
pub enum PointError {
    /// A key cannot be set so.
    #[error("`{0}` sets no key")]
    Override(String),
    /// The case is not good.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The run that is there has no record.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A run without a report.
    #[error("the record of the run has no report")]
    NoReport,
    /// Results cannot be read.
    #[error("{path} cannot be read")]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// Results are no table, or not the expected one.
    #[error(transparent)]
    Table(#[from] TableError),
}

impl Point {
    /// A point of the study whose case is in `file`.
    pub fn new(name: String, model: &'static str, at: f64, file: &'static str) -> Self {
        Self { name, model, at, file, set: Vec::new() }
    }

    /// The same with a key set; `value` as TOML.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl std::fmt::Display) -> Self {
        self.set.push(format!("{key}={value}"));
        self
    }

    /// The case.
    pub fn case(&self, data: &Path) -> Result<Case, PointError> {
        let parse = |text: &String| text.parse::<Override>().map_err(|_| PointError::Override(text.clone()));
        let set = self.set.iter().map(parse).collect::<Result<Vec<_>, _>>()?;
        Ok(Case::load_with(data.join(self.file), &set)?)
    }

    /// Runs it in a folder of its own, or takes what is there.
    pub fn run(&self, data: &Path, out: &Path, board: &Board) -> Result<Done, PointError> {
        let case = self.case(data)?;
        let paths = ResultPaths::new(out.join(&self.name), case.file_stem());
        let line = board.start(&self.name);
        let result = report(&case, &paths, &line);
        match &result {
            Ok(report) => line.finish(&format!("done in {}", duration(report.wall_s))),
            Err(error) => line.finish(&format!("failed: {}", chain(error))),
        }
        let report = result?;
        let rheology =
            case.has_rheology().then(|| table(&gluey::output::rheology::rheology_path(&paths.csv())));
        Ok(Done {
            point: self.clone(),
            report,
            trajectory: table(&paths.csv())?,
            rheology: rheology.transpose()?,
            case,
        })
    }
}

/// Runs, goes on, or reads what a complete run of this case left.
fn report(case: &Case, paths: &ResultPaths, line: &dyn gluey::Progress) -> Result<RunReport, PointError> {
    let checkpoint = paths.checkpoint();
    let options = RunOptions {
        checkpoint: Some(checkpoint.clone()),
        checkpoint_minutes: Some(CHECKPOINT_MINUTES),
        record: Some(RecordOptions { force: false }),
        ..RunOptions::csv(paths.csv())
    };
    let outcome = match RunRecord::read(&paths.record()) {
        Ok(record) if record.report.is_none() && checkpoint.exists() => {
            gluey::run(case, &RunOptions { resume: Some(checkpoint), ..options }, line)
        }
        _ => gluey::run(case, &options, line),
    };
    match outcome {
        Err(RunError::Occupied(OccupiedError::Complete { record, .. })) => {
            RunRecord::read(&record)?.report.ok_or(PointError::NoReport)
        }
        other => Ok(other?),
    }
}

fn table(path: &Path) -> Result<Table, PointError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| PointError::Read { path: path.display().to_string(), source })?;
    Ok(Table::parse(&text)?)
}
