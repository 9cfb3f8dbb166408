//! What ranks say to each other.

use std::ops::Add;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::failure::RankFailure;
use crate::number::{read_all, write_all};

/// Bytes for a rank, or from it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Message {
    /// The other rank.
    pub rank: usize,
    /// What is sent; of what is received the length has to be right beforehand.
    pub bytes: Vec<u8>,
}

/// Counts of what one rank has sent, and of how often all waited for each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Messages sent, those of sums included.
    pub messages: u64,
    /// Bytes sent.
    pub bytes: u64,
    /// Exchanges with neighbours.
    pub exchanges: u64,
    /// Sums over all ranks.
    pub reductions: u64,
}

impl Traffic {
    /// What came after an earlier count.
    #[must_use]
    pub fn since(self, before: Self) -> Self {
        Self {
            messages: self.messages - before.messages,
            bytes: self.bytes - before.bytes,
            exchanges: self.exchanges - before.exchanges,
            reductions: self.reductions - before.reductions,
        }
    }
}

impl Add for Traffic {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            messages: self.messages + other.messages,
            bytes: self.bytes + other.bytes,
            exchanges: self.exchanges + other.exchanges,
            reductions: self.reductions + other.reductions,
        }
    }
}

/// A rank among those that share a computation.
///
/// All ranks call the same methods in the same order. An implementation provides the first four; whatever
/// adds numbers is built on them, in an order that depends on the number of ranks alone.
pub trait Communicator: Send + Sync {
    /// The number of this rank, from zero.
    fn rank(&self) -> usize;

    /// Number of ranks.
    fn size(&self) -> usize;

    /// Sends all of `send` and waits for all of `receive`. Messages from one rank to another arrive in the
    /// order in which they were sent. A rank that is lost ends the computation.
    fn transfer(&self, send: &[Message], receive: &mut [Message]);

    /// Where this rank counts what it sends.
    fn counter(&self) -> &Mutex<Traffic>;

    /// What this rank has sent so far.
    fn traffic(&self) -> Traffic {
        *locked(self.counter())
    }

    /// [`Communicator::transfer`] between neighbours, counted.
    fn exchange(&self, send: &[Message], receive: &mut [Message]) {
        count(self.counter(), |traffic| {
            traffic.exchanges += 1;
            add_messages(traffic, send);
        });
        self.transfer(send, receive);
    }

    /// Adds up `values`, entry by entry, over all ranks, for all of them: a binary tree over the ranks, each
    /// adding what comes from higher ones to its own.
    fn sum(&self, values: &mut [f64]) {
        self.reduce(values, &mut []);
    }

    /// Adds up `sums` like [`Communicator::sum`], and replaces `largest` by the largest of all ranks, in the
    /// same messages. What is not a number is largest.
    fn reduce(&self, sums: &mut [f64], largest: &mut [f64]) {
        count(self.counter(), |traffic| traffic.reductions += 1);
        let mut values = [&*sums, &*largest].concat();
        let length = size_of_val(&values[..]);
        for step in up_the_tree(self.rank(), self.size()) {
            match step {
                TreeStep::From(rank) => {
                    let bytes = receive(self, rank, length);
                    for (k, (value, other)) in values.iter_mut().zip(read_all::<f64>(&bytes)).enumerate() {
                        *value = if k < sums.len() { *value + other } else { larger(*value, other) };
                    }
                }
                TreeStep::To(rank) => {
                    let mut bytes = Vec::new();
                    write_all(&values, &mut bytes);
                    send(self, rank, bytes);
                }
            }
        }
        self.share(&mut values);
        let (of_sums, of_largest) = values.split_at(sums.len());
        sums.copy_from_slice(of_sums);
        largest.copy_from_slice(of_largest);
    }

    /// The failure of the first rank that has one, by its text, on all of them; nothing if none has.
    ///
    /// The one place where ranks agree on failures. What can fail on one of them is brought here before the
    /// next message: a rank that returned alone would leave the others waiting.
    fn first_failure(&self, own: Option<String>) -> Option<RankFailure> {
        let lengths = self.all_gather(&[own.as_ref().map_or(0, |text| 1 + text.len() as u64)]);
        let rank = lengths.iter().position(|&length| length > 0)?;
        let mut bytes = vec![0.0; lengths[rank] as usize - 1];
        if let Some(text) = own.filter(|_| rank == self.rank()) {
            bytes.iter_mut().zip(text.bytes()).for_each(|(number, byte)| *number = f64::from(byte));
        }
        self.sum(&mut bytes);
        let bytes: Vec<u8> = bytes.into_iter().map(|byte| byte as u8).collect();
        Some(RankFailure { rank, size: self.size(), message: String::from_utf8_lossy(&bytes).into_owned() })
    }

