//! A run of a study.

use std::path::Path;

use anyhow::{Context, anyhow};
use gluey::case::Override;
use gluey::table::NumberTable;
use gluey::{Case, OccupiedError, RecordOptions, ResultPaths, RunError, RunOptions, RunRecord, RunReport};

use crate::book::progress::Board;

/// The longest step with which a viscosity with rough contacts is right to 1 % (`docs/studies.md`).
pub const COARSE_STEP: f64 = 0.04;
/// A tolerance of the flow that changes that viscosity by less than the step does.
const COARSE_TOLERANCE: f64 = 1e-5;

/// Minutes between checkpoints.
const CHECKPOINT_MINUTES: f64 = 2.0;

/// A case of `data/studies` with keys set otherwise.
#[derive(Clone, Debug)]
pub struct StudyPoint {
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
    pub point: StudyPoint,
    /// The case that was run.
    pub case: Case,
    /// What came out.
    pub report: RunReport,
    /// The trajectory.
    pub trajectory: NumberTable,
    /// The rheology, where there is one.
    pub rheology: Option<NumberTable>,
    /// What each step cost, and its contacts.
    pub steps: NumberTable,
}

impl StudyPoint {
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

    /// The same with rough contact of this friction.
    #[must_use]
    pub fn rough(self, friction: f64) -> Self {
        self.with("contact.strategy", "rough").with("contact.friction", format!("{friction:?}"))
    }

    /// The same with steps and flows that leave 1 % in a viscosity with rough contacts.
    #[must_use]
    pub fn coarsely(self) -> Self {
        self.with("time.step", COARSE_STEP).with("flow.tolerance", COARSE_TOLERANCE)
    }

    /// The case.
    pub fn case(&self, data: &Path) -> anyhow::Result<Case> {
        let parse = |text: &String| text.parse::<Override>().map_err(|_| anyhow!("`{text}` sets no key"));
        let set = self.set.iter().map(parse).collect::<Result<Vec<_>, _>>()?;
        Ok(Case::load_with(data.join(self.file), &set)?)
    }

    /// Runs it in a folder of its own, or takes what is there.
    pub fn run(&self, data: &Path, out: &Path, board: &Board) -> anyhow::Result<Done> {
        let case = self.case(data)?;
        let paths = ResultPaths::new(out.join(&self.name), case.file_stem());
        let line = board.start(&self.name);
        let result = report(&case, &paths, &line);
        line.finish(&result);
        let report = result?;
        let rheology = case.has_rheology().then(|| table(&paths.rheology()));
        Ok(Done {
            point: self.clone(),
            report,
            trajectory: table(&paths.csv())?,
            rheology: rheology.transpose()?,
            steps: table(&paths.solver())?,
            case,
        })
    }
}

/// Runs, goes on, or reads what a complete run of this case left.
fn report(case: &Case, paths: &ResultPaths, line: &dyn gluey::Progress) -> anyhow::Result<RunReport> {
    let checkpoint = paths.checkpoint();
    let options = RunOptions {
        checkpoint: Some(checkpoint.clone()),
        checkpoint_minutes: Some(CHECKPOINT_MINUTES),
        record: Some(RecordOptions { force: false }),
        ..RunOptions::csv(paths.csv())
    };
    let was_stopped = RunRecord::read(&paths.record()).is_ok_and(|record| record.report.is_none());
    let resume = (was_stopped && checkpoint.exists()).then_some(checkpoint);
    match gluey::run(case, &RunOptions { resume, ..options }, line) {
        Err(RunError::Occupied(OccupiedError::Complete { record, .. })) => {
            RunRecord::read(&record)?.report.context("the record of the run has no report")
        }
        other => Ok(other?),
    }
}

fn table(path: &Path) -> anyhow::Result<NumberTable> {
    let text = std::fs::read_to_string(path);
    Ok(NumberTable::parse(&text.with_context(|| format!("{} cannot be read", path.display()))?)?)
}
