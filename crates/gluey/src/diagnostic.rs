//! Errors as the terminal shows them: what, where in the case file, and what would be right.

use std::fmt;
use std::path::Path;

use gluey::case::CaseIssue;
use gluey::{CaseError, CheckpointError, RunError};
use miette::{Diagnostic, LabeledSpan, MietteHandlerOpts, NamedSource, SourceCode};

/// An error with a hint and, for case files, the lines around it.
#[derive(Debug)]
pub struct Diagnosed {
    error: RunError,
    hint: Option<String>,
    source: Option<NamedSource<String>>,
    label: Option<LabeledSpan>,
}

/// Shows long lines as they are: paths and numbers can be copied and searched for.
pub fn install() {
    // Fails only if there is a handler already, which then serves as well.
    let _ = miette::set_hook(Box::new(|_| Box::new(MietteHandlerOpts::new().wrap_lines(false).build())));
}

impl Diagnosed {
    /// Adds what helps with `error`, which came from running the case file `case`.
    pub fn new(error: RunError, case: &Path) -> Self {
        let hint = match &error {
            RunError::Interrupted { checkpoint: Some(checkpoint), .. } => Some(format!(
                "to go on: gluey run {} --resume {} (with the same options)",
                case.display(),
                checkpoint.display()
            )),
            RunError::Output(_) => Some("choose a folder that can be written to with --out DIR".into()),
            RunError::Checkpoint(CheckpointError::OtherCase { .. }) => {
                Some("resume with the case file, strategy and formulation of the interrupted run".into())
            }
            RunError::Checkpoint(_) => Some("start without --resume".into()),
            RunError::LeftBox { .. } => Some("end the run earlier, or take a larger box; contact keeps particles from its walls (y), not from open sides".into()),
            RunError::Case(CaseError::Invalid(issue)) => Some(issue.problem.hint()),
            RunError::Case(CaseError::TooLarge(_)) => Some(
                "take fewer cells per radius (flow.mesh.cells_per_radius), a smaller band, or the multigrid solver".into(),
            ),
            RunError::Case(CaseError::Read { .. }) => Some("give the path of a case file".into()),
            _ => None,
        };
        let issue = match &error {
            RunError::Case(CaseError::Invalid(issue)) if !issue.text.is_empty() => Some(issue),
            _ => None,
        };
        let source =
            issue.map(|issue| NamedSource::new(issue.file.display().to_string(), issue.text.clone()));
        let label = issue.map(|issue| label(issue));
        Self { hint, source, label, error }
    }
}

impl From<CaseError> for Diagnosed {
    fn from(error: CaseError) -> Self {
        Self::new(error.into(), Path::new(""))
    }
}

fn label(issue: &CaseIssue) -> LabeledSpan {
    LabeledSpan::new_with_span(Some("here".into()), issue.span.clone())
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

impl Diagnostic for Diagnosed {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.hint.as_ref().map(|hint| Box::new(hint) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|source| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.label
            .clone()
            .map(|label| Box::new(std::iter::once(label)) as Box<dyn Iterator<Item = LabeledSpan>>)
    }
}
