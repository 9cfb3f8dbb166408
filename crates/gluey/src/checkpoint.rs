//! Checkpoints: everything a run needs to go on, bit for bit, as if it had never stopped.
//!
//! Rows of output are not in it, but how far their files had come ([`TableMarks`]).
//!
//! A file is a [`Checkpoint`] in postcard encoding, behind a digest. It carries the case, so that it cannot
//! be taken for one of another case. Where ranks share the flow, what the next one starts from is in files
//! of its own beside it, one for the cells of each rank ([`FlowPieces`]).

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::case::Case;
use crate::checksum::{FileKind, Unopened};
use crate::hydrodynamics::HydrodynamicsError;
use crate::output::{DraftMark, FileError, write_atomically};
use crate::phases::PhaseTable;
use crate::simulation::{RestoreError, SimulationState};
use crate::tally::Tally;

/// Counts changes of the layout of [`Checkpoint`].
const VERSION: u32 = 19;
const KIND: FileKind = FileKind { magic: b"gluey-ck", layout: VERSION };

/// A run between two steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Checkpoint<const D: usize> {
    /// Particles, history, contact memory, warm start of the flow.
    pub state: SimulationState<D>,
    /// How far the files of rows had come.
    pub tables: TableMarks,
    /// What was counted so far.
    pub tally: Tally,
    /// Wall time so far, phase by phase.
    pub phases: PhaseTable,
    /// Wall time so far, in seconds.
    pub wall_s: f64,
    /// Ranks that shared the flow, 0 where it was not to be shared.
    pub ranks: usize,
    /// The files with what the next flow starts from, where ranks share it.
    pub pieces: Option<FlowPieces>,
}

/// The places that the tables of a run had come to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TableMarks {
    /// The trajectory.
    pub trajectory: DraftMark,
    /// The near pairs, where they have a file.
    pub gaps: Option<DraftMark>,
    /// The rheology, where there is one.
    pub rheology: Option<DraftMark>,
    /// What holds particles, where there are such.
    pub forces: Option<DraftMark>,
    /// What steps cost.
    pub solver: DraftMark,
}

/// Files beside a checkpoint with what the next flow starts from, one for the cells of each rank that wrote
/// them: any number of ranks can go on from them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlowPieces {
    /// What their names begin with: the name of the checkpoint when it was written.
    pub stem: String,
    /// What tells them from those of other checkpoints.
    pub name: u64,
    /// How many there are.
    pub count: usize,
}

impl FlowPieces {
    /// The piece of a run of cells, from 0, of a checkpoint that is at `checkpoint` now.
    pub fn path(&self, checkpoint: &Path, run: usize) -> PathBuf {
        checkpoint.with_file_name(format!("{}.flow-{:016x}-{run:04}", self.stem, self.name))
    }
}

/// A checkpoint could not be used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// It could not be read.
    #[error(transparent)]
    Read(#[from] FileError),
    /// It is another kind of file.
    #[error("{}: not a gluey checkpoint", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// It was written by another version of the program.
    #[error("{}: layout {found} of a checkpoint; this program reads layout {VERSION}", path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Its layout.
        found: u32,
    },
    /// Its bytes are not those that were written.
    #[error("{}: damaged: it is cut short, or its digest does not match its contents", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
    },
    /// It belongs to another case.
    #[error("{}: a checkpoint of another case; {difference}", path.display())]
    OtherCase {
        /// The file.
        path: PathBuf,
        /// The first line in which the cases differ.
        difference: CaseDifference,
    },
    /// The case cannot be written down, to compare it.
    #[error("{}: cannot be compared with the case", path.display())]
    CaseText {
        /// The file.
        path: PathBuf,
        /// Why.
        source: toml::ser::Error,
    },
    /// A piece of its flow cannot be gone on with, here or on another rank.
    #[error("{message}: a piece of the flow of the checkpoint {}", path.display())]
    Piece {
        /// The checkpoint.
        path: PathBuf,
        /// The piece, and what is wrong with it.
        message: String,
    },
    /// The simulation cannot go on from it.
    #[error("{}: does not fit the case", path.display())]
    Unfit {
        /// The file.
        path: PathBuf,
        /// Why.
        source: RestoreError<HydrodynamicsError>,
    },
}

impl CheckpointError {
    /// For the file of a checkpoint, or a piece of its flow.
    pub(crate) fn unopened(path: &Path, why: Unopened) -> Self {
        let path = path.to_owned();
        match why {
            Unopened::Read(source) => FileError::unread(&path, source).into(),
            Unopened::Foreign => Self::Foreign { path },
            Unopened::Layout(found) => Self::Version { path, found },
            Unopened::Damaged => Self::Damaged { path },
        }
    }
}

/// The first line in which two cases differ.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("there it reads `{saved}`, here `{given}`")]
pub struct CaseDifference {
    /// The line of the checkpoint.
    pub saved: String,
    /// The line of the case that was to be resumed.
    pub given: String,
}

/// Content of the file: who wrote it, the case as text, then the run, decoded only if the case is the right
/// one.
#[derive(Serialize, Deserialize)]
struct Payload {
    gluey: String,
    case: String,
    run: Vec<u8>,
}

