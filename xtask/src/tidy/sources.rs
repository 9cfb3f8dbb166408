//! All Rust sources of the workspace, with the lines that are tests marked.

use std::path::{Path, PathBuf};

use anyhow::Context;

/// Folders that hold Rust sources.
const FOLDERS: [&str; 4] = ["crates", "xtask", "tests", "benches"];
/// Folders whose files are tests, examples or timings as a whole.
const TEST_FOLDERS: [&str; 3] = ["/tests/", "/benches/", "/examples/"];
/// Name of the unit tests of a module in a file of their own.
const TEST_FILE: &str = "/tests.rs";

/// A source file.
#[derive(Debug)]
pub struct SourceFile {
    /// Path from the root of the workspace, with `/`.
    pub path: String,
    /// Its lines.
    pub lines: Vec<String>,
    /// Index of the first line that belongs to tests; the number of lines if there is none.
    pub tests_from: usize,
}

impl SourceFile {
    /// A source under this path.
    pub fn new(path: String, text: &str) -> Self {
        let lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let rooted = format!("/{path}");
        let is_test = rooted.ends_with(TEST_FILE) || TEST_FOLDERS.iter().any(|f| rooted.contains(f));
        let tests_from = if is_test {
            0
        } else {
            lines.iter().position(|line| line.trim() == "#[cfg(test)]").unwrap_or(lines.len())
        };
        Self { path, lines, tests_from }
    }

    /// Whether it holds nothing but tests, examples or timings.
    pub fn is_test(&self) -> bool {
        self.tests_from == 0 && !self.lines.is_empty()
    }

    /// Whether it is `place` or lies under it.
    pub fn lies_in(&self, place: &str) -> bool {
        self.path.strip_prefix(place).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    }

    /// Its syntax.
    pub fn syntax(&self) -> anyhow::Result<syn::File> {
        syn::parse_file(&self.lines.join("\n")).with_context(|| self.path.clone())
    }

    /// Line numbers (from 1) and code outside tests and comments.
    pub fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        self.all_code().take_while(|(number, _)| *number <= self.tests_from)
    }

    /// Line numbers (from 1) and code outside comments.
    pub fn all_code(&self) -> impl Iterator<Item = (usize, &str)> {
        let numbered = self.lines.iter().enumerate().map(|(index, line)| (index + 1, line.as_str()));
        numbered.filter(|(_, line)| !line.trim_start().starts_with("//"))
    }
}

/// Every `.rs` file, ordered by path.
pub fn all(root: &Path) -> anyhow::Result<Vec<SourceFile>> {
    let mut paths = Vec::new();
    for folder in FOLDERS.map(|folder| root.join(folder)).into_iter().filter(|folder| folder.is_dir()) {
        collect(&folder, &mut paths).with_context(|| format!("cannot read {}", folder.display()))?;
    }
    paths.sort();
    let source = |path: &PathBuf| {
        let own = path.strip_prefix(root).unwrap_or(path);
        Ok(SourceFile::new(own.to_string_lossy().replace('\\', "/"), &text(path)?))
    };
    paths.iter().map(source).collect()
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, paths)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            paths.push(path);
        }
    }
    Ok(())
}

/// What stands in a line before and after a name, wherever that is a word of its own.
pub fn words<'a>(line: &'a str, name: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let around = line.match_indices(name).map(move |(at, _)| (&line[..at], &line[at + name.len()..]));
    around.filter(move |(before, after)| !before.ends_with(is_part) && !after.starts_with(is_part))
}

/// What stands in a file.
pub fn text(path: &Path) -> anyhow::Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_and_comments_are_not_code() {
        let text = "//! doc\nfn a() {}\n#[cfg(test)]\nmod tests {}\n";
        let source = SourceFile::new("crates/a/src/lib.rs".into(), text);
        assert_eq!(source.code().collect::<Vec<_>>(), [(2, "fn a() {}")]);
        assert_eq!(source.all_code().count(), 3);
        for path in ["crates/a/tests/b.rs", "crates/a/src/b/tests.rs"] {
            assert_eq!(SourceFile::new(path.into(), text).code().count(), 0);
        }
    }
}
