//! Programs that tasks start.

use std::process::{Command, Output};

use anyhow::{Context, ensure};

/// Something is not there that is no part of the repository.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Missing(pub String);

/// What came of a check; where something is missing for it, only says so, after `instead`.
pub fn where_possible(check: anyhow::Result<()>, instead: &str) -> anyhow::Result<()> {
    if let Err(error) = check {
        eprintln!("{instead}: {}", error.downcast::<Missing>()?);
    }
    Ok(())
}

/// Cargo with these words, which blanks separate.
pub fn cargo(words: &str) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(words.split(' '));
    command
}

/// Runs a program to its end; an error that says `failed` if it does not succeed.
pub fn run(command: &mut Command, failed: &str) -> anyhow::Result<()> {
    let status = command.status().with_context(|| cannot_start(command))?;
    ensure!(status.success(), "{failed}");
    Ok(())
}

/// Runs a program to its end and keeps what it says.
pub fn output(command: &mut Command) -> anyhow::Result<Output> {
    command.output().with_context(|| cannot_start(command))
}

/// What is said of a program that is not there.
pub fn cannot_start(command: &Command) -> String {
    format!("cannot start {}", command.get_program().display())
}

/// What a program said to standard error.
pub fn complaint(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
