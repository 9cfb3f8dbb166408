//! `gluey sweep`: a study, one run for every combination of values of some keys.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use clap::Args;
use gluey::progress::duration;
use gluey::sweep::{PointResult, PointState, Study, StudyPoint, SweepError, SweptKey, points, table};
use gluey::{RunError, RunOptions, RunReport, in_full};
use thiserror::Error;

use super::failure::{Failure, INTERRUPTED};
use super::interrupt::Requests;
use super::output::{OutputArguments, at_least_one};
use super::run_mode::Manner;
use crate::terminal::{print_table, say};

/// Arguments of `gluey sweep`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gluey sweep pair.toml --set time.step=0.1,0.05,0.025 --out steps
  gluey sweep pair.toml --set contact.strategy=none,gluey --set flow.mesh.cells_per_radius=3.2,6.4 --jobs 4

Every point has a folder of its own, as `gluey run` leaves it; the table is in DIR/sweep.csv. The same command goes on with a
study that was interrupted, and adds points to it where values are added.")]
pub struct SweepArguments {
    /// The case file.
    case: PathBuf,
    /// A key of the case and the values it takes: time.step=0.1,0.05; repeatable, for all combinations.
    #[arg(long, value_name = "KEY=A,B,...", required = true)]
    set: Vec<SweptKey>,
    /// Folder for the points and the table.
    #[arg(long, default_value = "sweep", value_name = "DIR")]
    out: PathBuf,
    /// Runs at a time, which share the threads.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = at_least_one)]
    jobs: usize,
    /// Replace points of another study in that folder.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    manner: Manner,
}

/// Some points have no results.
#[derive(Debug, Error)]
enum Unfinished {
    #[error("{} of {of} points failed: {}", names.len(), names.join(", "))]
    Failed { names: Vec<String>, of: usize },
    #[error("interrupted; {done} of {of} points are complete")]
    Interrupted { done: usize, of: usize },
}

impl SweepArguments {
    /// Runs the points that are not complete yet, and tells what came out of all.
    pub fn run(&self) -> Result<(), Failure> {
        self.manner.set_threads()?;
        let points = points(&self.case, &self.set, &self.out).map_err(refused)?;
        let study = Study::new(&self.out, self.set.iter().map(|axis| axis.key.clone()).collect());
        let states = study.open(&points, self.force).map_err(refused)?;
        let requests = Requests::listen_in_study();
        let results = self.run_all(&points, &states, &requests);
        let rows = table(&self.set, &results);
        study.write_table(&rows).map_err(|error| refused(error.into()))?;
        self.manner.tell(&results, |_| print_table(&rows));
        outcome(&results)
    }

