//! Every kind of invalid case, and what the command says of it: `tests/invalid/NAME.toml` and `NAME.stderr`.
//!
//! A case file may begin with the line `# gluey check NAME.toml ...`, the command that is refused. With the
//! environment variable `GLUEY_BLESS` messages are written instead of compared: read them as a user would.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use gluey::case::IssuePlace;
use gluey::{Case, CaseError};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/invalid");

/// What follows the name of the file in the command of its first line.
fn more_arguments(text: &[u8]) -> Vec<String> {
    let line = text.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let words: Vec<&str> = std::str::from_utf8(line).unwrap_or_default().split_whitespace().collect();
    match words[..] {
        ["#", "gluey", "check", _, ..] => words[4..].iter().map(|word| (*word).to_owned()).collect(),
        _ => Vec::new(),
    }
}

/// What `gluey VERB` says of a file that it refuses.
fn refusal(verb: &str, file: &Path) -> String {
    let name = file.file_name().expect("a name");
    let arguments = more_arguments(&fs::read(file).expect("a file"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
    command.current_dir(FOLDER).arg(verb).arg(name).args(arguments).env("NO_COLOR", "1");
    let output = command.output().expect("it runs");
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(1), "{}: {stderr}", file.display());
    assert!(output.stdout.is_empty() && !stderr.contains("panicked"), "{stderr}");
    stderr
}

fn cases() -> Vec<PathBuf> {
    let entries = fs::read_dir(FOLDER).expect("the folder").map(|entry| entry.expect("an entry").path());
    let mut files: Vec<PathBuf> =
        entries.filter(|path| path.extension().is_some_and(|extension| extension == "toml")).collect();
    files.sort();
    files
}

#[test]
fn messages_are_those_that_were_read_and_found_good() {
    let files = cases();
    assert!(files.len() >= 60, "{}", files.len());
    let bless = std::env::var_os("GLUEY_BLESS").is_some();
    let mut others = Vec::new();
    for file in &files {
        let (found, snapshot) = (refusal("check", file), file.with_extension("stderr"));
        if bless {
            fs::write(snapshot, found).expect("a snapshot");
        } else if fs::read_to_string(snapshot).unwrap_or_default() != found {
            others.push(format!("{}:\n{found}", file.display()));
        }
    }
    assert!(others.is_empty(), "{} messages are others:\n{}", others.len(), others.join("\n"));
}

/// Nothing is written for a case that is refused.
#[test]
fn a_run_is_refused_as_a_check_is() {
    for file in cases().iter().step_by(10) {
        assert_eq!(refusal("run", file), refusal("check", file), "{}", file.display());
    }
    assert!(!Path::new(FOLDER).join("out").exists(), "output was written");
}

/// What a message must have, whatever its words: where it is, and what would be right.
#[test]
fn messages_name_a_place_and_a_cure() {
    for file in cases() {
        let arguments = more_arguments(&fs::read(&file).expect("a file"));
        let set: Vec<_> =
            arguments.iter().filter(|word| *word != "--set").map(|word| word.parse().expect("set")).collect();
        match Case::load_with(&file, &set).expect_err("it is invalid") {
            CaseError::Read { path, .. } => assert_eq!(path, file),
            CaseError::Invalid(invalid) => {
                assert!(!invalid.issues.is_empty());
                for (issue, line) in invalid.issues.iter().zip(invalid.to_string().lines()) {
                    let place = format!("{}:", file.display());
                    let is_placed =
                        line.starts_with(&place) || matches!(issue.place, IssuePlace::List { .. });
                    assert!(is_placed || line.starts_with("--set "), "{line}");
                    let has_key = !issue.key.is_root()
                        || issue.value.is_some()
                        || line.contains("not valid TOML")
                        || line.contains("not seen");
                    assert!(has_key || line.starts_with("--set "), "{line}");
                    assert!(issue.problem.hint().len() > 5, "{line}");
                }
            }
        }
    }
}
