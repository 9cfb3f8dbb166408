//! What the examples share: ranks as threads or as processes, what they said to each other, and a hash of
//! results.

use gluey_parallel::{Communicator, Ranks, Threads, Traffic};
use serde::Serialize;

/// Latency of a message and bytes a second of a rank, of the model.
const LATENCY: f64 = 1e-6;
const BANDWIDTH: f64 = 12e9;

/// What `run` gives on rank zero, printed: on so many threads as each number says, or, without a number, on
/// the processes of `mpirun`.
pub fn on_ranks(numbers: &[usize], run: impl Fn(&Ranks) -> String + Sync) {
    if numbers.is_empty() {
        return on_processes(run);
    }
    for &size in numbers {
        match Threads::run(size, |ranks| run(ranks)) {
            Ok(lines) => println!("{}", lines[0]),
            Err(failure) => fail(&failure.to_string()),
        }
    }
}

#[cfg(feature = "mpi")]
fn on_processes(run: impl Fn(&Ranks) -> String) {
    let ended = gluey_parallel::Processes::run(|ranks| {
        let line = run(ranks);
        if ranks.rank() == 0 {
            println!("{line}");
        }
    });
    ended.unwrap_or_else(|error| fail(&error.to_string()));
}

#[cfg(not(feature = "mpi"))]
fn on_processes(_: impl Fn(&Ranks) -> String) {
    fail("--ranks is needed: this program was built without the feature mpi");
}

pub fn fail(why: &str) -> ! {
    eprintln!("error: {why}");
    std::process::exit(1);
}

/// A number of each rank: the mean and the largest.
#[derive(Serialize)]
pub struct Spread {
    mean: f64,
    largest: u64,
}

impl Spread {
    pub fn new(ranks: &Ranks, own: u64) -> Self {
        let all = ranks.all_gather(&[own]);
        let largest = all.iter().copied().max().unwrap_or(0);
        Self { mean: all.iter().sum::<u64>() as f64 / all.len() as f64, largest }
    }
}

/// What ranks said to each other.
#[derive(Serialize)]
pub struct TrafficRecord {
    messages: Spread,
    bytes: Spread,
    exchanges: u64,
    reductions: u64,
}

impl TrafficRecord {
    pub fn new(ranks: &Ranks, own: &Traffic) -> Self {
        Self {
            messages: Spread::new(ranks, own.messages),
            bytes: Spread::new(ranks, own.bytes),
            exchanges: own.exchanges,
            reductions: own.reductions,
        }
    }

    /// Latency of all messages of the rank that sends most, its bytes, and the hops of all sums over `ranks`:
    /// as if nothing overlapped.
    pub fn modelled_seconds(&self, ranks: usize) -> f64 {
        let hops = 2.0 * (ranks as f64).log2().ceil() * self.reductions as f64;
        LATENCY * (self.messages.largest as f64 + hops) + self.bytes.largest as f64 / BANDWIDTH
    }
}

/// A hash of the bits of numbers (Fowler, Noll and Vo's, byte by byte).
pub fn hash(bits: impl Iterator<Item = u64>) -> u64 {
    let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    bits.flat_map(u64::to_le_bytes).fold(0xcbf2_9ce4_8422_2325, mix)
}
