//! `cargo xtask bench-stokes`: one timed solve of the Stokes core in a unit box, told in one line of JSON.
//!
//! A package of its own, since whoever reproduces the figures need not wait until a second copy of the solver
//! is compiled.

mod cases;
mod machine;
mod measure;
mod options;
mod report;

use std::process::ExitCode;

use clap::Parser;

/// Time one solve of the Stokes core and print one line of JSON.
#[derive(Parser)]
#[command(bin_name = "cargo xtask bench-stokes", max_term_width = 100)]
struct Arguments {
    #[command(flatten)]
    options: options::StokesBenchOptions,
}

fn main() -> ExitCode {
    let report = measure::run(&Arguments::parse().options);
    match report.and_then(|report| Ok(serde_json::to_string(&report)?)) {
        Ok(line) => {
            println!("{line}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
