//! `cargo xtask python`: installs the Python package in a fresh environment as a newcomer would, and runs its
//! tests.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::program::{self, Missing};

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
/// How packages are installed.
const INSTALL: &str = "-m pip install --quiet --disable-pip-version-check";

/// Installs the package with the Python of this name, or the first that is found, and runs its tests.
///
/// # Errors
/// [`Missing`] without Python or a package index, another one if installation or tests fail.
pub fn run(root: &Path, python: Option<&Path>) -> anyhow::Result<()> {
    let environment = root.join(ENVIRONMENT);
    let python = make(&find(python)?, &environment)?;
    check_index(&environment, &python)?;
    step(root, &python, INSTALL, &format!("./{PACKAGE}[test]"))?;
    let cache = format!("cache_dir={}", environment.join("pytest").display());
    step(&root.join(PACKAGE), &python, "-B -m pytest -o", &cache)
}

/// The interpreter of an environment in a folder of the workspace that has these packages; makes it if it is
/// not there.
///
/// # Errors
/// [`Missing`] without Python or the packages.
pub fn with_packages(root: &Path, folder: &str, packages: &[&str]) -> anyhow::Result<PathBuf> {
    let environment = root.join(folder);
    let import = format!("import {}", packages.join(", "));
    let has_all = |python: &Path| {
        let output = Command::new(python).args(["-c", &import]).output();
        output.is_ok_and(|output| output.status.success())
    };
    let python = program_of(&environment);
    if has_all(&python) {
        return Ok(python);
    }
    let python = make(&find(None)?, &environment)?;
    program::output(Command::new(&python).args(INSTALL.split(' ')).args(packages))?;
    match has_all(&python) {
        true => Ok(python),
        false => Err(Missing(format!("{} cannot be fetched", packages.join(" and "))).into()),
    }
}

/// Makes a fresh environment; returns its interpreter.
fn make(python: &Path, environment: &Path) -> anyhow::Result<PathBuf> {
    eprintln!("a fresh environment of {} in {}", python.display(), environment.display());
    let made = program::output(Command::new(python).args(["-m", "venv", "--clear"]).arg(environment))?;
    if !made.status.success() {
        let text = format!("{} makes no environments: install its module venv", python.display());
        return Err(Missing(text).into());
    }
    Ok(program_of(environment))
}

/// The interpreter of an environment.
fn program_of(environment: &Path) -> PathBuf {
    if cfg!(windows) { environment.join("Scripts/python.exe") } else { environment.join("bin/python") }
}

/// The interpreter to use.
fn find(python: Option<&Path>) -> Result<PathBuf, Missing> {
    let named = python.map_or_else(|| NAMES.map(PathBuf::from).into(), |python| vec![python.to_owned()]);
    let found = named.iter().find(|python| version(python).is_some_and(|version| version >= OLDEST));
    found.cloned().ok_or_else(|| {
        let names: Vec<_> = named.iter().map(|python| python.display().to_string()).collect();
        let ((major, minor), names) = (OLDEST, names.join(", "));
        Missing(format!("no Python {major}.{minor} or newer is there ({names}); name one by --python"))
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
fn check_index(environment: &Path, python: &Path) -> anyhow::Result<()> {
    let words = "-m pip download --quiet --disable-pip-version-check --no-deps --retries 1 --dest";
    let mut fetch = Command::new(python);
    fetch.args(words.split(' ')).arg(environment.join("fetched")).arg(BUILDER);
    let output = program::output(&mut fetch)?;
    if output.status.success() {
        return Ok(());
    }
    let said = program::complaint(&output);
    let last = said.trim().lines().last().unwrap_or("pip says nothing");
    Err(Missing(format!("packages cannot be fetched, a network is needed: {last}")).into())
}

/// Python with words that blanks separate, and a last one.
fn step(folder: &Path, python: &Path, words: &str, last: &str) -> anyhow::Result<()> {
    eprintln!("python {words} {last}");
    let mut command = Command::new(python);
    command.args(words.split(' ')).arg(last).current_dir(folder);
    program::run(&mut command, &format!("`python {words} {last}` failed"))
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
