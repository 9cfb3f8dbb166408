//! Project tasks: `cargo xtask reproduce-figures`, `cargo xtask verify`, `cargo xtask study`,
//! `cargo xtask bench-stokes`, `cargo xtask bench-suspension`, `cargo xtask keys`, `cargo xtask fuzz`,
//! `cargo xtask python`, `cargo xtask test-mpi`, `cargo xtask mdbook`, `cargo xtask tidy`, `cargo xtask ci`.

mod bench_suspension;
mod book;
mod ci;
mod fuzz;
mod keys;
mod mdbook;
mod program;
mod python;
mod reproduce;
mod study;
mod test_mpi;
mod tidy;
mod verify;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(bin_name = "cargo xtask", about = "Project tasks of gluey", max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Compute and draw the figures of Verdon et al. (2010).
    ReproduceFigures(reproduce::ReproductionOptions),
    /// Compute what has an exact solution, with all formulations, and hold it against limits.
    Verify(verify::VerificationOptions),
    /// Compute a study of suspensions: a table, pictures and a page beside the literature.
    Study(study::StudyOptions),
    /// Time one solve of the Stokes core and print one line of JSON.
    #[command(disable_help_flag = true)]
    BenchStokes {
        /// Options of the measurement; `--help` tells them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Time a step of a sheared suspension and print one line of JSON.
    BenchSuspension(bench_suspension::SuspensionBenchOptions),
    /// Write the reference of case files (docs/case-keys.md) and their JSON schema (data/case.schema.json).
    Keys,
    /// Try mutated case files, checkpoints and tables: none may panic, hang or fill the memory.
    Fuzz(fuzz::FuzzOptions),
    /// Install the Python package in a fresh environment and run its tests.
    Python {
        /// The interpreter, instead of the first python3 or python.
        #[arg(long, value_name = "PROGRAM")]
        python: Option<PathBuf>,
    },
    /// Prepare the pages of the book for mdBook, which calls this (docs/book.toml).
    #[command(hide = true)]
    Mdbook {
        /// What mdBook asks.
        words: Vec<OsString>,
    },
    /// Build with MPI and compare flows on 1 to 8 processes with those of threads, bit for bit.
    TestMpi,
    /// Check the code against ARCHITECTURE.md and the house rules.
    Tidy,
    /// Formatting, lints, all tests, those of the Python package and a quick reproduction of the figures.
    Ci {
        /// Before a release: the whole verification and reproduction in place of the quick ones.
        #[arg(long)]
        full: bool,
    },
}

/// Runs a task; whether what it checks holds.
fn run(task: Task) -> anyhow::Result<bool> {
    match task {
        Task::ReproduceFigures(options) => return reproduce::run(options),
        Task::Verify(options) => return verify::run(&options),
        Task::Study(options) => return study::run(&options),
        Task::Tidy => return tidy::run(&workspace_root()),
        Task::BenchStokes { options } => bench_stokes(&options),
        Task::BenchSuspension(options) => bench_suspension::run(&options),
        Task::Keys => keys::write(&workspace_root()),
        Task::Fuzz(options) => fuzz::run(&options),
        Task::Python { python } => python::run(&workspace_root(), python.as_deref()),
        Task::Mdbook { words } => mdbook::run(&words),
        Task::TestMpi => test_mpi::run(&workspace_root()),
        Task::Ci { full } => ci::run(&workspace_root(), full),
    }
    .map(|()| true)
}

fn main() -> ExitCode {
    match run(Arguments::parse().task) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {}", book::chain(&*error));
            ExitCode::FAILURE
        }
    }
}

/// Folder of the workspace.
fn workspace_root() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.parent().expect("xtask lies in the workspace").to_owned()
}

/// Builds the package that measures and hands it the options.
fn bench_stokes(options: &[OsString]) -> anyhow::Result<()> {
    let mut cargo = program::cargo("run --release --quiet --package gluey-bench --manifest-path");
    cargo.arg(workspace_root().join("Cargo.toml")).arg("--").args(options);
    program::run(&mut cargo, "bench-stokes failed")
}
