//! `cargo xtask ci`: all that must hold before a change is shared.

use std::path::Path;
use std::process::Command;

/// A step that did not pass.
#[derive(Debug, thiserror::Error)]
pub enum CiError {
    /// cargo could not be started.
    #[error("cannot start cargo: {0}")]
    Start(#[from] std::io::Error),
    /// cargo said no.
    #[error("`cargo {0}` failed")]
    Step(String),
}

/// The steps; tests come last because they take longest.
const STEPS: [&[&str]; 3] = [
    &["fmt", "--all", "--check"],
    &["clippy", "--workspace", "--all-targets", "--release", "--", "-D", "warnings"],
    &["test", "--release", "--workspace"],
];

/// Formatting, lints, then the tests, of which tidy is one; stops at the first failure.
pub fn run(root: &Path) -> Result<(), CiError> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    for step in STEPS {
        eprintln!("cargo {}", step.join(" "));
        if !Command::new(&cargo).args(step).current_dir(root).status()?.success() {
            return Err(CiError::Step(step.join(" ")));
        }
    }
    Ok(())
}
