//! How a command ends that does not come to its end.

use std::path::Path;

use gluey::{CaseError, NotText, RunError};

use crate::diagnostic::Diagnosed;

/// What a shell reports for a program ended by Ctrl-C.
pub const INTERRUPTED: u8 = 130;

/// The failure of a command, and what the program's exit says about it.
#[derive(Debug)]
pub struct Failure {
    /// What to show.
    pub diagnostic: Box<Diagnosed>,
    /// Not 0.
    pub exit_code: u8,
}

impl Failure {
    /// A failure of a run, or an interrupt.
    pub fn of_run(error: RunError, case: &Path) -> Self {
        let exit_code = if matches!(error, RunError::Interrupted(_)) { INTERRUPTED } else { 1 };
        Self { diagnostic: Box::new(Diagnosed::new(error, case)), exit_code }
    }

    /// A failure to show the results in `folder`, which may be none.
    pub fn of_results(error: impl std::error::Error + Send + Sync + 'static, folder: &Path) -> Self {
        let hint = match (folder.is_dir(), folder.join("sweep.csv").exists()) {
            _ if NotText::is_in(&error) => Some(NotText::HINT),
            (false, _) => Some("give the folder that a run wrote to, the DIR of its --out"),
            (true, true) => Some("this is the folder of a study: give that of one of its points"),
            (true, false) => None,
        };
        Self::new(error, hint.map(str::to_owned))
    }

    /// Any other failure, and what to do about it.
    pub fn new(
        error: impl std::error::Error + Send + Sync + 'static,
        hint: impl Into<Option<String>>,
    ) -> Self {
        Self { diagnostic: Box::new(Diagnosed::with_hint(error, hint.into())), exit_code: 1 }
    }
}

impl From<CaseError> for Failure {
    fn from(error: CaseError) -> Self {
        Self { diagnostic: Box::new(error.into()), exit_code: 1 }
    }
}
