//! `cargo xtask fuzz`: the tests of mutated input, with more of it.

use std::io;
use std::path::Path;
use std::process::Command;

/// How much is tried.
#[derive(clap::Args)]
pub struct Options {
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
pub fn run(root: &Path, options: &Options) -> io::Result<()> {
    let Options { cases, checkpoints, tables, seed } = options;
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(["test", "--release", "--workspace", "--test", "fuzz"]);
    command.args(["--", "--nocapture"]).current_dir(root);
    for (name, value) in [("CASES", cases), ("CHECKPOINTS", checkpoints), ("TABLES", tables), ("SEED", seed)]
    {
        command.env(format!("GLUEY_FUZZ_{name}"), value.to_string());
    }
    match command.status()?.success() {
        true => Ok(()),
        false => Err(io::Error::other("a mutated file was not refused as it should be; see above")),
    }
}
