//! Ranks as processes, joined by MPI.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::thread::ThreadId;

use mpi::Threading;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator as _, Destination, Source};

use crate::communicator::{Communicator, Message, Traffic};
use crate::ranks::Ranks;

/// A rank that is a process of `mpirun`.
pub struct Processes {
    world: SimpleCommunicator,
    /// The only one that calls MPI.
    thread: ThreadId,
    traffic: Mutex<Traffic>,
}

// SAFETY: the communicator is the handle of all processes, a constant of the library, and MPI is called by
// the thread that started it alone: `transfer` refuses any other.
unsafe impl Send for Processes {}
// SAFETY: as above.
unsafe impl Sync for Processes {}

/// MPI cannot be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartError;

impl std::fmt::Display for StartError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("MPI has been started in this process before; it starts once, by `Processes::run`")
    }
}

impl std::error::Error for StartError {}

impl Processes {
    /// Starts MPI, runs `work` and ends MPI. All messages come from the calling thread. If `work` panics, all
    /// processes are aborted: nobody waits for ever.
    ///
    /// # Errors
    /// If MPI has been started before.
    pub fn run<R>(work: impl FnOnce(&Ranks) -> R) -> Result<R, StartError> {
        let (universe, _) = mpi::initialize_with_threading(Threading::Funneled).ok_or(StartError)?;
        let (world, thread) = (universe.world(), std::thread::current().id());
        let ranks = Ranks::new(Self { world, thread, traffic: Mutex::default() });
        Ok(catch_unwind(AssertUnwindSafe(|| work(&ranks))).unwrap_or_else(|_| universe.world().abort(1)))
    }
}

impl Communicator for Processes {
    fn rank(&self) -> usize {
        self.world.rank() as usize
    }

    fn size(&self) -> usize {
        self.world.size() as usize
    }

    /// MPI aborts all processes by itself if a message fails.
    fn transfer(&self, send: &[Message], receive: &mut [Message]) {
        assert_eq!(std::thread::current().id(), self.thread, "MPI is called by the thread that started it");
        let process = |rank: usize| self.world.process_at_rank(rank as i32);
        mpi::request::scope(|scope| {
            let mut pending = Vec::with_capacity(send.len() + receive.len());
            for Message { rank, bytes } in receive.iter_mut() {
                pending.push(process(*rank).immediate_receive_into(scope, &mut bytes[..]));
            }
            let mut sent = Vec::with_capacity(send.len());
            for Message { rank, bytes } in send {
                sent.push(process(*rank).immediate_send(scope, &bytes[..]));
            }
            pending.into_iter().for_each(|request| request.wait_without_status());
            sent.into_iter().for_each(|request| request.wait_without_status());
        });
    }

    fn counter(&self) -> &Mutex<Traffic> {
        &self.traffic
    }
}
