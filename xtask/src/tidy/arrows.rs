//! Dependencies between the crates of the workspace, as cargo sees them, against the law.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use serde::Deserialize;

use super::law::Law;
use crate::program;

/// The crate that tests, and only tests, may use everywhere.
const TEST_CRATE: &str = "gluey-testkit";

/// Part of `cargo metadata` that is needed.
#[derive(Debug, Deserialize)]
pub struct Metadata {
    /// The members of the workspace.
    pub packages: Vec<Package>,
}

/// A member of the workspace.
#[derive(Debug, Deserialize)]
pub struct Package {
    /// Its name.
    pub name: String,
    #[serde(default)]
    manifest_path: PathBuf,
    /// What it depends on.
    pub dependencies: Vec<Dependency>,
}

impl Package {
    /// Its folder, from the root of the workspace.
    pub fn folder(&self, root: &Path) -> String {
        let folder = self.manifest_path.parent().and_then(|folder| folder.strip_prefix(root).ok());
        folder.unwrap_or(Path::new("")).to_string_lossy().into_owned()
    }
}

/// A dependency of a package.
#[derive(Debug, Deserialize)]
pub struct Dependency {
    /// Its name.
    pub name: String,
    /// `dev`, `build`, or none for a normal dependency.
    pub kind: Option<String>,
}

impl Metadata {
    /// The folders of all members, from the root of the workspace.
    pub fn folders(&self, root: &Path) -> Vec<String> {
        self.packages.iter().map(|package| package.folder(root)).collect()
    }
}

/// Asks cargo for the members of the workspace.
pub fn metadata(root: &Path) -> anyhow::Result<Metadata> {
    let mut cargo = program::cargo("metadata --format-version 1 --no-deps --offline");
    let output = program::output(cargo.current_dir(root))?;
    ensure!(output.status.success(), "cargo metadata: {}", program::complaint(&output));
    serde_json::from_slice(&output.stdout).context("cargo metadata")
}

/// Arrows that the law does not know, crates it does not name and names that are no crates.
pub fn offences(law: &Law, metadata: &Metadata) -> Vec<String> {
    let members: BTreeSet<&str> = metadata.packages.iter().map(|package| &*package.name).collect();
    let mut offences: Vec<String> = law
        .arrows
        .keys()
        .filter(|name| !members.contains(&***name))
        .map(|name| format!("ARCHITECTURE.md: `{name}` is not a crate of the workspace"))
        .collect();
    for package in &metadata.packages {
        let Some(allowed) = law.arrows.get(&package.name) else {
            offences.push(format!("{}: not in the arrows of ARCHITECTURE.md", package.name));
            continue;
        };
        let internal = package.dependencies.iter().filter(|dependency| members.contains(&*dependency.name));
        for dependency in internal.filter(|dependency| !allowed.contains(&dependency.name)) {
            if dependency.kind.as_deref() != Some("dev") {
                offences.push(format!("{} -> {}: not in ARCHITECTURE.md", package.name, dependency.name));
            } else if !allowed_in_tests(law, &package.name, &dependency.name) {
                offences.push(format!("{} ~> {}: not in ARCHITECTURE.md", package.name, dependency.name));
            }
        }
    }
    offences
}

fn allowed_in_tests(law: &Law, package: &str, dependency: &str) -> bool {
    dependency == TEST_CRATE
        || law.test_arrows.get(package).is_some_and(|allowed| allowed.contains(dependency))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metadata(json: &str) -> Metadata {
        serde_json::from_str(json).unwrap()
    }

    fn law() -> Law {
        let mut law = Law::default();
        law.arrows.insert("a".into(), BTreeSet::new());
        law.arrows.insert("b".into(), BTreeSet::from(["a".into()]));
        law
    }

    #[test]
    fn known_arrows_pass_and_unknown_ones_are_named() {
        let good = r#"{"packages":[{"name":"a","dependencies":[{"name":"serde","kind":null}]},
            {"name":"b","dependencies":[{"name":"a","kind":null}]}]}"#;
        assert!(offences(&law(), &metadata(good)).is_empty());
        let upward = r#"{"packages":[{"name":"a","dependencies":[{"name":"b","kind":null}]},
            {"name":"b","dependencies":[]}]}"#;
        assert_eq!(offences(&law(), &metadata(upward)), ["a -> b: not in ARCHITECTURE.md"]);
        let upward_in_tests = upward.replace("null", "\"dev\"");
        assert_eq!(offences(&law(), &metadata(&upward_in_tests)), ["a ~> b: not in ARCHITECTURE.md"]);
    }

    #[test]
    fn crates_and_law_name_each_other() {
        let other = r#"{"packages":[{"name":"a","dependencies":[]},{"name":"c","dependencies":[]}]}"#;
        assert_eq!(offences(&law(), &metadata(other)).len(), 2);
    }
}
