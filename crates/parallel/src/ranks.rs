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
