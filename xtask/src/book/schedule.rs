//! Independent jobs side by side; one that fails or panics does not disturb the others.
//!
//! The processor's cores are dealt out among the jobs: each runs in a pool of its own. Jobs that shared one
//! pool would wait for each other's pieces of work.

use std::any::Any;
use std::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A job has no result.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum JobError<E: Error + 'static> {
    /// It failed.
    #[error(transparent)]
    Failed(E),
    /// It has no threads to run on.
    #[error("could not start {threads} threads: {reason}")]
    Threads {
        /// Threads that were asked for.
        threads: usize,
        /// Why there are none.
        reason: String,
    },
    /// It panicked with this message.
    #[error("panicked: {0}")]
    Panicked(String),
    /// Every worker was gone before its turn.
    #[error("was never started")]
    NeverStarted,
}

/// Outcome of a job; empty while it is not done.
type Slot<T, E> = Mutex<Option<Result<T, JobError<E>>>>;

/// Does every job, at most `workers` at a time and in the order given; the results stand in the order of the
/// jobs.
pub fn in_parallel<J: Sync, T: Send, E: Error + Send + 'static>(
    jobs: &[J],
    workers: usize,
    work: impl Fn(&J) -> Result<T, E> + Sync,
) -> Vec<Result<T, JobError<E>>> {
    let workers = workers.clamp(1, jobs.len().max(1));
    let threads = (rayon::current_num_threads() / workers).max(1);
    let next = AtomicUsize::new(0);
    let results: Vec<Slot<T, E>> = jobs.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                while let Some((job, slot)) = take(&next, jobs, &results) {
                    let result = catch_unwind(AssertUnwindSafe(|| match &pool {
                        Ok(pool) => pool.install(|| work(job)).map_err(JobError::Failed),
                        Err(error) => Err(JobError::Threads { threads, reason: error.to_string() }),
                    }));
                    *slot.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) =
                        Some(result.unwrap_or_else(|panic| Err(JobError::Panicked(message(&*panic)))));
                }
            });
        }
    });
    let finished =
        results.into_iter().map(|slot| slot.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()));
    finished.map(|result| result.unwrap_or(Err(JobError::NeverStarted))).collect()
}

fn take<'a, J, S>(next: &AtomicUsize, jobs: &'a [J], slots: &'a [S]) -> Option<(&'a J, &'a S)> {
    let index = next.fetch_add(1, Ordering::Relaxed);
    Some((jobs.get(index)?, slots.get(index)?))
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
}

#[cfg(test)]
mod tests {
    use std::fmt;

    use super::*;

    #[test]
    fn failures_and_panics_leave_the_other_jobs_alone() {
        let results = in_parallel(&[0, 1, 2, 3], 2, |&job| match job {
            1 => Err(fmt::Error),
            2 => panic!("job {job} broke"),
            _ => Ok(job * 10),
        });
        let broken = JobError::Panicked("job 2 broke".to_owned());
        assert_eq!(results, [Ok(0), Err(JobError::Failed(fmt::Error)), Err(broken), Ok(30)]);
    }

    #[test]
    fn no_more_jobs_run_at_once_than_there_are_workers() {
        let (running, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        in_parallel(&[(); 12], 3, |()| {
            most.fetch_max(running.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            std::thread::sleep(std::time::Duration::from_millis(5));
            running.fetch_sub(1, Ordering::SeqCst);
            Ok::<_, fmt::Error>(())
        });
        assert!((1..=3).contains(&most.into_inner()));
    }
}
