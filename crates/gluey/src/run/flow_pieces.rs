//! What a flow that ranks share starts from after a checkpoint: each rank writes and reads its own files.

use std::path::Path;

use gluey_distributed::{FlowMemory, SavedPiece, SharedSuspension};
use gluey_parallel::{Communicator, Ranks};

use crate::case::Case;
use crate::checkpoint::{Checkpoint, CheckpointError, FlowPieces};
use crate::checksum::FileKind;
use crate::output::{FileError, write_atomically};

const KIND: FileKind = FileKind { magic: b"gluey-fp", layout: 1 };

/// Writes the pieces of a rank, which belong to a checkpoint with such a name, and says what all of them are;
/// nothing if there is none.
pub(super) fn write(
    checkpoint: &Path,
    name: u64,
    saved: &[SavedPiece],
) -> Result<Option<FlowPieces>, FileError> {
    let Some(first) = saved.first() else { return Ok(None) };
    let stem = checkpoint.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let pieces = FlowPieces { stem, name, count: first.run_count() };
    for piece in saved {
        let path = pieces.path(checkpoint, piece.run());
        let encoded = postcard::to_stdvec(piece).map_err(std::io::Error::other);
        let file = encoded.and_then(|bytes| KIND.sealed(&bytes));
        write_atomically(&path, &file.map_err(|error| FileError::new(&path, "encode the flow", error))?)?;
    }
    Ok(Some(pieces))
}

/// Puts what a checkpoint has of the flow into the memory of each rank. All ranks call this.
///
/// # Errors
/// On rank zero why it failed, wherever it did. On other ranks if it failed on any.
pub(super) fn restore<const D: usize>(
    case: &Case,
    checkpoint: &Path,
    suspension: &SharedSuspension<D>,
    ranks: &Ranks,
    memory: &FlowMemory<D>,
) -> Result<(), CheckpointError> {
    let read = || {
        let Some(pieces) = Checkpoint::<D>::read(case, checkpoint)?.pieces else { return Ok(()) };
        let saved = own_pieces(checkpoint, &pieces, ranks)?;
        let failed = |message| CheckpointError::Piece { path: checkpoint.to_owned(), message };
        memory.restore(&suspension.suspension, ranks, saved).map_err(|error| failed(error.to_string()))
    };
    agreed(checkpoint, ranks, read())
}

/// The pieces that a rank goes on from, or one that it learns from what all know.
fn own_pieces(
    checkpoint: &Path,
    pieces: &FlowPieces,
    ranks: &Ranks,
) -> Result<Vec<SavedPiece>, CheckpointError> {
    let (rank, size) = (ranks.rank(), ranks.size());
    let own: Vec<usize> =
        (0..pieces.count).filter(|&run| SavedPiece::holder(run, pieces.count, size) == rank).collect();
    let any = [rank * pieces.count / size];
    let runs = if own.is_empty() { &any[..] } else { &own };
    let read = |&run: &usize| {
        let path = pieces.path(checkpoint, run);
        let bytes = KIND.opened(&path).map_err(|why| CheckpointError::unopened(&path, why))?;
        postcard::from_bytes(&bytes).map_err(|_| CheckpointError::Damaged { path })
    };
    runs.iter().map(read).collect()
}

/// The failure of the first rank that has one, on all.
fn agreed(
    checkpoint: &Path,
    ranks: &Ranks,
    outcome: Result<(), CheckpointError>,
) -> Result<(), CheckpointError> {
    let text = outcome.as_ref().err().map(|error| {
        let cause = std::error::Error::source(error).map_or(String::new(), |cause| format!(": {cause}"));
        format!("{error}{cause}")
    });
    let Some(failure) = ranks.first_failure(text) else { return outcome };
    let message = format!("{}, on rank {}", failure.message, failure.rank);
    outcome.and(Err(CheckpointError::Piece { path: checkpoint.to_owned(), message }))
}
