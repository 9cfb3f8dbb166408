//! The `gluey` command.

mod cli;
mod diagnostic;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

use cli::{AnalyseArguments, Cli, Command, PlotArguments, RunArguments, ViewArguments};

fn main() -> ExitCode {
    diagnostic::install();
    match Cli::parse().command {
        Command::Run(arguments) => run(&arguments),
        Command::Analyse(arguments) => analyse(&arguments),
        Command::View(arguments) => view(&arguments),
        Command::Plot(arguments) => plot(&arguments),
    }
}

fn run(arguments: &RunArguments) -> ExitCode {
    match cli::run(arguments) {
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

fn analyse(arguments: &AnalyseArguments) -> ExitCode {
    match gluey::analyse::analyse(&arguments.options()) {
        Ok(summary) => {
            terminal::print_summary(&summary);
            ExitCode::SUCCESS
        }
        Err(error) => {
            terminal::say(&format!("{:?}", miette::Report::from_err(error)));
            ExitCode::FAILURE
        }
    }
}

fn view(arguments: &ViewArguments) -> ExitCode {
    match gluey::view::view(&arguments.options()) {
        Ok(viewed) => {
            terminal::print_viewed(&viewed);
            ExitCode::SUCCESS
        }
        Err(error) => {
            terminal::say(&format!("{:?}", miette::Report::from_err(error)));
            ExitCode::FAILURE
        }
    }
}

fn plot(arguments: &PlotArguments) -> ExitCode {
    match gluey::plot::plot(&arguments.options()) {
        Ok(pictures) => {
            terminal::print_pictures(&pictures);
            ExitCode::SUCCESS
        }
        Err(error) => {
            terminal::say(&format!("{:?}", miette::Report::from_err(error)));
            ExitCode::FAILURE
        }
    }
}
