//! The `gluey` command.

mod cli;
mod diagnostic;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

use cli::Cli;

fn main() -> ExitCode {
    diagnostic::install();
    match Cli::parse().command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            terminal::say(&format!("{:?}", miette::Report::new(*failure.diagnostic)));
            ExitCode::from(failure.exit_code)
        }
    }
}
