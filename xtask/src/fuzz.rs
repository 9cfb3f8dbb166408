//! `cargo xtask fuzz`: the tests of mutated input, with more of it.

use crate::{program, workspace_root};

/// Numbers of files that are tried.
#[derive(clap::Args)]
pub struct FuzzOptions {
    /// Mutated case files.
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    cases: u64,
    /// Mutated checkpoints.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    checkpoints: u64,
    /// Mutated lists of particles and tables of results.
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    tables: u64,
    /// Seed of the mutations.
    #[arg(long, value_name = "SEED", default_value_t = 2010)]
    seed: u64,
}

/// Runs the tests; their summaries go to standard output.
pub fn run(options: &FuzzOptions) -> anyhow::Result<()> {
    let FuzzOptions { cases, checkpoints, tables, seed } = options;
    let mut cargo = program::cargo("test --release --workspace --test fuzz -- --nocapture");
    cargo.current_dir(workspace_root());
    for (name, value) in [("CASES", cases), ("CHECKPOINTS", checkpoints), ("TABLES", tables), ("SEED", seed)]
    {
        cargo.env(format!("GLUEY_FUZZ_{name}"), value.to_string());
    }
    program::run(&mut cargo, "a mutated file was not refused as it should be; see above")
}
