//! Ranks of which one is told to fail.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use gluey_parallel::{Communicator, Message, RankFailure, Ranks, Traffic};

/// What the rank says that is told to fail.
pub const TOLD: &str = "this rank was told to fail";

/// A rank that may say, where ranks agree on failures for the `n`-th time, that it failed.
#[derive(Debug)]
pub struct Failing {
    ranks: Ranks,
    fails_at: Option<usize>,
    agreements: Arc<AtomicUsize>,
}

impl Failing {
    /// Fails at the agreement `at`, counted from 0, if it is the rank `rank`.
    pub fn new(ranks: &Ranks, rank: usize, at: usize) -> Self {
        let fails_at = Some(at).filter(|_| ranks.rank() == rank);
        Self { ranks: ranks.clone(), fails_at, agreements: Arc::default() }
    }

    /// How often ranks have agreed, as it counts.
    pub fn agreements(&self) -> Arc<AtomicUsize> {
        self.agreements.clone()
    }
}

impl Communicator for Failing {
    fn rank(&self) -> usize {
        self.ranks.rank()
    }

    fn size(&self) -> usize {
        self.ranks.size()
    }

    fn transfer(&self, send: &[Message], receive: &mut [Message]) {
        self.ranks.transfer(send, receive);
    }

    fn counter(&self) -> &Mutex<Traffic> {
        self.ranks.counter()
    }

    fn first_failure(&self, own: Option<String>) -> Option<RankFailure> {
        let now = self.agreements.fetch_add(1, Ordering::Relaxed);
        let told = || (self.fails_at == Some(now)).then(|| TOLD.to_owned());
        self.ranks.first_failure(own.or_else(told))
    }
}

/// What `work` returns.
///
/// # Panics
/// If it takes longer than a minute: somebody waits for ever.
pub fn within_a_minute<T: Send + 'static>(what: &str, work: impl FnOnce() -> T + Send + 'static) -> T {
    let (sender, ended) = channel();
    std::thread::spawn(move || sender.send(work()));
    let outcome = ended.recv_timeout(Duration::from_secs(60)).map_err(|error| match error {
        RecvTimeoutError::Timeout => format!("{what}: not done after a minute"),
        RecvTimeoutError::Disconnected => format!("{what}: it panicked"),
    });
    outcome.expect("work of all ranks ends")
}
