//! Dependencies that no source of their package names.

use std::path::Path;

use super::arrows::{Dependency, Metadata, Package};
use super::sources::{SourceFile, words};

/// Folders whose files belong to several packages; the program tests the examples of the library, too.
const SHARED: [&str; 3] = ["tests", "benches", "crates/gluey/examples"];

/// Dependencies that are listed but not named, where they could be: under `src` for normal ones, anywhere in
/// the package or in the shared folders for those of tests.
pub fn offences(root: &Path, metadata: &Metadata, sources: &[SourceFile]) -> Vec<String> {
    let of_package = |package: &Package| {
        let folder = package.folder(root);
        let unused = package.dependencies.iter().filter(|dependency| !is_used(dependency, &folder, sources));
        let name = package.name.clone();
        unused.map(move |dependency| format!("{name}: `{}` is not used", dependency.name)).collect::<Vec<_>>()
    };
    metadata.packages.iter().flat_map(of_package).collect()
}

fn is_used(dependency: &Dependency, folder: &str, sources: &[SourceFile]) -> bool {
    let name = dependency.name.replace('-', "_");
    let is_for_tests = dependency.kind.is_some();
    let could = |source: &&SourceFile| match is_for_tests {
        true => source.lies_in(folder) || SHARED.iter().any(|shared| source.lies_in(shared)),
        false => source.lies_in(&format!("{folder}/src")),
    };
    sources
        .iter()
        .filter(could)
        .any(|source| source.lines.iter().any(|line| words(line, &name).next().is_some()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dependency_nobody_names_is_found() {
        let json = r#"{"packages":[{"name":"a","manifest_path":"/w/crates/a/Cargo.toml","dependencies":
            [{"name":"used-one","kind":null},{"name":"idle","kind":null},{"name":"for-tests","kind":"dev"}]}]}"#;
        let metadata: Metadata = serde_json::from_str(json).unwrap();
        let sources = [
            SourceFile::new("crates/a/src/lib.rs".into(), "use used_one::X;\nlet idleness = 1;\n"),
            SourceFile::new("tests/t.rs".into(), "use for_tests::Y;\n"),
        ];
        let found = offences(Path::new("/w"), &metadata, &sources);
        assert_eq!(found, ["a: `idle` is not used"]);
        let without_tests = offences(Path::new("/w"), &metadata, &sources[..1]);
        assert_eq!(without_tests, ["a: `idle` is not used", "a: `for-tests` is not used"]);
    }
}
