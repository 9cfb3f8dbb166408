//! Independent jobs side by side; one that fails or panics does not disturb the others.
//!
//! The processor's cores are dealt out among the jobs: each runs in a pool of its own. Jobs that shared one
//! pool would wait for each other's pieces of work.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::anyhow;

/// Does every job, at most `workers` at a time and in the order given; the results stand in the order of the
/// jobs.
pub fn in_parallel<J: Sync, T: Send>(
    jobs: &[J],
    workers: usize,
    work: impl Fn(&J) -> anyhow::Result<T> + Sync,
) -> Vec<anyhow::Result<T>> {
    let workers = workers.clamp(1, jobs.len().max(1));
    let threads = (rayon::current_num_threads() / workers).max(1);
    let next = AtomicUsize::new(0);
    let worker = || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let done = |job: &J| match &pool {
            Ok(pool) => pool.install(|| work(job)),
            Err(error) => Err(anyhow!("could not start {threads} threads: {error}")),
        };
        let numbers = std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed));
        let own = numbers.map_while(|number| Some((number, jobs.get(number)?)));
        let result =
            |job: &J| catch_unwind(AssertUnwindSafe(|| done(job))).unwrap_or_else(|p| Err(panicked(&*p)));
        own.map(|(number, job)| (number, result(job))).collect::<Vec<_>>()
    };
    let mut results: Vec<_> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("jobs that panic are caught")).collect()
    });
    results.sort_by_key(|(number, _)| *number);
    results.into_iter().map(|(_, result)| result).collect()
}

fn panicked(panic: &(dyn Any + Send)) -> anyhow::Error {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    anyhow!("panicked: {}", text.unwrap_or("no message"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_and_panics_leave_the_other_jobs_alone() {
        let results = in_parallel(&[0, 1, 2, 3], 2, |&job| match job {
            1 => Err(anyhow!("it failed")),
            2 => panic!("job {job} broke"),
            _ => Ok(job * 10),
        });
        let results: Vec<_> = results.into_iter().map(|result| result.map_err(|e| e.to_string())).collect();
        let broken = Err("panicked: job 2 broke".to_owned());
        assert_eq!(results, [Ok(0), Err("it failed".to_owned()), broken, Ok(30)]);
    }

    #[test]
    fn no_more_jobs_run_at_once_than_there_are_workers() {
        let (running, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        in_parallel(&[(); 12], 3, |()| {
            most.fetch_max(running.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            std::thread::sleep(std::time::Duration::from_millis(5));
            running.fetch_sub(1, Ordering::SeqCst);
            Ok(())
        });
        assert!((1..=3).contains(&most.into_inner()));
    }
}
