//! The handle by which a program knows its rank.

use std::fmt::Display;
use std::sync::{Arc, Mutex};

use crate::alone::Alone;
use crate::communicator::{Communicator, Message, Traffic};
use crate::failure::RankFailure;

/// A rank among those that share a computation; clones are the same rank.
#[derive(Clone)]
pub struct Ranks(Arc<dyn Communicator>);

impl Ranks {
    /// The rank that speaks by this communicator.
    pub fn new(communicator: impl Communicator + 'static) -> Self {
        Self(Arc::new(communicator))
    }

    /// A failure of one rank is one of all, who are told the first of them; a rank that failed in the same
    /// way keeps its own. All ranks call this.
    ///
    /// # Errors
    /// The failure of another rank.
    pub fn agreed<T, E: Display>(&self, outcome: Result<T, E>) -> Result<Result<T, E>, RankFailure> {
        let own = outcome.as_ref().err().map(ToString::to_string);
        match self.first_failure(own.clone()) {
            Some(first) if own.as_ref() != Some(&first.message) => Err(first),
            _ => Ok(outcome),
        }
    }

    /// The records of all ranks, in their order. All ranks call this.
    pub fn gathered<const N: usize>(&self, own: &[[u64; N]]) -> Vec<[u64; N]> {
        let counts = self.all_gather(&[own.len() as u64]);
        let most = counts.iter().copied().max().unwrap_or(0) as usize;
        if most == 0 {
            return Vec::new();
        }
        let mut padded = own.as_flattened().to_vec();
        padded.resize(most * N, 0);
        let all = self.all_gather(&padded);
        let of_rank =
            |(records, &count): (&[u64], &u64)| records.as_chunks::<N>().0[..count as usize].to_vec();
        all.chunks_exact(most * N).zip(&counts).flat_map(of_rank).collect()
    }

    /// The only rank of a program.
    pub fn alone() -> Self {
        Self::new(Alone::default())
    }
}

impl std::fmt::Debug for Ranks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "rank {} of {}", self.rank(), self.size())
    }
}

impl Communicator for Ranks {
    fn rank(&self) -> usize {
        self.0.rank()
    }

    fn size(&self) -> usize {
        self.0.size()
    }

    fn transfer(&self, send: &[Message], receive: &mut [Message]) {
        self.0.transfer(send, receive);
    }

    fn counter(&self) -> &Mutex<Traffic> {
        self.0.counter()
    }

    fn first_failure(&self, own: Option<String>) -> Option<RankFailure> {
        self.0.first_failure(own)
    }
}
