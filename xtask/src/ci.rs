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

/// The steps; what takes longest comes last. The reproduction fails where a row does not hold and is no known
/// disagreement.
const STEPS: [&[&str]; 8] = [
    &["fmt", "--all", "--check"],
    &["clippy", "--workspace", "--all-targets", "--release", "--", "-D", "warnings"],
    // Features one by one: whatever else is compiled turns all of them on.
    &[
        "check",
        "--release",
        "-p",
        "gluey-geom",
        "-p",
        "gluey-motion",
        "-p",
        "gluey-contact",
        "--no-default-features",
    ],
    &["check", "--release", "-p", "gluey-contact", "--no-default-features", "--features", "dim2"],
    &["check", "--release", "-p", "gluey-contact", "--no-default-features", "--features", "dim3"],
    &["check", "--release", "-p", "gluey-contact", "--no-default-features", "--features", "parallel,serde"],
    &["test", "--release", "--workspace"],
    &[
        "run",
        "--release",
        "--package",
        "xtask",
        "--",
        "reproduce-figures",
        "--quick",
        "--out",
        "target/figures-quick",
    ],
];

/// Formatting, lints, features, the tests, of which tidy is one, and a quick reproduction; stops at the first
/// failure.
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