    /// Runs points, the next whenever a job is free, and gives their results in their own order.
    fn run_all(&self, points: &[StudyPoint], states: &[PointState], requests: &Requests) -> Vec<PointResult> {
        let next = AtomicUsize::new(0);
        let results: Vec<Mutex<Option<PointResult>>> = points.iter().map(|_| Mutex::new(None)).collect();
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(point) = points.get(index) else { break };
                let result = self.run_one(point, &states[index], requests);
                self.tell(index, points.len(), &result);
                if let Ok(mut place) = results[index].lock() {
                    *place = Some(result);
                }
            }
        };
        thread::scope(|scope| {
            for _ in 1..self.jobs.min(points.len()) {
                scope.spawn(work);
            }
            work();
        });
        let taken = results.into_iter().zip(points).map(|(result, point)| {
            // A job that panicked left no result; the panic goes on at the end of the scope.
            result.into_inner().ok().flatten().unwrap_or_else(|| self.result(point, "not run", None))
        });
        taken.collect()
    }

    fn run_one(&self, point: &StudyPoint, state: &PointState, requests: &Requests) -> PointResult {
        let resume = match state {
            PointState::Complete(report) => {
                return PointResult {
                    report: Some((**report).clone()),
                    ..self.result(point, "complete", None)
                };
            }
            PointState::Interrupted(checkpoint) => Some(checkpoint.clone()),
            PointState::Fresh | PointState::OtherCase => None,
        };
        if requests.is_there() {
            return self.result(point, "not run", None);
        }
        let force = *state == PointState::OtherCase;
        let options = RunOptions {
            memory_limit: self.manner.memory_limit(),
            ..self.output.options(&point.paths, force, resume, requests)
        };
        let reporter = match self.jobs {
            1 => self.manner.reporter(&point.name),
            _ => self.manner.log(&point.name),
        };
        let ran = gluey::run(&point.case, &options, &reporter);
        reporter.finish();
        self.of_run(point, ran)
    }

    fn of_run(&self, point: &StudyPoint, ran: Result<RunReport, RunError>) -> PointResult {
        match ran {
            Ok(report) => PointResult { report: Some(report), ..self.result(point, "complete", None) },
            Err(RunError::Interrupted(_)) => self.result(point, "interrupted", None),
            Err(error) => {
                let text = in_full(&error);
                let failure = Failure::of_run(error, &point.paths.case_file());
                say(&format!("{}: {:?}", point.name, miette::Report::new(*failure.diagnostic)));
                self.result(point, "failed", Some(text))
            }
        }
    }

    fn result(&self, point: &StudyPoint, state: &'static str, error: Option<String>) -> PointResult {
        let keys = self.set.iter().map(|axis| axis.key.clone());
        let values = keys.zip(point.values.iter().cloned()).collect();
        PointResult { name: point.name.clone(), values, state, report: None, error }
    }

    /// One line for each point that ended.
    fn tell(&self, index: usize, count: usize, result: &PointResult) {
        if self.manner.is_quiet() {
            return;
        }
        let time = result.report.as_ref().map_or(String::new(), |report| {
            format!(" ({} steps, {})", report.steps, duration(report.wall_s))
        });
        say(&format!("point {} of {count}, {}: {}{time}", index + 1, result.name, result.state));
    }
}

/// Why a study was not begun, and what to do about it.
fn refused(error: SweepError) -> Failure {
    let hint = match &error {
        SweepError::Case(_) => None,
        SweepError::Twice { .. } => Some("give every value once"),
        SweepError::KeyTwice { .. } => Some("give all values of a key in one --set, divided by commas"),
        SweepError::LongName { .. } => Some("sweep fewer keys at a time"),
        SweepError::Record(_) | SweepError::Foreign { .. } | SweepError::OtherKeys { .. } => {
            Some("write elsewhere with --out DIR, or take this folder with --force")
        }
        SweepError::OtherCase { .. } => {
            Some("write elsewhere with --out DIR, or replace such points with --force")
        }
        SweepError::Output(_) => Some("choose a folder that can be written to with --out DIR"),
    };
    match error {
        SweepError::Case(error) => error.into(),
        error => Failure::new(error, hint.map(str::to_owned)),
    }
}

/// The failure of a study whose points are not all complete.
fn outcome(results: &[PointResult]) -> Result<(), Failure> {
    let of = results.len();
    let in_state = |states: &[&str]| -> Vec<String> {
        results
            .iter()
            .filter(|result| states.contains(&result.state))
            .map(|result| result.name.clone())
            .collect()
    };
    let (failed, open) = (in_state(&["failed"]), in_state(&["interrupted", "not run"]));
    if !open.is_empty() {
        let error = Unfinished::Interrupted { done: in_state(&["complete"]).len(), of };
        let failure = Failure::new(error, Some("the same command goes on".to_owned()));
        return Err(Failure { exit_code: INTERRUPTED, ..failure });
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(Failure::new(
            Unfinished::Failed { names: failed, of },
            Some(
                "see above why; the same command tries them again, and leaves the others as they are"
                    .to_owned(),
            ),
        )),
    }
}
