//! Project tasks: `cargo xtask reproduce-figures`, `cargo xtask verify`, `cargo xtask study`,
//! `cargo xtask bench-stokes`, `cargo xtask bench-suspension`, `cargo xtask keys`, `cargo xtask fuzz`,
//! `cargo xtask python`, `cargo xtask test-mpi`, `cargo xtask mdbook`, `cargo xtask tidy`, `cargo xtask ci`.

mod bench;
mod bench_suspension;
mod book;
mod ci;
mod figures;
mod fuzz;
mod keys;
mod mdbook;
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
use gluey_verify::Outcome;

use reproduce::plan::FigureName;
use reproduce::summary::Summary;
use reproduce::verdict::{self, Kind};

#[derive(Parser)]
#[command(bin_name = "cargo xtask", about = "Project tasks of gluey", max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Compute and draw the figures of Verdon et al. (2010).
    ReproduceFigures(ReproduceArguments),
    /// Compute what has an exact solution, with all formulations, and hold it against limits.
    Verify(VerifyArguments),
    /// Compute a study of suspensions: a table, pictures and a page beside the literature.
    Study(StudyArguments),
    /// Time one solve of the Stokes core and print one line of JSON.
    #[command(disable_help_flag = true)]
    BenchStokes {
        /// Options of the measurement; `--help` tells them.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<OsString>,
    },
    /// Time a step of a sheared suspension and print one line of JSON.
    BenchSuspension(bench_suspension::Options),
    /// Write the reference of case files (docs/case-keys.md) and their JSON schema (data/case.schema.json).
    Keys,
    /// Try mutated case files, checkpoints and tables: none may panic, hang or fill the memory.
    Fuzz(fuzz::Options),
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

#[derive(clap::Args)]
struct ReproduceArguments {
    /// A coarse mesh, large time steps and shorter runs: half the time.
    #[arg(long)]
    quick: bool,
    /// Only these figures, separated by commas.
    #[arg(long, value_delimiter = ',', value_name = "FIGURES")]
    only: Vec<FigureName>,
    /// Output folder.
    #[arg(long, default_value = "target/figures", value_name = "DIR")]
    out: PathBuf,
    /// Runs at a time [default: number of cores].
    #[arg(long, value_name = "N")]
    jobs: Option<std::num::NonZeroUsize>,
}

#[derive(clap::Args)]
struct VerifyArguments {
    /// Fewer positions and coarser meshes: a minute.
    #[arg(long)]
    quick: bool,
    /// Only these cases, separated by commas; `cost` needs `discs` and `spheres`.
    #[arg(long, value_delimiter = ',', value_name = "CASES")]
    only: Vec<String>,
    /// Output folder.
    #[arg(long, default_value = "target/verification", value_name = "DIR")]
    out: PathBuf,
}

#[derive(clap::Args)]
struct StudyArguments {
    /// The study.
    name: study::Name,
    /// Few points and short runs: minutes.
    #[arg(long)]
    quick: bool,
    /// Output folder [default: target/studies/NAME].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Runs at a time [default: number of cores].
    #[arg(long, value_name = "N")]
    jobs: Option<std::num::NonZeroUsize>,
}

fn main() -> ExitCode {
    match Arguments::parse().task {
        Task::ReproduceFigures(arguments) => reproduce_figures(arguments),
        Task::Verify(arguments) => verify(arguments),
        Task::Study(arguments) => study(arguments),
        Task::BenchStokes { options } => outcome(bench::run(&workspace_root(), &options)),
        Task::BenchSuspension(options) => outcome(bench_suspension::run(&options)),
        Task::Keys => outcome(keys::write(&workspace_root())),
        Task::Fuzz(options) => outcome(fuzz::run(&workspace_root(), &options)),
        Task::Python { python } => outcome(python::run(&workspace_root(), python.as_deref())),
        Task::Mdbook { words } => outcome(mdbook::run(&words)),
        Task::TestMpi => outcome(test_mpi::run(&workspace_root())),
        Task::Tidy => tidy(),
        Task::Ci { full } => outcome(ci::run(&workspace_root(), full)),
    }
}

