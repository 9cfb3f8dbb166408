//! Errors as exceptions of `gluey.errors`: the text of the command line, with causes and what to do.

use std::error::Error;
use std::path::Path;

use gluey::case::{CaseIssue, InvalidCase, IssuePlace};
use gluey::{
    CaseError, CheckpointError, Ended, FileError, NotText, ResultPaths, ResumeError, RowsError, RunError,
};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// What errors call a case that was a dictionary.
pub const DICTIONARY: &str = "dictionary";

/// An exception of this name in `gluey.errors`, with a text and what to do.
pub fn exception(py: Python<'_>, class: &str, text: &str, hint: Option<&str>) -> PyErr {
    let made = py.import("gluey.errors").and_then(|errors| errors.getattr(class)?.call1((text, hint)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// The exception with further attributes.
fn with<'py, T: IntoPyObject<'py>>(py: Python<'py>, error: PyErr, name: &str, value: T) -> PyErr {
    match error.value(py).setattr(name, value) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// An error with all its causes, one a line.
pub fn in_full(error: &dyn Error) -> String {
    let (mut text, mut cause) = (error.to_string(), error.source());
    while let Some(because) = cause {
        text.push_str(&format!("\n  because {because}"));
        cause = because.source();
    }
    text
}

/// Any error without advice as an exception of this name.
pub fn plain(py: Python<'_>, class: &str, error: &dyn Error) -> PyErr {
    exception(py, class, &in_full(error), None)
}

/// A thread that panicked.
pub fn internal(what: &str) -> PyErr {
    PyRuntimeError::new_err(format!("gluey stopped by an internal error: {what}"))
}

/// A case that cannot be used, as `gluey.CaseError`: all that is wrong, each with what would be right.
pub fn of_case(py: Python<'_>, error: &CaseError) -> PyErr {
    let issues = match error {
        CaseError::Invalid(invalid) => invalid.issues.iter().map(|issue| told(invalid, issue)).collect(),
        CaseError::Read { .. } => {
            let hint = if NotText::is_in(error) { NotText::HINT } else { "give the path of a case file" };
            vec![(String::new(), in_full(error), hint.to_owned())]
        }
    };
    let mut lines: Vec<String> =
        issues.iter().map(|(_, text, hint)| format!("{text}\n  hint: {hint}")).collect();
    if let CaseError::Invalid(invalid) = error
        && invalid.more > 0
    {
        lines.push(format!("and {} more", invalid.more));
    }
    let raised = exception(py, "CaseError", &lines.join("\n"), None);
    let (key, _, hint) = issues.first().cloned().unwrap_or_default();
    let raised = with(py, with(py, raised, "key", key), "hint", hint);
    with(py, raised, "issues", issues)
}

/// The key, the text with its place, and what would be right. A dictionary has no lines.
fn told(invalid: &InvalidCase, issue: &CaseIssue) -> (String, String, String) {
    let file = invalid.file.display();
    let text = match &issue.place {
        IssuePlace::Text { line, column, .. } if invalid.file.as_os_str() != DICTIONARY => {
            format!("{file}:{line}:{column}: {issue}")
        }
        IssuePlace::Text { .. } | IssuePlace::Value => issue.to_string(),
        IssuePlace::List { file, line } => format!("{}:{line}: {issue}", file.display()),
        IssuePlace::Argument(argument) => {
            format!("overrides, {}: {issue}", argument.strip_prefix("--set ").unwrap_or(argument))
        }
    };
    (issue.key.to_string(), text, issue.problem.hint())
}

/// Why a run did not come to its end, as `gluey.CaseError`, `gluey.Interrupted` or `gluey.RunError`.
pub fn of_run(py: Python<'_>, error: &RunError) -> PyErr {
    let hint = hint(error);
    match error {
        RunError::Case(error) => of_case(py, error),
        RunError::Interrupted(Ended { step, steps, time, checkpoint }) => {
            let raised = exception(py, "Interrupted", &in_full(error), hint.as_deref());
            let raised = with(py, raised, "step", *step);
            let raised = with(py, raised, "steps", *steps);
            let raised = with(py, raised, "time", *time);
            let folder = checkpoint.as_deref().map(folder);
            with(py, raised, "folder", folder)
        }
        _ => exception(py, "RunError", &in_full(error), hint.as_deref()),
    }
}

/// Why a run cannot be gone on with, as `gluey.RunError`.
pub fn of_resume(py: Python<'_>, error: &ResumeError) -> PyErr {
    let hint = match error {
        ResumeError::Folder(_) => Some("give the folder that a run wrote to, its out=".to_owned()),
        ResumeError::Several { names, .. } | ResumeError::Unknown { names, .. } => {
            Some(format!("choose one, such as name={:?}", names[0]))
        }
        ResumeError::NoCheckpoint { has_other: true, .. } => {
            Some("go on from the other generation: change previous=".to_owned())
        }
        ResumeError::NoCheckpoint { case_file, .. } => {
            Some(format!("start again: gluey.run({:?})", case_file.display().to_string()))
        }
        ResumeError::Complete { .. } | ResumeError::Record(_) => None,
    };
    exception(py, "RunError", &in_full(error), hint.as_deref())
}

/// What to do about an error of a run, in words of Python.
fn hint(error: &RunError) -> Option<String> {
    Some(match error {
        RunError::Interrupted(Ended { checkpoint: Some(checkpoint), .. }) => go_on(checkpoint, ""),
        RunError::Stopped { checkpoint, cause, .. } => {
            let cure = hint(cause).map_or(String::new(), |cure| format!("{cure}; "));
            format!("{cure}then, {}", go_on(checkpoint, ""))
        }
        RunError::Output(_) => "choose a folder that can be written to, out=".into(),
        RunError::InUse(_) => "wait until that run has ended, end it, or write to another folder, out=".into(),
        RunError::Rows(RowsError::Differs { path, line }) => format!(
            "rows behind the checkpoint came from another program or machine: to compute them anew, delete line \
             {line} of {} and those after it",
            path.display()
        ),
        RunError::Rows(_) => "give the folder of the run that wrote the checkpoint, or start again".into(),
        RunError::Checkpoint(
            CheckpointError::Read(FileError { path, .. })
            | CheckpointError::Foreign { path }
            | CheckpointError::Version { path, .. }
            | CheckpointError::Damaged { path },
        ) => format!("if the checkpoint before it is whole, {}", go_on(path, ", previous=True")),
        RunError::Occupied(_) => "write to another folder, out=, or replace those results, force=True".into(),
        RunError::LeftBox { .. } => {
            "end the run earlier, or take a larger box; contact keeps particles from its walls (y), not from open \
             sides"
                .into()
        }
        RunError::TooLarge(_) => {
            "take fewer cells per radius (flow.mesh.cells_per_radius), a smaller band, or the multigrid solver".into()
        }
        _ => return None,
    })
}

fn go_on(checkpoint: &Path, options: &str) -> String {
    format!("to go on: gluey.resume({:?}{options})", folder(checkpoint))
}

/// The folder of a checkpoint.
fn folder(checkpoint: &Path) -> String {
    ResultPaths::of_csv(checkpoint).folder().display().to_string()
}
