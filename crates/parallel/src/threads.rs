//! Ranks as threads of one process, joined by channels.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};

use crate::communicator::{Communicator, Message, Traffic};
use crate::failure::RankFailure;
use crate::ranks::Ranks;

/// A rank that is a thread.
#[derive(Debug)]
pub struct Threads {
    rank: usize,
    /// To each rank.
    to: Vec<Sender<Vec<u8>>>,
    /// From each rank.
    from: Vec<Mutex<Receiver<Vec<u8>>>>,
    traffic: Mutex<Traffic>,
}

/// The reason why a rank ended that waited for another one, which ended before.
struct Lost {
    other: usize,
}

impl Threads {
    /// Runs `work` on `size` ranks, at least one, and returns what they return, in their order.
    ///
    /// # Errors
    /// If a rank panics. The others end as soon as they wait for it.
    pub fn run<R: Send>(size: usize, work: impl Fn(&Ranks) -> R + Sync) -> Result<Vec<R>, RankFailure> {
        let ended: Vec<_> = std::thread::scope(|scope| {
            let work = &work;
            let start = |ranks: Self| {
                let ranks = Ranks::new(ranks);
                scope.spawn(move || catch_unwind(AssertUnwindSafe(|| work(&ranks))))
            };
            let threads: Vec<_> = joined(size.max(1)).into_iter().map(start).collect();
            threads.into_iter().map(|thread| thread.join().and_then(|ended| ended)).collect()
        });
        let failure = |(rank, why): (usize, &Box<dyn Any + Send>)| match why.downcast_ref::<Lost>() {
            Some(Lost { other }) => (true, rank, format!("rank {other} ended before it")),
            None => (false, rank, said(why.as_ref())),
        };
        let failures = ended.iter().enumerate().filter_map(|(rank, end)| Some((rank, end.as_ref().err()?)));
        match failures.map(failure).min() {
            Some((_, rank, message)) => Err(RankFailure { rank, size: ended.len(), message }),
            None => Ok(ended.into_iter().filter_map(Result::ok).collect()),
        }
    }
}

/// Ranks with a channel between any two.
fn joined(size: usize) -> Vec<Threads> {
    let mut to: Vec<Vec<_>> = (0..size).map(|_| Vec::with_capacity(size)).collect();
    let mut from: Vec<Vec<_>> = (0..size).map(|_| Vec::with_capacity(size)).collect();
    for receiver in 0..size {
        for to in &mut to {
            let (sender, end) = channel();
            to.push(sender);
            from[receiver].push(Mutex::new(end));
        }
    }
    let ends = to.into_iter().zip(from).enumerate();
    ends.map(|(rank, (to, from))| Threads { rank, to, from, traffic: Mutex::default() }).collect()
}

/// The text of a panic.
fn said(why: &(dyn Any + Send)) -> String {
    let text = why.downcast_ref::<String>().map(String::as_str);
    text.or(why.downcast_ref::<&str>().copied()).unwrap_or("it ended without a text").to_owned()
}

impl Communicator for Threads {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.to.len()
    }

    fn transfer(&self, send: &[Message], receive: &mut [Message]) {
        // A panic without a message of its own: what failed is said by the rank that is lost.
        let lost = |other: usize| -> ! { resume_unwind(Box::new(Lost { other })) };
        for Message { rank, bytes } in send {
            self.to[*rank].send(bytes.clone()).unwrap_or_else(|_| lost(*rank));
        }
        for Message { rank, bytes } in receive {
            let from = self.from[*rank].lock().unwrap_or_else(PoisonError::into_inner);
            let sent = from.recv().unwrap_or_else(|_| lost(*rank));
            assert_eq!(sent.len(), bytes.len(), "rank {rank} sent a message of another length");
            *bytes = sent;
        }
    }

    fn counter(&self) -> &Mutex<Traffic> {
        &self.traffic
    }
}
