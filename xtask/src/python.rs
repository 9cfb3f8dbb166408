//! `cargo xtask python`: installs the Python package in a fresh environment as a newcomer would, and runs its
//! tests.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The oldest Python that the package is for.
const OLDEST: (u32, u32) = (3, 9);
/// Names under which Python is looked for.
const NAMES: [&str; 2] = ["python3", "python"];
/// The package, from the root of the workspace.
const PACKAGE: &str = "crates/python";
/// The environment, from the root of the workspace.
const ENVIRONMENT: &str = "target/python";
/// What the package is built with: if it cannot be fetched, nothing can.
const BUILDER: &str = "maturin";

/// Why the package was not tested, or did not pass.
#[derive(Debug, thiserror::Error)]
pub enum PythonError {
    /// Something is not there that is no part of the repository.
    #[error("{0}")]
    Missing(String),
    /// A program could not be started.
    #[error("cannot start {}: {source}", program.display())]
    Start {
        /// The program.
        program: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It said no.
    #[error("`{0}` failed")]
    Step(String),
}

/// Installs the package with the Python of this name, or the first that is found, and runs its tests.
///
/// # Errors
/// [`PythonError::Missing`] without Python or a package index, another one if installation or tests fail.
pub fn run(root: &Path, python: Option<&Path>) -> Result<(), PythonError> {
    let python = find(python)?;
    let environment = root.join(ENVIRONMENT);
    let python = make(&python, &environment)?;
    check_index(root, &python)?;
    let package = format!("./{PACKAGE}[test]");
    step(root, &python, &["-m", "pip", "install", "--quiet", "--disable-pip-version-check", &package])?;
    let cache = format!("cache_dir={}", environment.join("pytest").display());
    step(&root.join(PACKAGE), &python, &["-B", "-m", "pytest", "-o", &cache])
}

/// The interpreter of an environment in a folder of the workspace that has these packages; makes it if it is
/// not there.
///
/// # Errors
/// [`PythonError::Missing`] without Python or the packages.
pub fn with_packages(root: &Path, folder: &str, packages: &[&str]) -> Result<PathBuf, PythonError> {
    let environment = root.join(folder);
    let python = program_of(&environment);
    let import = format!("import {}", packages.join(", "));
    let has_all = |python: &Path| {
        let output = Command::new(python).args(["-c", &import]).output();
        output.is_ok_and(|output| output.status.success())
    };
    if has_all(&python) {
        return Ok(python);
    }
    let python = make(&find(None)?, &environment)?;
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(packages);
    outcome(&python, install.output())?;
    match has_all(&python) {
        true => Ok(python),
        false => Err(PythonError::Missing(format!("{} cannot be fetched", packages.join(" and ")))),
    }
}

/// Makes a fresh environment; returns its interpreter.
fn make(python: &Path, environment: &Path) -> Result<PathBuf, PythonError> {
    eprintln!("a fresh environment of {} in {}", python.display(), environment.display());
    let mut make = Command::new(python);
    make.args(["-m", "venv", "--clear"]).arg(environment);
    if !outcome(python, make.output())?.status.success() {
        let text = format!("{} makes no environments: install its module venv", python.display());
        return Err(PythonError::Missing(text));
    }
    Ok(program_of(environment))
}

/// The interpreter of an environment.
fn program_of(environment: &Path) -> PathBuf {
    if cfg!(windows) { environment.join("Scripts/python.exe") } else { environment.join("bin/python") }
}

/// The interpreter to use.
fn find(python: Option<&Path>) -> Result<PathBuf, PythonError> {
    let named: Vec<PathBuf> = match python {
        Some(python) => vec![python.to_owned()],
        None => NAMES.map(PathBuf::from).into(),
    };
    let found = named.iter().find(|python| version(python).is_some_and(|version| version >= OLDEST));
    found.cloned().ok_or_else(|| {
        let names: Vec<_> = named.iter().map(|python| python.display().to_string()).collect();
        let (major, minor) = OLDEST;
        let names = names.join(", ");
        PythonError::Missing(format!(
            "no Python {major}.{minor} or newer is there ({names}); name one by --python"
        ))
    })
}

/// The version of an interpreter; none if it is not there.
fn version(python: &Path) -> Option<(u32, u32)> {
    let ask = "import sys; print(*sys.version_info[:2])";
    let output = Command::new(python).args(["-c", ask]).stderr(Stdio::null()).output().ok()?;
    parse_version(&String::from_utf8_lossy(&output.stdout))
}

fn parse_version(text: &str) -> Option<(u32, u32)> {
    let (major, minor) = text.trim().split_once(' ')?;
    Some((major.parse().ok()?, minor.parse().ok()?))
}

/// Whether packages can be fetched.
fn check_index(root: &Path, python: &Path) -> Result<(), PythonError> {
    let fetched = root.join(ENVIRONMENT).join("fetched");
    let mut fetch = Command::new(python);
    fetch.args([
        "-m",
        "pip",
        "download",
        "--quiet",
        "--disable-pip-version-check",
        "--no-deps",
        "--retries",
        "1",
    ]);
    fetch.arg("--dest").arg(fetched).arg(BUILDER);
    let output = outcome(python, fetch.output())?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.trim().lines().last().unwrap_or("pip says nothing").to_owned();
    Err(PythonError::Missing(format!("packages cannot be fetched, a network is needed: {last}")))
}

fn step(folder: &Path, program: &Path, arguments: &[&str]) -> Result<(), PythonError> {
    let words = arguments.join(" ");
    eprintln!("python {words}");
    let status = Command::new(program).args(arguments).current_dir(folder).status();
    let status = status.map_err(|source| PythonError::Start { program: program.to_owned(), source })?;
    if status.success() { Ok(()) } else { Err(PythonError::Step(format!("python {words}"))) }
}

fn outcome(program: &Path, output: std::io::Result<Output>) -> Result<Output, PythonError> {
    output.map_err(|source| PythonError::Start { program: program.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_compared_as_numbers() {
        assert_eq!(parse_version("3 11\n"), Some((3, 11)));
        assert!(parse_version("3 9").is_some_and(|version| version >= OLDEST));
        assert!(parse_version("2 7").is_some_and(|version| version < OLDEST));
        assert_eq!(parse_version(""), None);
    }

    #[test]
    fn what_is_not_there_is_said() {
        let error = find(Some(Path::new("/no/such/python"))).expect_err("it is not there").to_string();
        assert_eq!(error, "no Python 3.9 or newer is there (/no/such/python); name one by --python");
    }
}
