//! `cargo xtask bench-stokes`: builds the package that measures and hands it the options.

use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// cargo could not be started.
    #[error("cannot start cargo: {0}")]
    Start(#[from] std::io::Error),
    /// The measurement, or its build, said why.
    #[error("bench-stokes failed")]
    Failed,
}

/// Runs `bench-stokes` with these options.
pub fn run(root: &Path, options: &[OsString]) -> Result<(), BenchError> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let build = ["run", "--release", "--quiet", "--package", "gluey-bench", "--manifest-path"];
    let manifest = root.join("Cargo.toml");
    let status = Command::new(cargo).args(build).arg(manifest).arg("--").args(options).status()?;
    if status.success() { Ok(()) } else { Err(BenchError::Failed) }
}
