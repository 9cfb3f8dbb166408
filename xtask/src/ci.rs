//! `cargo xtask ci`: all that must hold before a change is shared.

use std::path::Path;
use std::process::Command;

use crate::python::{self, PythonError};
use crate::test_mpi::{self, MpiError};

/// A step that did not pass.
#[derive(Debug, thiserror::Error)]
pub enum CiError {
    /// A program could not be started.
    #[error("cannot start {program}: {source}")]
    Start {
        /// The program.
        program: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// It said no.
    #[error("`{0}` failed")]
    Step(String),
    /// The Python package does not pass.
    #[error(transparent)]
    Python(PythonError),
    /// What ranks share does not pass under MPI.
    #[error(transparent)]
    Mpi(MpiError),
}

/// A command of cargo, or of another program that may be missing.
struct Step {
    /// Words after `cargo`, separated by blanks.
    arguments: &'static str,
    /// An environment variable it needs.
    variable: Option<(&'static str, &'static str)>,
}

/// The steps before the Python package.
const STEPS: &[Step] = &[
    Step::new("fmt --all --check"),
    Step::new("clippy --workspace --all-targets --release -- -D warnings"),
    Step::new("doc --workspace --no-deps --document-private-items --release")
        .with("RUSTDOCFLAGS", "-D warnings -A rustdoc::private_intra_doc_links"),
    // Features one by one: whatever else is compiled turns all of them on.
    Step::new("check --release -p gluey-geom -p gluey-motion -p gluey-contact --no-default-features"),
    Step::new("check --release -p gluey-contact --no-default-features --features dim2"),
    Step::new("check --release -p gluey-contact --no-default-features --features dim3"),
    Step::new("check --release -p gluey-contact --no-default-features --features parallel,serde"),
    // Two crates that are never published need one without a version.
    Step::new("package --workspace --exclude gluey-verify --exclude xtask --no-verify --allow-dirty"),
    Step::new("test --release --workspace"),
    // What the feature of MPI builds on, with threads as ranks.
    Step::new("test --release --workspace --features gluey/ranks --test ranks"),
];

/// The last steps, which take longest. The verification fails where a number is beyond its limit, the
/// reproduction where a row does not hold and is no known disagreement, or one no longer.
const LATER_STEPS: &[Step] = &[
    Step::new("run --release --package xtask -- verify --quick --out target/verification-quick"),
    Step::new("run --release --package xtask -- reproduce-figures --quick --out target/figures-quick"),
];

/// Those before a release, with the numbers and rows that the quick form leaves out.
const FULL_STEPS: &[Step] = &[
    Step::new("run --release --package xtask -- verify"),
    Step::new("run --release --package xtask -- reproduce-figures"),
];

/// The spelling checker, if it is there, and how to get it.
const SPELLING: (&str, &str) = ("typos", "cargo install --locked typos-cli");

impl Step {
    const fn new(arguments: &'static str) -> Self {
        Self { arguments, variable: None }
    }

    const fn with(self, name: &'static str, value: &'static str) -> Self {
        Self { variable: Some((name, value)), ..self }
    }

    fn run(&self, root: &Path) -> Result<(), CiError> {
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
        eprintln!("cargo {}", self.arguments);
        let mut command = Command::new(&cargo);
        command.args(self.arguments.split(' ')).envs(self.variable).current_dir(root);
        let status = command.status().map_err(|source| CiError::Start { program: cargo, source })?;
        if status.success() { Ok(()) } else { Err(CiError::Step(format!("cargo {}", self.arguments))) }
    }
}

/// Spelling, formatting, lints, documentation, features, packages, the tests, of which tidy is one, those of
/// the Python package and those of ranks under MPI, a quick or `full` verification and reproduction; stops at
/// the first failure.
pub fn run(root: &Path, full: bool) -> Result<(), CiError> {
    check_spelling(root)?;
    STEPS.iter().try_for_each(|step| step.run(root))?;
    check_python(root)?;
    check_mpi(root)?;
    let last = if full { FULL_STEPS } else { LATER_STEPS };
    last.iter().try_for_each(|step| step.run(root))
}

/// The Python package, where there are Python and a package index; says so where there are not.
fn check_python(root: &Path) -> Result<(), CiError> {
    match python::run(root, None) {
        Err(PythonError::Missing(what)) => {
            eprintln!("the Python package is not tested: {what}");
            Ok(())
        }
        other => other.map_err(CiError::Python),
    }
}

/// Flows and cases on several processes, where MPI is there; says so where it is not.
fn check_mpi(root: &Path) -> Result<(), CiError> {
    match test_mpi::run(root) {
        Err(missing @ MpiError::Missing(_)) => {
            eprintln!("nothing is tested under MPI: {missing}");
            Ok(())
        }
        other => other.map_err(CiError::Mpi),
    }
}

/// Spelling, where the program for it is installed; says so where it is not.
fn check_spelling(root: &Path) -> Result<(), CiError> {
    let (program, installation) = SPELLING;
    match Command::new(program).current_dir(root).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(CiError::Step(program.to_owned())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            eprintln!("spelling is not checked: {program} is not installed ({installation})");
            Ok(())
        }
        Err(source) => Err(CiError::Start { program: program.to_owned(), source }),
    }
}
