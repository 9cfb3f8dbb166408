//! How a run tells where it is, and what it came upon.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::case::{Case, IdleKey};
use crate::output::solver_log::SolverRow;

/// Where a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressState<'a> {
    /// Steps done.
    pub step: usize,
    /// Steps in all.
    pub steps: usize,
    /// Time reached in the simulation.
    pub time: f64,
    /// The work being done: `flow`, `contact`, `motion` or `output`.
    pub phase: &'a str,
    /// Wall time since the run started, in seconds.
    pub wall_s: f64,
    /// Estimate of the wall time left, in seconds; `None` before the first step is done.
    pub left_s: Option<f64>,
}

impl fmt::Display for ProgressState<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let left = self.left_s.map_or("?".into(), duration);
        let rate = match self.left_s {
            Some(left) if left > 0.0 => format!("{:.3}", (self.steps - self.step) as f64 / left),
            _ => "?".into(),
        };
        write!(f, "t = {:.3}, {rate} steps/s, {left} left, {}", self.time, self.phase)
    }
}

/// A time one waits, in words.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

/// Receives reports while a run goes on, a few times a step.
pub trait Progress: Sync {
    /// Takes note of where the run is; called from the thread of the run, and expected to return at once.
    fn report(&self, state: &ProgressState<'_>);

    /// Takes note of what the flow and the contacts of a step took; called as [`Progress::report`] is.
    fn step(&self, _: &SolverRow<'_>) {}

    /// Takes note of something that is no error but should be known; called as [`Progress::report`] is.
    fn notice(&self, _: &Notice) {}
}

/// Something a run came upon that is no error but should be known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Keys of the case are set and do nothing.
    NoEffect {
        /// The keys, with their tables.
        keys: Vec<String>,
        /// What makes them idle, as a case says it.
        why: String,
    },
    /// Earlier runs left rows of results that they did not complete.
    EarlierDrafts {
        /// The files; they are left as they are.
        drafts: Vec<PathBuf>,
    },
    /// The checkpoint of an earlier run was renamed, for a run whose drafts are still there may want to go on
    /// from it.
    CheckpointSetAside {
        /// Its old name.
        from: PathBuf,
        /// Its new name.
        to: PathBuf,
    },
    /// The file system knows no locks: nothing keeps two runs from writing the same results.
    NotLocked {
        /// The lock file.
        lock: PathBuf,
    },
    /// A run failed, and a checkpoint of its last good step could not be written.
    NoCheckpoint {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A run ended, and its record could not be brought up to date.
    NoRecord {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

impl Notice {
    /// Keys of a case that do nothing, those together that are idle for the same reason.
    pub fn of_idle_keys(case: &Case) -> Vec<Self> {
        let mut notices: Vec<Self> = Vec::new();
        for IdleKey { key, why } in case.idle_keys() {
            match notices.last_mut() {
                Some(Self::NoEffect { keys, why: last }) if *last == why => keys.push(key),
                _ => notices.push(Self::NoEffect { keys: vec![key], why }),
            }
        }
        notices
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoEffect { keys, why } => write!(f, "without effect: {} ({why})", keys.join(", ")),
            Self::EarlierDrafts { drafts, folder } => {
                write!(
                    f,
                    "rows of earlier runs that did not come to their end stay as they are, beside those of this run:"
                )?;
                drafts.iter().try_for_each(|draft| write!(f, " {}", draft.display()))?;
                match folder {
                    Some(folder) => {
                        write!(
                            f,
                            "; to go on with them instead, stop this run and take gluey resume {}",
                            folder.display()
                        )?;
                    }
                    None => write!(f, "; there is no checkpoint to go on with them")?,
                }
                write!(f, "; --force takes them away")
            }
            Self::CheckpointSetAside { from, to } => {
                write!(
                    f,
                    "{}: the checkpoint of an earlier run is now {1}; to go on with that run: gluey run CASE --resume {1}",
                    from.display(),
                    to.display()
                )
            }
            Self::NotLocked { lock } => write!(
                f,
                "{}: the file system knows no locks; see to it that no other run writes the same results",
                lock.display()
            ),
            Self::NoCheckpoint { path, reason } => {
                write!(f, "{}: no checkpoint of the last good step: {reason}", path.display())
            }
            Self::NoRecord { path, reason } => {
                write!(f, "{}: does not say how the run ended: {reason}", path.display())
            }
        }
    }
}

/// Takes no note of anything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _: &ProgressState<'_>) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_given_in_units_one_can_wait_in() {
        assert_eq!(duration(3.4), "3 s");
        assert_eq!(duration(125.0), "2 min 05 s");
        assert_eq!(duration(3720.0), "1 h 02 min");
    }
}
