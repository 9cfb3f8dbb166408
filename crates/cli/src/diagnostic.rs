//! Errors as the terminal shows them: what, where in the case file, and what would be right.

use std::fmt;
use std::io::ErrorKind;
use std::path::Path;

use gluey::case::{CaseIssue, InvalidCase, IssuePlace};
use gluey::output::folder_of;
use gluey::{
    CaseError, CheckpointError, CheckpointSummary, Ended, FileError, NotText, OccupiedError, ResultPaths,
    RowsError, RunError, StepError,
};
use miette::{Diagnostic, MietteHandlerOpts, NamedSource, SourceSpan};

/// An error with a hint and, for case files, the lines around it.
#[derive(Debug, Diagnostic)]
pub struct Diagnosed {
    error: Box<dyn std::error::Error + Send + Sync>,
    #[help]
    hint: Option<String>,
    #[source_code]
    source: Option<NamedSource<String>>,
    #[label("here")]
    label: Option<SourceSpan>,
    /// What a case file has wrong, one by one.
    #[related]
    related: Vec<Diagnosed>,
}

/// So many errors of a case file are shown one by one.
const MOST_SHOWN: usize = 20;

/// Shows long lines as they are: paths and numbers can be copied and searched for.
pub fn install() {
    // Fails only if there is a handler already, which then serves as well.
    let _ = miette::set_hook(Box::new(|_| Box::new(MietteHandlerOpts::new().wrap_lines(false).build())));
}

impl Diagnosed {
    /// Adds what helps with `error`, which came from running the case file `case`.
    pub fn new(error: RunError, case: &Path) -> Self {
        match error {
            RunError::Case(CaseError::Invalid(invalid)) => Self::of_case(&invalid),
            error => {
                let hint = hint(&error, case);
                Self::with_hint(error, hint)
            }
        }
    }

    /// Shows each issue with its line and what would be right.
    fn of_case(invalid: &InvalidCase) -> Self {
        let (count, shown) = (invalid.issues.len() + invalid.more, invalid.issues.len().min(MOST_SHOWN));
        let mut issues: Vec<Self> =
            invalid.issues[..shown].iter().map(|issue| Self::of_issue(invalid, issue)).collect();
        match issues.pop() {
            Some(issue) if count == 1 => issue,
            last => {
                let text = format!("{}: {count} errors", invalid.file.display());
                let hint = (shown < count).then(|| format!("{} more are not shown", count - shown));
                Self { related: issues.into_iter().chain(last).collect(), ..Self::with_hint(text, hint) }
            }
        }
    }

    fn of_issue(invalid: &InvalidCase, issue: &CaseIssue) -> Self {
        let one =
            InvalidCase { text: String::new(), issues: vec![issue.clone()], more: 0, ..invalid.clone() };
        let diagnosed = Self::with_hint(one, Some(issue.problem.hint()));
        let IssuePlace::Text { span, .. } = &issue.place else { return diagnosed };
        Self {
            source: Some(NamedSource::new(invalid.file.display().to_string(), invalid.text.clone())),
            label: Some(span.clone().into()),
            ..diagnosed
        }
    }

    /// Any other error, and what to do about it.
    pub fn with_hint(
        error: impl Into<Box<dyn std::error::Error + Send + Sync>>,
        hint: Option<String>,
    ) -> Self {
        Self { hint, source: None, label: None, related: Vec::new(), error: error.into() }
    }
}

/// What to do about `error`.
fn hint(error: &RunError, case: &Path) -> Option<String> {
    let go_on = |checkpoint: &Path| go_on(checkpoint, checkpoint, case);
    Some(match error {
        RunError::Interrupted(Ended { checkpoint: Some(checkpoint), .. }) => {
            format!("to go on: {}", go_on(checkpoint))
        }
        RunError::Stopped { cause, .. } if ends_there_again(cause) => hint(cause, case)?,
        RunError::Stopped { checkpoint, cause, .. } => {
            let cure = match &**cause {
                RunError::Output(error) if is_full(error) => Some("make room on that disk".into()),
                RunError::Output(_) => Some("see to it that the file can be written".into()),
                cause => hint(cause, case),
            };
            let cure = cure.map_or(String::new(), |cure| format!("{cure}; "));
            format!("{cure}then, to go on: {}", go_on(checkpoint))
        }
        RunError::Output(error) if is_full(error) => full_disk_hint(error),
        RunError::Output(_) => "choose a folder that can be written to with --out DIR".into(),
        RunError::Panicked { .. } => {
            "this is a fault of gluey, not of the case: report it with the case file and the lines above".into()
        }
        RunError::InUse(_) => {
            "wait until that run has ended, end it, or write elsewhere with --out DIR".into()
        }
        RunError::Rows(error) => rows_hint(error),
        RunError::Checkpoint(CheckpointError::OtherCase { .. }) => {
            "resume with the case file, strategy and formulation of that run; only its end may be another".into()
        }
        RunError::Checkpoint(error) => checkpoint_hint(error, case),
        RunError::NotShared { .. } => "take that out of the case, or run it on one machine without mpirun".into(),
        RunError::Occupied(OccupiedError::Complete { go_on: Some(command), .. }) => {
            format!("to go on with it to this end: {command}; or write elsewhere with --out DIR; --force computes it anew")
        }
        RunError::Occupied(_) => {
            "write elsewhere with --out DIR, or replace those results with --force".into()
        }
        RunError::Step(StepError::Film { source, .. }) if !source.is_given() => FILM_HINT.into(),
        RunError::Step(StepError::Contact { source, .. }) if source.is_unsolved() => CONTACT_HINT.into(),
        RunError::LeftBox { .. } => {
            "end the run earlier, or take a larger box; contact keeps particles from its walls \
                                     (y), not from open sides"
                .into()
        }
        RunError::TooLarge(too_large) if too_large.limit.is_some() => {
            "raise --memory-limit, or take fewer cells per radius (flow.mesh.cells_per_radius)".into()
        }
        RunError::TooLarge(_) => {
            "take fewer cells per radius (flow.mesh.cells_per_radius), a smaller band, or the multigrid solver".into()
        }
        RunError::Case(error) if NotText::is_in(error) => NotText::HINT.into(),
        RunError::Case(CaseError::Read { path, .. }) => unread_hint(path),
        _ => return None,
    })
}

