//! `gluey check`: what a run would be, found out by meshing once and by a few trial steps.

use std::io;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Instant;

use clap::Args;
use gluey::case::Override;
use gluey::flow::MeshSize;
use gluey::memory::size;
use gluey::output::solver_log::SolverRow;
use gluey::progress::duration;
use gluey::{Case, CaseSummary, Notice, Progress, ProgressState, RunError, RunOptions, memory};
use serde::Serialize;
use thiserror::Error;

use super::failure::Failure;
use super::run_mode::Manner;
use crate::terminal::{Reporter, print_lines};

/// Steps of a trial.
const TRIAL_STEPS: usize = 4;
/// What runs take at most over what their first steps take: what is freed between later steps is not filled
/// again without gaps (measured: see `docs/robustness.md`).
const GROWTH: f64 = 1.15;

/// Arguments of `gluey check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  gluey check pair.toml\n  gluey check suspension.toml --set suspension.count=200 \
                        --no-trial --json"
)]
pub struct CheckArguments {
    /// The case file.
    case: PathBuf,
    /// Set a key of the case, as for `gluey run`; repeatable.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// Make no trial steps: memory is estimated from the mesh, times are not told.
    #[arg(long)]
    no_trial: bool,
    #[command(flatten)]
    manner: Manner,
}

/// No trial could be made.
#[derive(Debug, Error)]
enum TrialError {
    /// There is no place for what its steps write.
    #[error("no folder for trial steps could be made")]
    Folder(#[source] io::Error),
}

/// The size and the cost of a run.
#[derive(Debug, Serialize)]
struct Check {
    #[serde(flatten)]
    case: CaseSummary,
    /// The first mesh; absent where the flow has none.
    mesh: Option<Mesh>,
    /// Memory the process would take; unit: bytes. By what the trial took, where that is known.
    memory_bytes: Option<f64>,
    memory_is_measured: bool,
    /// Memory there is; unit: bytes.
    memory_available_bytes: Option<u64>,
    trial: Option<TrialTimes>,
}

/// The first mesh.
#[derive(Debug, Serialize)]
struct Mesh {
    cells: usize,
    unknowns: usize,
}

/// Times that trial steps took.
#[derive(Debug, Serialize)]
struct TrialTimes {
    /// Steps that were made.
    steps: usize,
    /// The first flow, which starts from nothing; unit: seconds.
    first_s: f64,
    /// One step after it; unit: seconds.
    step_s: f64,
    /// All steps of the run at that pace; unit: seconds.
    run_s: f64,
}

impl CheckArguments {
    /// Says what the run would be.
    pub fn run(&self) -> Result<(), Failure> {
        self.manner.set_threads()?;
        let case = Case::load_with(&self.case, &self.set)?;
        let refused = |error: RunError| Failure::of_run(error, &self.case);
        memory::check_within(&case, self.manner.memory_limit()).map_err(|error| refused(error.into()))?;
        let reporter = self.manner.reporter(&case.name);
        Notice::of_idle_keys(&case).iter().for_each(|notice| reporter.notice(notice));
        reporter.finish();
        let size = MeshSize::of(&case).map_err(|error| refused(RunError::Flow(error.into())))?;
        let available = memory::available();
        let trial = (!self.no_trial).then(|| self.trial(&case)).transpose()?;
        let measured = trial.as_ref().and_then(|_| memory::peak()).map(|bytes| GROWTH * bytes as f64);
        let check = Check {
            case: CaseSummary::of(&case),
            mesh: size.map(|size| Mesh { cells: size.cell_count, unknowns: size.dof_count }),
            memory_bytes: measured.or(size.map(|size| size.bytes)),
            memory_is_measured: measured.is_some(),
            memory_available_bytes: available,
            trial,
        };
        self.manner.tell(&check, |check| print_lines(&check.lines()));
        Ok(())
    }