fn tidy() -> ExitCode {
    match tidy::offences(&workspace_root()) {
        Ok(offences) => {
            offences.iter().for_each(|offence| eprintln!("{offence}"));
            if offences.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
        }
        Err(error) => outcome(Err(error)),
    }
}

fn outcome<E: std::error::Error>(result: Result<(), E>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Folder of the workspace.
fn workspace_root() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.parent().expect("xtask lies in the workspace").to_owned()
}

fn verify(arguments: VerifyArguments) -> ExitCode {
    let VerifyArguments { quick, only, out } = arguments;
    let options = verify::Options { quick, only, root: workspace_root(), out };
    match verify::verify(&options) {
        Ok(book) => {
            println!("{}", book.account());
            println!("tables, pictures and index.html are in {}", options.out.display());
            if book.holds() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
        }
        Err(error) => outcome(Err(error)),
    }
}

fn study(arguments: StudyArguments) -> ExitCode {
    let StudyArguments { name, quick, out, jobs: wanted } = arguments;
    let folder = if quick { "target/studies/quick" } else { "target/studies" };
    let out = out.unwrap_or_else(|| Path::new(folder).join(name.as_str()));
    let options = study::Options { name, quick, root: workspace_root(), out, jobs: jobs(wanted) };
    match study::study(&options) {
        Ok(failures) => {
            println!("table.csv, pictures and index.html are in {}", options.out.display());
            failures.iter().for_each(|failure| eprintln!("error: {}: {}", failure.what, failure.error));
            if failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
        }
        Err(error) => outcome(Err(error)),
    }
}

/// Runs at a time: as many as wanted, else one for each core.
fn jobs(wanted: Option<std::num::NonZeroUsize>) -> usize {
    wanted.or(std::thread::available_parallelism().ok()).map_or(1, usize::from)
}

fn reproduce_figures(arguments: ReproduceArguments) -> ExitCode {
    let options = reproduce::Options {
        quick: arguments.quick,
        figures: chosen(arguments.only),
        root: workspace_root(),
        out: arguments.out,
        jobs: jobs(arguments.jobs),
    };
    match reproduce::reproduce(&options) {
        Ok(summary) => {
            print_rows(&summary);
            println!("\nfigures, runs, summary.json and index.html are in {}", options.out.display());
            print_outcome(&summary)
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The figures asked for, each once, in the paper's order; all if none was named.
fn chosen(only: Vec<FigureName>) -> Vec<FigureName> {
    FigureName::ALL.into_iter().filter(|figure| only.is_empty() || only.contains(figure)).collect()
}

fn print_rows(summary: &Summary) {
    for row in &summary.rows {
        let mark = match (row.outcome, row.reason().is_some(), row.kind) {
            (Outcome::NotMeasured, _, _) => "MISSING",
            (Outcome::No, true, _) => "no, known",
            (Outcome::No, false, _) => "NO",
            (Outcome::Yes, _, Kind::Guarantee) => "guaranteed",
            (Outcome::Yes, _, _) => "yes",
        };
        let value = row.value.map_or_else(|| "not measured".to_owned(), |value| format!("{value:.4e}"));
        println!(
            "{mark:10} {:5} {} {}: {} = {value} ({})",
            row.figure, row.statement, row.run, row.measure, row.wanted
        );
    }
}

/// Counts what was found, and lists what did not work.
fn print_outcome(summary: &Summary) -> ExitCode {
    let (reproduced, statements) = verdict::count(&summary.rows, Kind::Paper);
    let (held, comparisons) = verdict::count(&summary.rows, Kind::Exact);
    println!(
        "\nof {statements} statements of the paper {reproduced} are reproduced, {} are not; of {comparisons} comparisons \
         with exact solutions {held} hold, {} do not",
        statements - reproduced,
        comparisons - held
    );
    for (row, reason) in summary.rows.iter().filter_map(|row| Some((row, row.reason()?))) {
        println!("known disagreement: {}: {} {reason}", row.id, row.statement);
    }
    for (row, failure) in summary.rows.iter().filter_map(|row| Some((row, row.failure()?))) {
        eprintln!("error: {} {failure}: {}", row.id, row.statement);
    }
    for failure in &summary.failures {
        eprintln!("error: {}: {}", failure.what, failure.error);
    }
    if summary.succeeded() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