/// Whether a run that is resumed from its last step comes to the same end.
fn ends_there_again(error: &RunError) -> bool {
    match error {
        RunError::Step(StepError::Film { .. }) => true,
        RunError::Step(StepError::Contact { source, .. }) => source.is_unsolved(),
        _ => false,
    }
}

/// What to do where no forces of contacts are found, also in the smallest part of a step.
const CONTACT_HINT: &str = "to go on from there would end there again: run the case anew with a smaller time.step or with more time.halvings, \
     up to 20 (--set time.step=..., --force or --out DIR); where a dense crowd with friction jams, with less of it \
     (contact.friction) or a smaller fraction";

/// What to do where films cannot be kept open, also in the smallest part of a step: to resume is no help.
const FILM_HINT: &str = "to go on from there would end there again: run the case anew with a smaller time.step or with more \
     time.halvings, up to 20 (--set time.step=..., --force or --out DIR), or let a repulsion keep particles apart \
     ([repulsion]); where particles that are held or driven leave no room, nothing of this helps";

/// What may have been meant by a path that is no case file.
fn unread_hint(path: &Path) -> String {
    let with_ending = path.with_added_extension("toml");
    if with_ending.is_file() {
        return format!("did you mean {}?", with_ending.display());
    }
    let more = match (path.is_dir(), path.exists()) {
        (true, _) => format!("; to go on with a run: gluey resume {}", path.display()),
        (_, true) => String::new(),
        _ => "; `gluey new NAME` writes one to begin with".into(),
    };
    format!("give the path of a case file{more}")
}

/// Whether there is no more room: on the disk, in what a user may take of it, or in a file.
fn is_full(error: &FileError) -> bool {
    matches!(error.source.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge)
}

/// What to do about a full disk: an older checkpoint may still be there.
fn full_disk_hint(error: &FileError) -> String {
    let folder = folder_of(&error.path);
    let runs = ResultPaths::in_folder(folder).unwrap_or_default();
    match runs.iter().any(|run| run.checkpoint().exists()) {
        true => format!(
            "make room on that disk; then, to go on from the last checkpoint: gluey resume {}",
            folder.display()
        ),
        false => "make room on that disk, or choose a folder on another one with --out DIR".into(),
    }
}

/// The command that goes on from `from`, which is `checkpoint` or the one before it.
fn go_on(checkpoint: &Path, from: &Path, case: &Path) -> String {
    let run = ResultPaths::of_csv(checkpoint);
    if run.checkpoint() != checkpoint || !run.record().exists() {
        return format!("gluey run {} --resume {} (with the same options)", case.display(), from.display());
    }
    let generation = if from == checkpoint { "" } else { " --previous" };
    format!("{}{generation}", run.resume_command())
}

/// Offers the checkpoint before the last, where it is whole.
fn checkpoint_hint(error: &CheckpointError, case: &Path) -> String {
    let anew = "start without --resume".to_owned();
    let path = match error {
        CheckpointError::Read(FileError { path, .. })
        | CheckpointError::Foreign { path }
        | CheckpointError::Version { path, .. }
        | CheckpointError::Damaged { path } => path,
        _ => return anew,
    };
    let older = ResultPaths::previous(path);
    CheckpointSummary::read(&older).map_or(anew, |summary| {
        format!(
            "the checkpoint before it, after step {}, is whole; to go on from there: {}",
            summary.step,
            go_on(path, &older, case)
        )
    })
}

fn rows_hint(error: &RowsError) -> String {
    match error {
        RowsError::Differs { path, line } => format!(
            "rows behind the checkpoint came from another program or machine: to compute them anew, delete line {line} of \
             {} and those after it",
            path.display()
        ),
        _ => "give the --out DIR of the run that wrote the checkpoint, or start without --resume".into(),
    }
}

impl From<CaseError> for Diagnosed {
    fn from(error: CaseError) -> Self {
        Self::new(error.into(), Path::new(""))
    }
}

impl fmt::Display for Diagnosed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.error.fmt(f)
    }
}

impl std::error::Error for Diagnosed {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.error.source()
    }
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_record_is_resumed_with_its_case() {
        let checkpoint = Some("nowhere/pair.checkpoint".into());
        let interrupted = Ended { step: 3, steps: 5, time: 0.3, checkpoint }.into();
        assert_eq!(
            hint(&interrupted, Path::new("pair.toml")).as_deref(),
            Some("to go on: gluey run pair.toml --resume nowhere/pair.checkpoint (with the same options)")
        );
    }
}