    /// Replaces `values`, of which all ranks have as many, by those of rank zero.
    fn share(&self, values: &mut [f64]) {
        let mut bytes = Vec::new();
        write_all(values, &mut bytes);
        broadcast(self, &mut bytes);
        values.iter_mut().zip(read_all(&bytes)).for_each(|(value, shared)| *value = shared);
    }

    /// The items of all ranks, of each as many, in the order of the ranks, for all of them.
    fn all_gather(&self, items: &[u64]) -> Vec<u64> {
        let (rank, size) = (self.rank(), self.size());
        let mut gathered = Vec::new();
        write_all(items, &mut gathered);
        let one = gathered.len();
        for step in up_the_tree(rank, size) {
            match step {
                TreeStep::From(from) => {
                    let ranks = (from - rank).min(size - from);
                    gathered.extend(receive(self, from, ranks * one));
                }
                TreeStep::To(to) => send(self, to, gathered.clone()),
            }
        }
        gathered.resize(size * one, 0);
        broadcast(self, &mut gathered);
        read_all(&gathered).collect()
    }
}

/// The larger of two numbers; one that is not a number is larger than all.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

/// A message of this rank in a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TreeStep {
    From(usize),
    To(usize),
}

/// What a rank does while numbers move to rank zero: it hears from the ranks at distances 1, 2, 4 above it,
/// then tells the one below.
fn up_the_tree(rank: usize, size: usize) -> impl DoubleEndedIterator<Item = TreeStep> {
    let steps = (0..usize::BITS).map(|bit| 1usize << bit).take_while(|&step| step < size.max(1));
    let steps: Vec<usize> = steps.collect();
    let told = steps.iter().position(|&step| rank & step != 0).map_or(steps.len(), |k| k + 1);
    steps
        .into_iter()
        .take(told)
        .filter_map(move |step| {
            let above = rank + step;
            if rank & step != 0 {
                Some(TreeStep::To(rank - step))
            } else {
                (above < size).then_some(TreeStep::From(above))
            }
        })
        .collect::<Vec<_>>()
        .into_iter()
}

/// The bytes of rank zero for all: down the tree.
fn broadcast(ranks: &(impl Communicator + ?Sized), bytes: &mut Vec<u8>) {
    for step in up_the_tree(ranks.rank(), ranks.size()).rev() {
        match step {
            TreeStep::From(rank) => send(ranks, rank, bytes.clone()),
            TreeStep::To(rank) => *bytes = receive(ranks, rank, bytes.len()),
        }
    }
}

fn send(ranks: &(impl Communicator + ?Sized), rank: usize, bytes: Vec<u8>) {
    let message = [Message { rank, bytes }];
    count(ranks.counter(), |traffic| add_messages(traffic, &message));
    ranks.transfer(&message, &mut []);
}

fn receive(ranks: &(impl Communicator + ?Sized), rank: usize, length: usize) -> Vec<u8> {
    let mut message = [Message { rank, bytes: vec![0; length] }];
    ranks.transfer(&[], &mut message);
    let [message] = message;
    message.bytes
}

fn count(counter: &Mutex<Traffic>, change: impl FnOnce(&mut Traffic)) {
    change(&mut locked(counter));
}

/// A counter is right whenever it can be read: nothing in between can panic.
fn locked(counter: &Mutex<Traffic>) -> MutexGuard<'_, Traffic> {
    counter.lock().unwrap_or_else(PoisonError::into_inner)
}

fn add_messages(traffic: &mut Traffic, messages: &[Message]) {
    traffic.messages += messages.len() as u64;
    traffic.bytes += messages.iter().map(|message| message.bytes.len() as u64).sum::<u64>();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rank_but_the_first_tells_one_lower_rank_that_listens() {
        for size in 1..=20 {
            for rank in 0..size {
                let told: Vec<_> =
                    up_the_tree(rank, size).filter(|step| matches!(step, TreeStep::To(_))).collect();
                assert_eq!(told.len(), usize::from(rank > 0));
                for step in told {
                    let TreeStep::To(below) = step else { continue };
                    assert!(up_the_tree(below, size).any(|step| step == TreeStep::From(rank)));
                }
                let heard = up_the_tree(rank, size).filter(|step| matches!(step, TreeStep::From(_)));
                assert!(heard.count() <= size.ilog2() as usize + 1);
            }
        }
    }
}
