//! `cargo xtask ci`: all that must hold before a change is shared.

use std::path::Path;
use std::process::Command;

use crate::program::{self, Missing};
use crate::{python, test_mpi};

/// What cargo does before the Python package.
const STEPS: &[&str] = &[
    "fmt --all --check",
    "clippy --workspace --all-targets --release -- -D warnings",
    "doc --workspace --no-deps --document-private-items --release",
    // Features one by one: whatever else is compiled turns all of them on.
    "check --release -p gluey-geom -p gluey-motion -p gluey-contact -p gluey-stokes --no-default-features",
    "check --release -p gluey-contact --no-default-features --features dim2",
    "check --release -p gluey-contact --no-default-features --features dim3",
    "check --release -p gluey-contact --no-default-features --features parallel,serde",
    // Two crates that are never published need one without a version.
    "package --workspace --exclude gluey-verify --exclude xtask --no-verify --allow-dirty",
    "test --release --workspace",
    // What the feature of MPI builds on, with threads as ranks.
    "test --release --workspace --features gluey/ranks --test ranks",
];

/// The last steps, which take longest. The verification fails where a number is beyond its limit, the
/// reproduction where a row does not hold and is no known disagreement, or one no longer.
const LATER_STEPS: &[&str] = &[
    "run --release --package xtask -- verify --quick --out target/verification-quick",
    "run --release --package xtask -- reproduce-figures --quick --out target/figures-quick",
];

/// Those before a release, with the numbers and rows that the quick form leaves out.
const FULL_STEPS: &[&str] =
    &["run --release --package xtask -- verify", "run --release --package xtask -- reproduce-figures"];

/// What the documentation is built with.
const RUSTDOCFLAGS: &str = "-D warnings -A rustdoc::private_intra_doc_links";

/// The spelling checker, if it is there, and how to get it.
const SPELLING: (&str, &str) = ("typos", "cargo install --locked typos-cli");

/// Spelling, formatting, lints, documentation, features, packages, the tests, of which tidy is one, those of
/// the Python package and those of ranks under MPI, a quick or `full` verification and reproduction; stops at
/// the first failure.
pub fn run(root: &Path, full: bool) -> anyhow::Result<()> {
    program::where_possible(check_spelling(root), "spelling is not checked")?;
    STEPS.iter().try_for_each(|step| cargo(root, step))?;
    program::where_possible(python::run(root, None), "the Python package is not tested")?;
    program::where_possible(test_mpi::run(root), "nothing is tested under MPI")?;
    let last = if full { FULL_STEPS } else { LATER_STEPS };
    last.iter().try_for_each(|step| cargo(root, step))
}

fn cargo(root: &Path, words: &str) -> anyhow::Result<()> {
    eprintln!("cargo {words}");
    let mut cargo = program::cargo(words);
    if words.starts_with("doc ") {
        cargo.env("RUSTDOCFLAGS", RUSTDOCFLAGS);
    }
    program::run(cargo.current_dir(root), &format!("`cargo {words}` failed"))
}

fn check_spelling(root: &Path) -> anyhow::Result<()> {
    let (program, installation) = SPELLING;
    let mut checker = Command::new(program);
    if checker.arg("--version").output().is_err() {
        return Err(Missing(format!("{program} is not installed ({installation})")).into());
    }
    program::run(Command::new(program).current_dir(root), &format!("`{program}` failed"))
}
