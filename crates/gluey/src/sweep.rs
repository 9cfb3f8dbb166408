//! A study: one run for every combination of values of some keys of a case, each in a folder of its own.
//!
//! A folder of a study has a folder for each point, named after its values and with the results of an
//! ordinary run in it, and `sweep.json`, which says which keys and points it is about. What is complete is
//! not run again, what was interrupted goes on from its checkpoint.

mod axis;
mod progress;
mod study;
mod table;

use std::path::{Path, PathBuf};

use thiserror::Error;

pub use axis::SweptKey;
pub use progress::{PointProgress, PointStage, StudyProgress};
pub use study::Study;
pub use table::{PointResult, table};

use crate::case::{Case, CaseError, Override};
use crate::output::{FileError, ResultPaths};
use crate::report::RunReport;
use crate::run::{RecordError, RunRecord, RunState};

/// Longest name of the folder of a point.
const LONGEST_NAME: usize = 150;

/// A study could not be begun.
#[derive(Debug, Error)]
pub enum SweepError {
    /// A point makes no case.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// Two points would have the same folder.
    #[error("two points of the study are called {name}")]
    Twice {
        /// Their name.
        name: String,
    },
    /// A key is swept twice.
    #[error("{key} is set twice")]
    KeyTwice {
        /// The key.
        key: String,
    },
    /// The name of a point is longer than that of a folder can be.
    #[error("the values of a point are too long for the name of a folder: {name}")]
    LongName {
        /// The name.
        name: String,
    },
    /// The folder holds something else.
    #[error("{}: something else than a study is there", folder.display())]
    Foreign {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder holds a study of other keys.
    #[error("{}: a study of {} is there, not of {}", folder.display(), found.join(", "), wanted.join(", "))]
    OtherKeys {
        /// The folder.
        folder: PathBuf,
        /// Its keys.
        found: Vec<String>,
        /// The keys of this study.
        wanted: Vec<String>,
    },
    /// The folder holds runs of another case.
    #[error("{}: a run of another case is there", folder.display())]
    OtherCase {
        /// The folder of the point.
        folder: PathBuf,
    },
    /// A record of a run cannot be read.
    #[error("the record of a point cannot be used")]
    Record(#[from] RecordError),
    /// Something could not be written.
    #[error(transparent)]
    Output(#[from] FileError),
}

/// A run of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyPoint {
    /// Its name, which its folder has too: `time.step=0.1+contact.strategy=none`.
    pub name: String,
    /// Values of the swept keys, in their order.
    pub values: Vec<String>,
    /// The case with these values.
    pub case: Case,
    /// Where its results are.
    pub paths: ResultPaths,
}

/// The state of a point.
#[derive(Clone, Debug, PartialEq)]
pub enum PointState {
    /// It was not run, or not as far as the first checkpoint.
    Fresh,
    /// It can go on from this checkpoint.
    Interrupted(PathBuf),
    /// It is done.
    Complete(Box<RunReport>),
    /// A run of another case is there.
    OtherCase,
}

impl StudyPoint {
    /// How the point is, by what lies in its folder.
    ///
    /// # Errors
    /// When there is a record that cannot be read.
    pub fn state(&self) -> Result<PointState, RecordError> {
        if !self.paths.record().exists() {
            return Ok(PointState::Fresh);
        }
        let record = RunRecord::read(&self.paths.record())?;
        let there = Case::load(self.paths.case_file()).ok().and_then(|case| case.to_toml().ok());
        if there.is_none() || there != self.case.to_toml().ok() {
            return Ok(PointState::OtherCase);
        }
        Ok(match (record.state, record.report) {
            (RunState::Complete, Some(report)) => PointState::Complete(Box::new(report)),
            _ if self.paths.checkpoint().exists() => PointState::Interrupted(self.paths.checkpoint()),
            _ => PointState::Fresh,
        })
    }
}

/// All points of a study of the case in `file`: the last axis changes fastest. Every case is read and
/// checked.
///
/// # Errors
/// [`SweepError`] if any of them makes no case, or two have the same name.
pub fn points(file: &Path, axes: &[SweptKey], folder: &Path) -> Result<Vec<StudyPoint>, SweepError> {
    for (index, axis) in axes.iter().enumerate() {
        if axes[..index].iter().any(|other| other.key == axis.key) {
            return Err(SweepError::KeyTwice { key: axis.key.clone() });
        }
    }
    let mut combinations: Vec<Vec<&Override>> = vec![Vec::new()];
    for axis in axes {
        let with = |set: &Vec<_>, value| set.iter().copied().chain([value]).collect();
        combinations = combinations
            .iter()
            .flat_map(|set| axis.values.iter().map(move |value| with(set, value)))
            .collect();
    }
    let mut points: Vec<StudyPoint> = Vec::new();
    for set in combinations {
        let point = point(file, axes, &set, folder)?;
        if points.iter().any(|other| other.name == point.name) {
            return Err(SweepError::Twice { name: point.name });
        }
        points.push(point);
    }
    Ok(points)
}

fn point(file: &Path, axes: &[SweptKey], set: &[&Override], folder: &Path) -> Result<StudyPoint, SweepError> {
    let values: Vec<String> = set.iter().map(|value| axis::written(value)).collect();
    let named = axes.iter().zip(&values).map(|(axis, value)| format!("{}={}", axis.key, plain(value)));
    let name = named.collect::<Vec<_>>().join("+");
    if name.len() > LONGEST_NAME {
        return Err(SweepError::LongName { name });
    }
    let overrides: Vec<Override> = set.iter().map(|&value| value.clone()).collect();
    let case = Case::load_with(file, &overrides)?;
    let paths = ResultPaths::new(folder.join(&name), case.file_stem());
    Ok(StudyPoint { name, values, case, paths })
}

/// A value with what does not belong in a file name left out.
fn plain(value: &str) -> String {
    let kept = value.chars().filter(|c| !c.is_whitespace() && !"[]{}\"'".contains(*c));
    kept.map(|c| if c.is_ascii_alphanumeric() || "-_.=".contains(c) { c } else { '_' }).collect()
}
