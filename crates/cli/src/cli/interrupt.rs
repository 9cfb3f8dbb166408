//! Requests to stop.

use std::path::Path;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use gluey::{LastSteps, RunOptions};

use super::failure::{Failure, INTERRUPTED};
use crate::terminal::say;

/// Signals that come so soon after the first are the same request: `timeout`, shells and batch systems send
/// theirs to a process and to its group.
const ONE_REQUEST: Duration = Duration::from_secs(1);

/// Requests to the runs of a program: Ctrl-C, to terminate or to hang up.
#[derive(Clone, Debug)]
pub struct Requests {
    flag: Arc<AtomicBool>,
    last_steps: LastSteps,
}

impl Requests {
    /// Listens to them for a run of `case`. The first saves the last whole step, then lets the run end after
    /// the one it is at; the second ends the program at once.
    pub fn listen(case: &Path) -> Self {
        let case = case.to_owned();
        Self::listen_and(move |last_steps| {
            let (runs, notices) = last_steps.end();
            notices.iter().for_each(|notice| say(&notice.to_string()));
            for ended in runs {
                let failure = Failure::of_run(ended.into(), &case);
                say(&format!("{:?}", miette::Report::new(*failure.diagnostic)));
            }
            process::exit(i32::from(INTERRUPTED));
        })
    }

    /// The same for the runs of a study.
    pub fn listen_in_study() -> Self {
        Self::listen_and(|last_steps| {
            let (_, notices) = last_steps.end();
            notices.iter().for_each(|notice| say(&notice.to_string()));
            say("interrupted; the same command goes on");
            process::exit(i32::from(INTERRUPTED));
        })
    }

    /// The same where ranks share a run: no rank can save a step alone, so the one they are at is finished.
    #[cfg(feature = "mpi")]
    pub fn listen_on_ranks() -> Self {
        Self::listen_and(|_| say("the step has to be finished first: its checkpoint takes all ranks"))
    }

    fn listen_and(again: impl Fn(&LastSteps) + Send + 'static) -> Self {
        let requests = Self { flag: Arc::default(), last_steps: LastSteps::default() };
        let Self { flag, last_steps } = requests.clone();
        let mut first: Option<Instant> = None;
        let installed = ctrlc::set_handler(move || match first {
            None => {
                flag.store(true, Ordering::Relaxed);
                say("stopping after this step; once more to stop at once");
                last_steps.save().iter().for_each(|notice| say(&notice.to_string()));
                first = Some(Instant::now());
            }
            Some(first) if first.elapsed() < ONE_REQUEST => {}
            Some(_) => again(&last_steps),
        });
        if let Err(error) = installed {
            say(&format!("Ctrl-C will end the program without a checkpoint: {error}"));
        }
        requests
    }

    /// Whether there was one.
    pub fn is_there(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// The options of a run that heeds them.
    pub fn heeded_by(&self, options: RunOptions) -> RunOptions {
        let (interrupt, last_steps) = (Some(self.flag.clone()), Some(self.last_steps.clone()));
        RunOptions { interrupt, last_steps, ..options }
    }
}