    /// Makes the first steps of the run, whose results go away again.
    fn trial(&self, case: &Case) -> Result<TrialTimes, Failure> {
        let folder =
            tempfile::TempDir::new().map_err(|error| Failure::new(TrialError::Folder(error), None))?;
        let steps = case.step_count().min(TRIAL_STEPS);
        let mut short = case.clone();
        short.time.end = case.time.step * steps as f64;
        (short.time.reverse_at, short.time.strain_amplitude, short.reference) = (None, None, None);
        let reporter = self.manner.reporter("trial steps");
        let clock = Clock { reporter, times: Mutex::default() };
        let options = RunOptions::csv(folder.path().join("trial.csv"));
        let outcome = gluey::run(&short, &options, &clock);
        clock.reporter.finish();
        outcome.map_err(|error| Failure::of_run(error, &self.case))?;
        let times = clock.times.into_inner().unwrap_or_default();
        Ok(times.trial(steps, case.step_count()))
    }
}

/// Takes the time at the beginning of every flow, and whenever the run reports.
struct Clock {
    reporter: Reporter,
    times: Mutex<FlowTimes>,
}

/// The times at which the flows of a run began, and that of its last report.
#[derive(Debug, Default)]
struct FlowTimes {
    flows: Vec<Instant>,
    last: Option<Instant>,
}

impl FlowTimes {
    /// A trial of so many steps of a run of `all` steps. Flows are computed at the beginning of every step
    /// and at the end of the last.
    fn trial(&self, steps: usize, all: usize) -> TrialTimes {
        let ends = self.flows.iter().skip(1).chain(&self.last);
        let seconds: Vec<f64> =
            self.flows.iter().zip(ends).map(|(start, end)| (*end - *start).as_secs_f64()).collect();
        let (first_s, later) = seconds.split_first().map_or((0.0, &[][..]), |(first, later)| (*first, later));
        let step_s = later.iter().sum::<f64>() / later.len().max(1) as f64;
        TrialTimes { steps, first_s, step_s, run_s: first_s + step_s * all as f64 }
    }
}

impl Progress for Clock {
    fn report(&self, state: &ProgressState) {
        if let Ok(mut times) = self.times.lock() {
            let now = Instant::now();
            if state.phase == "flow" {
                times.flows.push(now);
            }
            times.last = Some(now);
        }
        self.reporter.report(state);
    }

    fn step(&self, row: &SolverRow<'_>) {
        self.reporter.step(row);
    }

    fn notice(&self, notice: &Notice) {
        // That of the whole case is told; the trial is of a part of it.
        if !matches!(notice, Notice::NoEffect { .. }) {
            self.reporter.notice(notice);
        }
    }
}

impl Check {
    fn lines(&self) -> Vec<(&'static str, String)> {
        let mut lines = self.case.lines();
        if let Some(Mesh { cells, unknowns }) = self.mesh {
            lines.push(("first mesh", format!("{cells} cells, {unknowns} unknowns")));
        }
        if let Some(bytes) = self.memory_bytes {
            let how = if self.memory_is_measured { "by trial steps" } else { "estimated" };
            let there = self
                .memory_available_bytes
                .map_or(String::new(), |there| format!(", {} there", size(there as f64)));
            lines.push(("memory", format!("{} ({how}{there})", size(bytes))));
        }
        if let Some(TrialTimes { first_s, step_s, run_s, .. }) = self.trial {
            lines.push((
                "time",
                format!("about {} ({first_s:.3} s to begin, {step_s:.3} s a step)", duration(run_s)),
            ));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_run_goes_on_at_the_pace_of_its_trial() {
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs(seconds);
        let times = FlowTimes { flows: vec![start, after(5), after(7)], last: Some(after(11)) };
        let trial = times.trial(2, 100);
        assert_eq!((trial.first_s, trial.step_s, trial.run_s), (5.0, 3.0, 305.0));
    }
}
