//! The log of a run, `<stem>.log` beside its results: when it began and went on, where it was every so often,
//! what it came upon, and how it ended. Lines for people, each with its time in UTC.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::error::RunError;
use super::options::RunOptions;
use super::record::{in_full, now};
use crate::case::Case;
use crate::memory;
use crate::output::solver_log::SolverRow;
use crate::output::{FileError, ResultPaths};
use crate::progress::{Notice, Progress, ProgressState, Ticker};
use crate::report::RunReport;

/// Time between two lines about where a run is.
const INTERVAL: Duration = Duration::from_secs(10);

/// Hands on what a run tells, and writes it down.
pub(super) struct Log<'a> {
    listener: &'a dyn Progress,
    file: Option<Arc<File>>,
    /// Writes where the run is.
    ticker: Option<Ticker>,
}

/// Adds a line. That one is lost, as on a full disk, is no reason to end a run: its rows are.
fn add(mut file: &File, line: &str) {
    // At once, so that lines of several threads do not mix.
    let _ = file.write_all(format!("{} {line}\n", now()).as_bytes());
}

impl<'a> Log<'a> {
    /// Begins the log of a run that leaves a record, or goes on with that of the run that is resumed.
    pub fn begin(case: &Case, options: &RunOptions, listener: &'a dyn Progress) -> Result<Self, FileError> {
        if options.record.is_none() {
            return Ok(Self { listener, file: None, ticker: None });
        }
        let path = ResultPaths::of_csv(&options.csv).log();
        let mut open = OpenOptions::new();
        let opened = match &options.resume {
            Some(_) => open.create(true).append(true).open(&path),
            None => open.create(true).write(true).truncate(true).open(&path),
        };
        let file = opened.map_err(|error| FileError::new(&path, "begin the log", error))?;
        add(&file, &beginning(case, options.resume.as_deref()));
        let file = Arc::new(file);
        let of_ticker = file.clone();
        let ticker = Ticker::new(INTERVAL, move |state| {
            add(&of_ticker, &format!("step {}/{}, {state}", state.step, state.steps));
        });
        Ok(Self { listener, file: Some(file), ticker: Some(ticker) })
    }

    /// Writes what came out, and how the run ended.
    pub fn end(&self, outcome: &Result<Option<RunReport>, RunError>) {
        if let Ok(Some(report)) = outcome {
            // What the first line says is told at the end.
            report.to_string().lines().skip(1).for_each(|line| self.add(line.trim_start()));
            self.add(&ending(report));
        }
        if let Err(error) = outcome {
            self.add(&in_full(error));
        }
    }

    fn add(&self, line: &str) {
        if let Some(file) = &self.file {
            add(file, line);
        }
    }
}

impl Progress for Log<'_> {
    fn report(&self, state: &ProgressState) {
        self.listener.report(state);
        if let Some(ticker) = &self.ticker {
            ticker.report(state);
        }
    }

    fn step(&self, row: &SolverRow<'_>) {
        self.listener.step(row);
    }

    fn notice(&self, notice: &Notice) {
        self.listener.notice(notice);
        self.add(&notice.to_string());
    }
}

/// Adds a line to the log of a run, where there is one.
pub(super) fn note(paths: &ResultPaths, line: &str) {
    if let Ok(file) = OpenOptions::new().append(true).open(paths.log()) {
        add(&file, line);
    }
}

/// What came out of a run, and what it took.
fn ending(report: &RunReport) -> String {
    let total: f64 = report.phases.iter().map(|(_, seconds)| seconds).sum();
    let share = |seconds: f64| 100.0 * seconds / total.max(f64::MIN_POSITIVE);
    let phases = report.phases.iter().map(|(name, seconds)| format!("{name} {:.1} %", share(*seconds)));
    let memory = memory::peak().map_or(String::new(), |bytes| format!("{}; ", memory::size(bytes as f64)));
    let (steps, wall_s) = (report.steps, report.wall_s);
    format!(
        "complete after {steps} steps in {wall_s:.2} s; {memory}{}",
        phases.collect::<Vec<_>>().join(", ")
    )
}

fn beginning(case: &Case, resumed: Option<&Path>) -> String {
    let (version, threads) = (env!("CARGO_PKG_VERSION"), rayon::current_num_threads());
    let (name, steps) = (&case.name, case.step_count());
    let from = resumed.map_or_else(String::new, |path| format!(", goes on from {}", path.display()));
    format!("gluey {version}: {name}, {steps} steps, {threads} threads{from}")
}