impl<const D: usize> Checkpoint<D> {
    /// Writes the checkpoint of a run of `case`, all or nothing.
    pub fn write(&self, case: &Case, path: &Path) -> Result<(), FileError> {
        let encode = || -> io::Result<Vec<u8>> {
            let run = postcard::to_stdvec(self).map_err(io::Error::other)?;
            let gluey = env!("CARGO_PKG_VERSION").to_owned();
            let payload = Payload { gluey, case: canonical(case).map_err(io::Error::other)?, run };
            KIND.sealed(&postcard::to_stdvec(&payload).map_err(io::Error::other)?)
        };
        let file = encode().map_err(|error| FileError::new(path, "encode the checkpoint", error))?;
        write_atomically(path, &file)
    }

    /// The same for a run on so many ranks. On others than those that wrote it numbers differ in their last
    /// digits: rows behind the checkpoint are computed anew.
    #[must_use]
    pub(crate) fn on(mut self, ranks: usize) -> Self {
        let is_last = self.ranks != ranks;
        let TableMarks { trajectory, gaps, rheology, forces, solver } = &mut self.tables;
        let marks = [Some(trajectory), gaps.as_mut(), rheology.as_mut(), forces.as_mut(), Some(solver)];
        marks.into_iter().flatten().for_each(|mark| mark.is_last = is_last);
        self
    }

    /// Reads a checkpoint of a run of `case`. The end of the run may differ: a run can be prolonged.
    pub fn read(case: &Case, path: &Path) -> Result<Self, CheckpointError> {
        let path = path.to_owned();
        let payload = payload(&path)?;
        let given = match canonical(case) {
            Ok(given) => given,
            Err(source) => return Err(CheckpointError::CaseText { path, source }),
        };
        if let Some(difference) = difference(&payload.case, &given) {
            return Err(CheckpointError::OtherCase { path, difference });
        }
        postcard::from_bytes(&payload.run).map_err(|_| CheckpointError::Damaged { path })
    }
}

/// What stands in the file, its case and run not yet decoded.
fn payload(path: &Path) -> Result<Payload, CheckpointError> {
    let bytes = KIND.opened(path).map_err(|why| CheckpointError::unopened(path, why))?;
    postcard::from_bytes(&bytes).map_err(|_| CheckpointError::Damaged { path: path.to_owned() })
}

/// The facts that a checkpoint tells of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckpointSummary {
    /// Layout of the file.
    pub layout: u32,
    /// Version of gluey that wrote it.
    pub gluey: String,
    /// The case, without its end.
    pub case: Case,
    /// Steps done.
    pub step: usize,
    /// Wall time so far, in seconds.
    pub wall_s: f64,
    /// Files with the flow that belong to it.
    pub pieces: Option<FlowPieces>,
}

impl CheckpointSummary {
    /// Whether a file begins like a checkpoint, as far as it goes: it may be cut short.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn is_announced_by(path: &Path) -> Result<bool, FileError> {
        let mut start = Vec::new();
        let mut read = || fs::File::open(path)?.take(KIND.magic.len() as u64).read_to_end(&mut start);
        read().map_err(|error| FileError::unread(path, error))?;
        Ok(KIND.begins(&start))
    }

    /// Reads what stands in a checkpoint, whatever its case is.
    ///
    /// # Errors
    /// [`CheckpointError`] if no run could go on from it.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let payload = payload(path)?;
        let damaged = || CheckpointError::Damaged { path: path.to_owned() };
        let case: Case = toml::from_str(&payload.case).map_err(|_| damaged())?;
        let (step, wall_s, pieces) = match case.dimension {
            2 => progress::<2>(&payload.run),
            _ => progress::<3>(&payload.run),
        }
        .ok_or_else(damaged)?;
        Ok(Self { layout: VERSION, gluey: payload.gluey, case, step, wall_s, pieces })
    }
}

/// Steps done, seconds spent, and pieces of the flow.
fn progress<const D: usize>(run: &[u8]) -> Option<(usize, f64, Option<FlowPieces>)> {
    let checkpoint: Checkpoint<D> = postcard::from_bytes(run).ok()?;
    Some((checkpoint.state.step, checkpoint.wall_s, checkpoint.pieces))
}

/// The case as text, without its end and its streams of frames, all defaults stated.
pub(crate) fn canonical(case: &Case) -> Result<String, toml::ser::Error> {
    let mut case = case.clone();
    case.output.clear();
    case.time.end = 0.0;
    case.to_toml()
}

/// The first line in which two cases as text differ.
pub(crate) fn difference(saved: &str, given: &str) -> Option<CaseDifference> {
    let line = |line: Option<&str>| line.unwrap_or("(nothing)").to_owned();
    let (mut a, mut b) = (saved.lines(), given.lines());
    loop {
        match (a.next(), b.next()) {
            (None, None) => return None,
            (x, y) if x == y => {}
            (x, y) => return Some(CaseDifference { saved: line(x), given: line(y) }),
        }
    }
}
