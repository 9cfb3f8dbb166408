//! Keeps runs from writing over each other's results.

use std::path::PathBuf;

use thiserror::Error;

use super::options::RunOptions;
use super::record::{RecordError, RunRecord, RunState};
use crate::case::Case;
use crate::checkpoint::{CaseDifference, canonical, difference};
use crate::output::ResultPaths;

/// Results of another run are where a run would write; they are as they were.
#[derive(Debug, Error)]
pub enum OccupiedError {
    /// Those of a complete run of the same case.
    #[error(
        "{}: a complete run of this case is there ({steps} steps, ended {})",
        record.display(),
        ended.as_deref().unwrap_or("at an unknown time")
    )]
    Complete {
        /// Its record.
        record: PathBuf,
        /// Its steps.
        steps: usize,
        /// When it ended.
        ended: Option<String>,
        /// The command that goes on with it to the end that is given now, where that is later.
        go_on: Option<String>,
    },
    /// Those of another case of the same name.
    #[error("{}: a run of another case is there, {state}; {difference}", case_file.display())]
    OtherCase {
        /// The case file of that run.
        case_file: PathBuf,
        /// How it is.
        state: RunState,
        /// The first line in which the cases differ.
        difference: CaseDifference,
    },
    /// Those of a run that left no record.
    #[error("{}: results are there, but no record of their run", csv.display())]
    Unrecorded {
        /// The trajectory.
        csv: PathBuf,
    },
    /// The record of that run cannot be read.
    #[error("results of another run are there, whose record cannot be read")]
    Record(#[from] RecordError),
    /// The case of that run cannot be read.
    #[error("{}: the case of the run that is there cannot be read", case_file.display())]
    CaseFile {
        /// The case file of that run.
        case_file: PathBuf,
    },
}

/// Refuses to start a run where it would replace results of another one. A run of the same case that is not
/// complete is none: its rows are kept.
pub(super) fn check_free(case: &Case, options: &RunOptions) -> Result<(), OccupiedError> {
    let Some(record_options) = options.record else { return Ok(()) };
    if record_options.force || options.resume.is_some() {
        return Ok(());
    }
    let paths = ResultPaths::of_csv(&options.csv);
    if !paths.record().exists() {
        return match options.csv.exists() {
            true => Err(OccupiedError::Unrecorded { csv: options.csv.clone() }),
            false => Ok(()),
        };
    }
    let record = RunRecord::read(&paths.record())?;
    if let Some(difference) = other_case(case, &paths)? {
        let (case_file, state) = (paths.case_file(), record.state);
        return Err(OccupiedError::OtherCase { case_file, state, difference });
    }
    match record.state {
        RunState::Complete => {
            let RunRecord { steps, ended, .. } = record;
            let is_longer = case.step_count() > steps && paths.checkpoint().exists();
            let go_on =
                is_longer.then(|| format!("{} --set time.end={}", paths.resume_command(), case.time.end));
            Err(OccupiedError::Complete { record: paths.record(), steps, ended, go_on })
        }
        _ => Ok(()),
    }
}

/// The first line, but for its end, in which `case` differs from the one that was run.
fn other_case(case: &Case, paths: &ResultPaths) -> Result<Option<CaseDifference>, OccupiedError> {
    let case_file = paths.case_file();
    let saved = Case::load(&case_file).ok().and_then(|saved| canonical(&saved).ok());
    let (Some(saved), Ok(given)) = (saved, canonical(case)) else {
        return Err(OccupiedError::CaseFile { case_file });
    };
    Ok(difference(&saved, &given))
}
