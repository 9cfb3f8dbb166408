//! Ranks that share a computation: alone, as threads of one process, or over MPI.
//!
//! [`Communicator`] is all that a distributed computation asks of those who run it. Implementations move
//! bytes; whatever adds numbers is written once on top of that ([`Communicator::sum`], [`Halo`]) in an
//! order that depends on the number of ranks alone. So the same program gives the same bits on every run,
//! and the same bits by [`Threads`] as by MPI.
//!
//! ```
//! use gluey_parallel::{Communicator, Threads};
//!
//! let sums = Threads::run(3, |ranks| {
//!     let mut sum = [1.0 + ranks.rank() as f64];
//!     ranks.sum(&mut sum);
//!     sum[0]
//! })?;
//! assert_eq!(sums, [6.0; 3]);
//! # Ok::<(), gluey_parallel::RankFailure>(())
//! ```
//!
//! A rank that dies ends all: threads unwind and [`Threads::run`] says which was the first; processes are
//! aborted. One that fails and lives brings its error to [`Communicator::first_failure`], which makes it that
//! of all.
//!
//! Not for tasks that move between ranks: who owns what is decided before.

mod alone;
mod communicator;
mod failure;
mod ghosts;
mod halo;
mod number;
#[cfg(feature = "mpi")]
mod processes;
mod ranks;
mod threads;

pub use alone::Alone;
pub use communicator::{Communicator, Message, Traffic};
pub use failure::RankFailure;
pub use ghosts::{GhostPlan, Wanted, route};
pub use halo::Halo;
pub use number::Number;
#[cfg(feature = "mpi")]
pub use processes::{Processes, StartError};
pub use ranks::Ranks;
pub use threads::Threads;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
