//! `gluey run`.

use std::path::PathBuf;

use clap::Args;
use gluey::case::Override;
use gluey::{Case, Formulation, ResultPaths, RunOptions, Strategy};
#[cfg(feature = "mpi")]
use gluey_parallel::{Communicator, RankFailure, Ranks};

use super::failure::Failure;
use super::interrupt::Requests;
use super::output::{OutputArguments, by_name};
use super::run_mode::Manner;
use crate::terminal::{print_report, say};

/// Arguments of `gluey run`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  gluey run pair.toml --out out --set time.step=0.01 --checkpoint-minutes 30"
)]
pub struct RunArguments {
    /// The case file.
    case: PathBuf,
    /// Set a key of the case: time.step=0.01, particles.0.radius=0.06, contact.strategy=gluey; repeatable.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
    /// What keeps particles from overlapping, instead of the case's choice: none, velocity-correction,
    /// inelastic, gluey, rough.
    #[arg(long, value_parser = by_name::<Strategy>)]
    strategy: Option<Strategy>,
    /// How rigidity enters the flow, instead of the case's choice: unfitted, paper.
    #[arg(long, value_parser = by_name::<Formulation>)]
    formulation: Option<Formulation>,
    /// Folder for all output.
    #[arg(long, default_value = "out", value_name = "DIR")]
    out: PathBuf,
    /// Replace the results of another run in that folder.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    output: OutputArguments,
    /// Go on from a checkpoint of the same case.
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    #[command(flatten)]
    manner: Manner,
}

/// A case that not all ranks can begin with.
#[cfg(feature = "mpi")]
#[derive(Debug, thiserror::Error)]
#[error("rank {rank} cannot begin, which this one can: {message}; is the case file there on all machines?")]
struct StoppedElsewhere {
    rank: usize,
    message: String,
}

impl RunArguments {
    /// Runs the case that they name, and tells what came out.
    #[cfg(not(feature = "mpi"))]
    pub fn run(&self) -> Result<(), Failure> {
        self.run_alone()
    }

    /// The same on the processes that `mpirun` started.
    #[cfg(feature = "mpi")]
    pub fn run(&self) -> Result<(), Failure> {
        let outcome = gluey_parallel::Processes::run(|ranks| match ranks.size() {
            1 => self.run_alone(),
            _ => self.run_on(ranks),
        });
        outcome.unwrap_or_else(|error| Err(Failure::new(error, None)))
    }

    /// Rank zero speaks for all: what goes wrong before the first flow goes wrong on each of them.
    #[cfg(feature = "mpi")]
    fn run_on(&self, ranks: &Ranks) -> Result<(), Failure> {
        let outcome = self.share(ranks);
        if ranks.rank() == 0 { outcome } else { Ok(()) }
    }

    #[cfg(feature = "mpi")]
    fn share(&self, ranks: &Ranks) -> Result<(), Failure> {
        let case = self.manner.set_threads().and_then(|()| Ok(self.case()?));
        let failure = ranks.first_failure(case.as_ref().err().map(|failure| failure.diagnostic.to_string()));
        let case = case?;
        if let Some(RankFailure { rank, message, .. }) = failure {
            return Err(Failure::new(StoppedElsewhere { rank, message }, None));
        }
        let options = self.options(&case, &Requests::listen_on_ranks());
        if let Some(report) = self.manner.run_on(ranks, &case, &options, &self.case)? {
            self.manner.tell(&report, |report| print_report(report, &options.csv));
        }
        Ok(())
    }

    fn run_alone(&self) -> Result<(), Failure> {
        self.manner.set_threads()?;
        let case = self.case()?;
        let options = self.options(&case, &Requests::listen(&self.case));
        let report = self.manner.run(&case, &options, &self.case)?;
        self.manner.tell(&report, |report| print_report(report, &options.csv));
        Ok(())
    }

    fn case(&self) -> Result<Case, gluey::CaseError> {
        let set = |option, path: &[&str], name: &dyn std::fmt::Display| {
            Override::of_option(option, path, &name.to_string())
        };
        let strategy = self.strategy.map(|name| set("--strategy", &["contact", "strategy"], &name));
        let formulation = self.formulation.map(|name| set("--formulation", &["flow", "formulation"], &name));
        let overrides: Vec<Override> = self.set.iter().cloned().chain(strategy).chain(formulation).collect();
        Case::load_with(&self.case, &overrides)
    }

    fn options(&self, case: &Case, requests: &Requests) -> RunOptions {
        let paths = ResultPaths::new(&self.out, case.file_stem());
        if self.force && self.resume.is_some() {
            say("without effect: --force (--resume goes on with what is there)");
        }
        self.output.options(&paths, self.force, self.resume.clone(), requests)
    }
}
