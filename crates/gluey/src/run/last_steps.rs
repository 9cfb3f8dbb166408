//! The last whole steps of all runs of a program, for whoever asks it to stop.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread::sleep;
use std::time::Duration;

use thiserror::Error;

use crate::number_text::shown;
use crate::progress::Notice;

/// The last whole steps of the runs of a program that are going on. What asks the program to stop can have
/// them saved from another thread, and then end the program without a loss.
///
/// Runs whose flow ranks share are not among them: their checkpoints take all ranks.
#[derive(Clone, Default)]
pub struct LastSteps(Arc<Mutex<Vec<Weak<dyn OfRun>>>>);

/// The end of a run that was asked to stop.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("interrupted after step {step} of {steps} (t = {})", shown(*time))]
pub struct Ended {
    /// Steps done.
    pub step: usize,
    /// Steps in all.
    pub steps: usize,
    /// Time reached.
    pub time: f64,
    /// Where the run can go on from.
    pub checkpoint: Option<PathBuf>,
}

/// The last whole step of one run, in any dimension.
pub(super) trait OfRun: Send + Sync {
    /// Writes a checkpoint of it.
    fn save(&self) -> Vec<Notice>;

    /// The same, after which the run does nothing any more; none while it comes to its end by itself.
    fn end(&self) -> Option<(Ended, Vec<Notice>)>;
}

impl LastSteps {
    /// Writes a checkpoint of the last whole step of each run, and gives what should be known of it.
    pub fn save(&self) -> Vec<Notice> {
        self.runs().iter().filter_map(Weak::upgrade).flat_map(|run| run.save()).collect()
    }

    /// The same, after which runs do nothing any more; gives how each of them ended. Those that are giving
    /// their files their names come to their end before. The program is to exit then.
    pub fn end(&self) -> (Vec<Ended>, Vec<Notice>) {
        let (mut all, mut told) = (Vec::new(), Vec::new());
        for run in self.runs() {
            while let Some(here) = run.upgrade() {
                if let Some((ended, notices)) = here.end() {
                    all.push(ended);
                    told.extend(notices);
                    break;
                }
                drop(here);
                sleep(Duration::from_millis(1));
            }
        }
        (all, told)
    }

    /// Takes in one more.
    pub(super) fn add(&self, run: &Arc<dyn OfRun>) {
        locked(&self.0).push(Arc::downgrade(run));
    }

    fn runs(&self) -> Vec<Weak<dyn OfRun>> {
        locked(&self.0).clone()
    }
}

impl fmt::Debug for LastSteps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LastSteps")
    }
}

/// A lock that a thread has panicked with is as good as any: what it guards is whole between two steps.
pub(super) fn locked<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
