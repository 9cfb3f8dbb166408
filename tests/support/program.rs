//! The program `gluey` as people call it, in a folder.

#![allow(dead_code, reason = "each test that shares this needs another part of it")]

use std::path::Path;

use assert_cmd::Command;

/// Exit code, output and error output.
pub fn gluey(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
    let output = command.current_dir(folder).args(arguments).output().expect("it runs");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// The output of what succeeds.
pub fn told(folder: &Path, arguments: &[&str]) -> String {
    let (code, stdout, stderr) = gluey(folder, arguments);
    assert_eq!(code, Some(0), "{stderr}");
    stdout
}

/// What fails, says all of `expected`, and has no output.
pub fn fails(folder: &Path, arguments: &[&str], expected: &[&str]) {
    let (code, stdout, stderr) = gluey(folder, arguments);
    assert_eq!((code, &*stdout), (Some(1), ""), "{stderr}");
    for part in expected {
        assert!(stderr.contains(part), "`{part}` is not in:\n{stderr}");
    }
    assert!(!stderr.contains("panicked"), "{stderr}");
}
