//! The `gluey` command.

mod cli;
mod diagnostic;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

use cli::{Cli, Command};

fn main() -> ExitCode {
    diagnostic::install();
    let Command::Run(arguments) = Cli::parse().command;
    match cli::run(&arguments) {
        Ok(report) => {
            terminal::print_report(&report);
            ExitCode::SUCCESS
        }
        Err(failure) => {
            terminal::say(&format!("{:?}", miette::Report::new(*failure.diagnostic)));
            ExitCode::from(failure.exit_code)
        }
    }
}
