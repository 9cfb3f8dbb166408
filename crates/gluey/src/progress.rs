//! How a run tells where it is, and what it came upon.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::case::{Case, IdleKey};
use crate::number_text::shown;
use crate::output::solver_log::SolverRow;
use crate::tally::Tally;

/// The place of a run: step, time and what is being done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressState {
    /// Steps done.
    pub step: usize,
    /// Steps in all.
    pub steps: usize,
    /// Time reached in the simulation.
    pub time: f64,
    /// The work being done: `flow`, `contact`, `motion` or `output`.
    pub phase: &'static str,
    /// Wall time since the run started, in seconds.
    pub wall_s: f64,
    /// Estimate of the wall time left, in seconds; `None` before the first step is done.
    pub left_s: Option<f64>,
}

impl fmt::Display for ProgressState {
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
    fn report(&self, state: &ProgressState);

    /// Takes note of what the flow and the contacts of a step took; called as [`Progress::report`] is.
    fn step(&self, _: &SolverRow<'_>) {}

    /// Takes note of something that is no error but should be known; called as [`Progress::report`] is.
    fn notice(&self, _: &Notice) {}
}

/// Something a run came upon that is no error but should be known.
#[derive(Clone, Debug, PartialEq)]
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
        /// The folder that a run could go on from, where a checkpoint of theirs is there.
        folder: Option<PathBuf>,
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
    /// A step was done in parts, for the first time in the run.
    HalvedStep {
        /// Steps done before.
        step: usize,
        /// Time at its beginning.
        time: f64,
        /// How many parts.
        parts: usize,
        /// Why the whole could not be done.
        reason: Option<String>,
    },
    /// Penalties at surfaces were changed, for the first time in the run.
    ChangedPenalties {
        /// Steps done before.
        step: usize,
        /// Time at its beginning.
        time: f64,
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

    /// What a step is the first of a run to need, which made this of what was counted before.
    pub(crate) fn of_first(before: &Tally, after: &Tally, row: &SolverRow<'_>) -> Vec<Self> {
        let (step, time) = (row.step, row.time);
        let halved = (before.halved_steps == 0 && after.halved_steps > 0).then(|| {
            let (parts, reason) = (row.motion.parts, row.motion.refused.clone());
            Self::HalvedStep { step, time, parts, reason }
        });
        let changed = !before.has_changed_penalties() && after.has_changed_penalties();
        halved.into_iter().chain(changed.then_some(Self::ChangedPenalties { step, time })).collect()
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
            Self::HalvedStep { step, time, parts, reason } => {
                let why = reason.as_ref().map_or_else(String::new, |reason| format!(": {reason}"));
                write!(
                    f,
                    "step {step} (t = {}) was done in {parts} parts{why}; such steps are counted in the column `parts` \
                     of the solver's table",
                    shown(*time)
                )
            }
            Self::ChangedPenalties { step, time } => write!(
                f,
                "penalties at surfaces were raised in step {step} (t = {}); how often is in the columns \
                 `penalties_doubled` and `cells_raised` of the solver's table",
                shown(*time)
            ),
            Self::NoRecord { path, reason } => {
                write!(f, "{}: does not say how the run ended: {reason}", path.display())
            }
        }
    }
}

/// Says every so often where something is, in a thread of its own: also while it is busy with one thing for
/// long and reports nothing.
#[derive(Debug)]
pub struct Ticker {
    shared: Arc<TickerState>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct TickerState {
    place: Mutex<LastReport>,
    ended: Condvar,
}

/// The last report, if there was any.
#[derive(Debug, Default)]
struct LastReport {
    has_ended: bool,
    state: Option<ProgressState>,
}

impl Ticker {
    /// Calls `say` every `interval` with what was reported last. Where there is no thread to be had, it is
    /// silent.
    pub fn new(interval: Duration, say: impl Fn(&ProgressState) + Send + 'static) -> Self {
        let shared = Arc::<TickerState>::default();
        let of_thread = shared.clone();
        let thread = std::thread::Builder::new().name("ticker".to_owned());
        let thread = thread.spawn(move || of_thread.tick(interval, say)).ok();
        Self { shared, thread }
    }

    /// Takes note of where it is.
    pub fn report(&self, state: &ProgressState) {
        self.shared.place().state = Some(*state);
    }
}

impl TickerState {
    fn place(&self) -> MutexGuard<'_, LastReport> {
        self.place.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tick(&self, interval: Duration, say: impl Fn(&ProgressState)) {
        let mut next = Instant::now() + interval;
        let mut place = self.place();
        while !place.has_ended {
            let left = next.saturating_duration_since(Instant::now());
            place = self.ended.wait_timeout(place, left).unwrap_or_else(PoisonError::into_inner).0;
            if place.has_ended || Instant::now() < next {
                continue;
            }
            next += interval;
            place.state.iter().for_each(&say);
        }
    }
}

impl Drop for Ticker {
    fn drop(&mut self) {
        self.shared.place().has_ended = true;
        self.shared.ended.notify_all();
        // It says no more; how it ended does not matter.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Takes no note of anything.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn report(&self, _: &ProgressState) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flow that takes long is told of as such, not as what comes behind it.
    #[test]
    fn a_long_phase_is_told_while_it_lasts() {
        let told = Arc::new(Mutex::new(Vec::new()));
        let list = told.clone();
        let ticker = Ticker::new(Duration::from_millis(2), move |state| {
            list.lock().expect("a list").push(state.phase.to_owned());
        });
        let state = ProgressState { step: 3, steps: 9, time: 0.3, phase: "flow", wall_s: 1.0, left_s: None };
        ticker.report(&state);
        let deadline = Instant::now() + Duration::from_secs(60);
        while told.lock().expect("a list").len() < 3 {
            assert!(Instant::now() < deadline, "it is silent");
            std::thread::sleep(Duration::from_millis(1));
        }
        drop(ticker);
        let told = told.lock().expect("a list").clone();
        assert!(told.iter().all(|phase| phase == "flow"), "{told:?}");
    }

    #[test]
    fn times_are_given_in_units_one_can_wait_in() {
        assert_eq!(duration(3.4), "3 s");
        assert_eq!(duration(125.0), "2 min 05 s");
        assert_eq!(duration(3720.0), "1 h 02 min");
    }
}
