//! With how many threads a run is done, and what it tells of itself.

use std::path::Path;

use clap::Args;
use gluey::{Case, Progress, RunOptions, RunReport};
#[cfg(feature = "mpi")]
use gluey_parallel::{Communicator, Ranks};
use rayon::ThreadPoolBuilder;
use serde::Serialize;

use super::failure::Failure;
use crate::terminal::{Reporter, print_json};

/// The most threads that can be asked for.
const MOST_THREADS: i64 = 4096;

/// Arguments about the threads of a run, and about what it tells of itself.
#[derive(Clone, Debug, Args)]
pub struct Manner {
    /// Threads, instead of one per processor; results do not depend on them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_THREADS))]
    threads: Option<u32>,
    /// Refuse a case whose first mesh is expected to take more than so many gigabytes.
    #[arg(long, value_name = "GB", value_parser = gigabytes)]
    memory_limit: Option<u64>,
    /// Print no progress and no report, only warnings and errors.
    #[arg(long)]
    quiet: bool,
    /// Print a line for each step: unknowns, iterations, residual, contacts, seconds.
    #[arg(long, short, conflicts_with = "quiet")]
    verbose: bool,
    /// Print the report as JSON; nothing else goes to standard output.
    #[arg(long)]
    json: bool,
}

impl Manner {
    /// Runs `case`, which was read from `file`.
    pub fn run(&self, case: &Case, options: &RunOptions, file: &Path) -> Result<RunReport, Failure> {
        let reporter = self.reporter(&case.name);
        let options = RunOptions { memory_limit: self.memory_limit, ..options.clone() };
        let outcome = gluey::run(case, &options, &reporter as &dyn Progress);
        reporter.finish();
        outcome.map_err(|error| Failure::of_run(error, file))
    }

    /// The same with a flow that `ranks` share; a report comes on rank zero.
    #[cfg(feature = "mpi")]
    pub fn run_on(
        &self,
        ranks: &Ranks,
        case: &Case,
        options: &RunOptions,
        file: &Path,
    ) -> Result<Option<RunReport>, Failure> {
        let reporter = Reporter::new(&case.name, self.quiet || ranks.rank() > 0).verbose(self.verbose);
        let options = RunOptions { memory_limit: self.memory_limit, ..options.clone() };
        let outcome = gluey::run_shared(case, &options, &reporter as &dyn Progress, ranks);
        reporter.finish();
        outcome.map_err(|error| Failure::of_run(error, file))
    }

    /// What shows where a run of this name is.
    pub fn reporter(&self, name: &str) -> Reporter {
        Reporter::new(name, self.quiet).verbose(self.verbose)
    }

    /// The same in lines, whatever there is to draw on.
    pub fn log(&self, name: &str) -> Reporter {
        Reporter::log(name, self.quiet).verbose(self.verbose)
    }

    /// Says what came out: to programs as JSON, to people by `print`.
    pub fn tell<T: Serialize>(&self, outcome: &T, print: impl FnOnce(&T)) {
        match (self.json, self.quiet) {
            (true, _) => print_json(outcome),
            (false, false) => print(outcome),
            (false, true) => {}
        }
    }

    /// The most bytes that a case may be expected to take.
    pub fn memory_limit(&self) -> Option<u64> {
        self.memory_limit
    }

    /// Whether only warnings and errors are told.
    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Takes as many threads as were asked for; before any work, for threads are made once. Reading a case is
    /// work where its particles are generated.
    pub fn set_threads(&self) -> Result<(), Failure> {
        let Some(threads) = self.threads else { return Ok(()) };
        let pool = ThreadPoolBuilder::new().num_threads(threads as usize).build_global();
        pool.map_err(|error| Failure::new(error, Some("take fewer --threads".to_owned())))
    }
}

/// Bytes of so many gigabytes.
fn gigabytes(text: &str) -> Result<u64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok((number * 1e9) as u64),
        _ => Err("must be a number of gigabytes, greater than 0".into()),
    }
}
