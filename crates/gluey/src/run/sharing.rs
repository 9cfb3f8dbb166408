//! The ranks that share a run. All of them do the same steps, rank zero writes; a failure of one is one of
//! all.

use std::io;
use std::path::{Path, PathBuf};

use gluey_parallel::{Communicator, RankFailure, Ranks};

use super::error::RunError;
use super::record::in_full;
use crate::checkpoint::FlowPieces;
use crate::output::FileError;

/// Writes what the next flow in the cells of a rank starts from, into files with a name for a checkpoint.
type KeepFlow<'a> = dyn Fn(&Path, u64) -> Result<Option<FlowPieces>, FileError> + 'a;

/// The ranks that share a run; one in most programs.
pub(super) struct RunRanks<'a> {
    pub ranks: Ranks,
    /// How the flow is kept where ranks share it.
    pub keep_flow: Option<&'a KeepFlow<'a>>,
}

impl RunRanks<'_> {
    /// A run of one process.
    pub fn alone() -> Self {
        Self { ranks: Ranks::alone(), keep_flow: None }
    }

    /// Whether this rank writes results.
    pub fn is_first(&self) -> bool {
        self.ranks.rank() == 0
    }

    /// Number of ranks that share the flow, 0 where it is not to be shared.
    pub fn rank_count(&self) -> usize {
        self.keep_flow.map_or(0, |_| self.ranks.size())
    }

    /// A failure of one rank is one of all, who tell that of the first; one that failed keeps its own.
    pub fn agreed<T, E: Told>(&self, own: Result<T, E>) -> Result<T, E> {
        let failure = self.ranks.first_failure(own.as_ref().err().map(Told::text));
        match (failure, own) {
            (Some(failure), Ok(_)) => Err(E::of(failure)),
            (_, own) => own,
        }
    }

    /// Whether any rank says so, of some questions.
    pub fn any<const N: usize>(&self, said: [bool; N]) -> [bool; N] {
        let mut numbers = said.map(|said| f64::from(u8::from(said)));
        self.ranks.reduce(&mut [], &mut numbers);
        numbers.map(|number| number > 0.0)
    }

    /// The number that rank zero has.
    pub fn of_first(&self, number: u64) -> u64 {
        let mut halves = [number >> 32, number & u64::from(u32::MAX)].map(|half| half as f64);
        self.ranks.share(&mut halves);
        let [high, low] = halves.map(|half| half as u64);
        high << 32 | low
    }
}

/// An error that other ranks are told.
pub(super) trait Told {
    /// Its text for them.
    fn text(&self) -> String;

    /// The error of another rank that told it.
    fn of(failure: RankFailure) -> Self;
}

/// As a text: the file, the number of the system's error, 0 for another one, and what it says, parted by
/// zeros, which no path has.
impl Told for FileError {
    fn text(&self) -> String {
        let number = self.source.raw_os_error().unwrap_or(0);
        format!("{}\0{number}\0{}", self.path.display(), self.source)
    }

    fn of(failure: RankFailure) -> Self {
        let words: Vec<&str> = failure.message.splitn(3, '\0').collect();
        let [path, number, reason] = words[..] else {
            return Self::new(Path::new(""), "go on with", io::Error::other(failure));
        };
        let kind = match number.parse() {
            Ok(number) if number > 0 => io::Error::from_raw_os_error(number).kind(),
            _ => io::ErrorKind::Other,
        };
        let source = io::Error::new(kind, format!("{reason}, on rank {}", failure.rank));
        Self::new(&PathBuf::from(path), "write the file", source)
    }
}

impl Told for RunError {
    fn text(&self) -> String {
        match self {
            Self::Output(error) => error.text(),
            error => in_full(error),
        }
    }

    fn of(failure: RankFailure) -> Self {
        match failure.message.contains('\0') {
            true => Self::Output(FileError::of(failure)),
            false => Self::Elsewhere(failure),
        }
    }
}
