//! Checkpoints: everything a run needs to go on, bit for bit, as if it had never stopped.
//!
//! Rows of output are not in it, but how far their files had come ([`CsvMarks`]).
//!
//! A file is 8 bytes that say what it is, a version (u32, little-endian), the blake3 digest of the rest, and
//! the rest: a [`Checkpoint`] in postcard encoding, compressed by zlib. It carries the case, so that it
//! cannot be taken for one of another case.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::read::{ZlibDecoder, ZlibEncoder};
use gluey_geom::{Dim, Space};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::case::Case;
use crate::hydrodynamics::HydrodynamicsError;
use crate::output::csv::CsvMarks;
use crate::output::{Mark, OutputError, write_atomically};
use crate::phases::PhaseTable;
use crate::simulation::{RestoreError, SimulationState};

const MAGIC: &[u8; 8] = b"gluey-ck";
/// Counts changes of the layout of [`Checkpoint`].
const VERSION: u32 = 13;
const DIGEST_LENGTH: usize = 32;
const HEADER_LENGTH: usize = MAGIC.len() + 4 + DIGEST_LENGTH;
/// Fast: fields of 64-bit numbers hardly get smaller at higher levels.
const COMPRESSION_LEVEL: u32 = 1;

/// A run between two steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Checkpoint<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Particles, history, contact memory, warm start of the flow.
    pub state: SimulationState<D>,
    /// How far the files of rows had come.
    pub output: CsvMarks,
    /// How far that of the rheology had come, where there is one.
    pub rheology: Option<Mark>,
    /// How far that of what holds particles had come, where there is one.
    pub forces: Option<Mark>,
    /// How far that of the solver had come.
    pub solver: Mark,
    /// Wall time so far, phase by phase.
    pub phases: PhaseTable,
    /// Wall time so far, in seconds.
    pub wall_s: f64,
}

/// A checkpoint could not be used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// It could not be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
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
    /// The simulation cannot go on from it.
    #[error("{}: does not fit the case", path.display())]
    Unfit {
        /// The file.
        path: PathBuf,
        /// Why.
        source: RestoreError<HydrodynamicsError>,
    },
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

impl<const D: usize> Checkpoint<D>
where
    Dim<D>: Space<D>,
{
    /// Writes the checkpoint of a run of `case`, all or nothing.
    pub fn write(&self, case: &Case, path: &Path) -> Result<(), OutputError> {
        let encode = || -> io::Result<Vec<u8>> {
            let run = postcard::to_stdvec(self).map_err(io::Error::other)?;
            let gluey = env!("CARGO_PKG_VERSION").to_owned();
            let payload = Payload { gluey, case: canonical(case).map_err(io::Error::other)?, run };
            let bytes = postcard::to_stdvec(&payload).map_err(io::Error::other)?;
            let mut body = Vec::new();
            ZlibEncoder::new(bytes.as_slice(), Compression::new(COMPRESSION_LEVEL)).read_to_end(&mut body)?;
            Ok(body)
        };
        let body = encode().map_err(|error| OutputError::new(path, "encode the checkpoint", error))?;
        let mut file = MAGIC.to_vec();
        file.extend(VERSION.to_le_bytes());
        file.extend(blake3::hash(&body).as_bytes());
        file.extend(body);
        write_atomically(path, &file)
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
    let path = path.to_owned();
    let bytes = match fs::read(&path) {
        Ok(bytes) => bytes,
        Err(source) => return Err(CheckpointError::Read { path, source }),
    };
    let Some((header, body)) = bytes.split_at_checked(HEADER_LENGTH) else {
        return Err(if is_start(&bytes[..bytes.len().min(MAGIC.len())]) {
            CheckpointError::Damaged { path }
        } else {
            CheckpointError::Foreign { path }
        });
    };
    let (magic, rest) = header.split_at(MAGIC.len());
    let (version, digest) = rest.split_at(4);
    if magic != MAGIC {
        return Err(CheckpointError::Foreign { path });
    }
    let found = version.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte));
    if found != VERSION {
        return Err(CheckpointError::Version { path, found });
    }
    if blake3::hash(body).as_bytes() != digest {
        return Err(CheckpointError::Damaged { path });
    }
    let payload: Option<Payload> = inflated(body).and_then(|bytes| postcard::from_bytes(&bytes).ok());
    payload.ok_or(CheckpointError::Damaged { path })
}

/// Whether a checkpoint may begin so.
fn is_start(bytes: &[u8]) -> bool {
    MAGIC.starts_with(bytes) && !bytes.is_empty()
}

/// What a checkpoint says of itself.
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
}

impl CheckpointSummary {
    /// Whether a file begins like a checkpoint, as far as it goes: it may be cut short.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn is_announced_by(path: &Path) -> io::Result<bool> {
        let mut start = Vec::new();
        fs::File::open(path)?.take(MAGIC.len() as u64).read_to_end(&mut start)?;
        Ok(is_start(&start))
    }

    /// Reads what stands in a checkpoint, whatever its case is.
    ///
    /// # Errors
    /// [`CheckpointError`] if no run could go on from it.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let payload = payload(path)?;
        let damaged = || CheckpointError::Damaged { path: path.to_owned() };
        let case: Case = toml::from_str(&payload.case).map_err(|_| damaged())?;
        let (step, wall_s) = match case.dimension {
            2 => progress::<2>(&payload.run),
            _ => progress::<3>(&payload.run),
        }
        .ok_or_else(damaged)?;
        Ok(Self { layout: VERSION, gluey: payload.gluey, case, step, wall_s })
    }
}

/// Steps done and seconds spent.
fn progress<const D: usize>(run: &[u8]) -> Option<(usize, f64)>
where
    Dim<D>: Space<D>,
{
    let checkpoint: Checkpoint<D> = postcard::from_bytes(run).ok()?;
    Some((checkpoint.state.step, checkpoint.wall_s))
}

/// Bytes before compression; `None` if `body` is not compressed.
fn inflated(body: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    ZlibDecoder::new(body).read_to_end(&mut bytes).ok()?;
    Some(bytes)
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
