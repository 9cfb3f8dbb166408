//! What ranks write in pieces, each those in its own cells: fields of frames, flows of checkpoints.
//!
//! Rank zero asks for a frame, the others write and say whether they could. Then it writes its own piece and
//! the file that names all of them. Pieces of a checkpoint are all there before it is.

use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use gluey_distributed::{Follower, FrameName, Memory, SavedPiece, ask_for_fields, ask_to_keep};
use gluey_geom::{Dim, Space};
use gluey_motion::Fields;
use gluey_parallel::{Communicator, RankFailure, Ranks};

use super::flow_pieces;
use super::frames::{Others, StreamOptions};
use crate::checkpoint::FlowPieces;
use crate::output::{FileError, vtk};

/// The ranks but zero, as rank zero sees them.
pub(super) struct OtherRanks<'a, const D: usize> {
    pub ranks: &'a Ranks,
    /// Of rank zero.
    pub memory: Rc<Memory<D>>,
}

impl<const D: usize> Others for OtherRanks<'_, D>
where
    Dim<D>: Space<D>,
{
    fn rank_count(&self) -> usize {
        self.ranks.size()
    }

    fn write_fields(&self, stream: usize, step: usize) -> Result<(), FileError> {
        ask_for_fields(self.ranks, FrameName { stream: stream as u32, step: step as u32 });
        first_failure(self.ranks, None)
    }

    fn write_flow(&self, checkpoint: &Path, name: u64) -> Result<Option<FlowPieces>, FileError> {
        if self.memory.is_broken() {
            let source = io::Error::other("the flow that ranks share was broken off");
            return Err(FileError::new(checkpoint, "keep the flow for", source));
        }
        ask_to_keep(self.ranks, name);
        let own = flow_pieces::write(checkpoint, name, &self.memory.saved());
        let all = first_failure(self.ranks, own.as_ref().err());
        let own = own?;
        all.map(|()| own)
    }
}

/// A rank other than zero, which writes what rank zero asks for and tells it what came of it.
pub(super) struct Follows<'a> {
    pub ranks: &'a Ranks,
    pub streams: Vec<StreamOptions>,
    pub checkpoint: Option<PathBuf>,
}

impl<const D: usize> Follower<D> for Follows<'_>
where
    Dim<D>: Space<D>,
{
    fn show(&mut self, frame: FrameName, fields: Option<Fields<D>>) {
        write_piece(self.ranks, &self.streams, frame, fields);
    }

    fn keep(&mut self, name: u64, pieces: Vec<SavedPiece>) {
        let checkpoint = self.checkpoint.as_deref().unwrap_or(Path::new(""));
        // What went wrong is told by rank zero.
        let _ = first_failure(self.ranks, flow_pieces::write(checkpoint, name, &pieces).err().as_ref());
    }
}

/// Writes the fields in the cells of a rank other than zero, which it tells what came of it.
fn write_piece<const D: usize>(
    ranks: &Ranks,
    streams: &[StreamOptions],
    frame: FrameName,
    fields: Option<Fields<D>>,
) {
    let FrameName { stream, step } = frame;
    let stream = streams.get(stream as usize);
    let asked = fields.zip(stream).and_then(|(fields, stream)| Some((fields, stream, stream.encoding()?)));
    let written = match asked {
        Some((fields, stream, encoding)) => {
            vtk::write_piece(&stream.folder, step as usize, ranks.rank(), &fields, encoding)
        }
        None => {
            let path = stream.map_or_else(PathBuf::new, |stream| stream.folder.clone());
            Err(FileError::new(&path, "write fields to", io::Error::other("there are none")))
        }
    };
    // What went wrong is told by rank zero.
    let _ = first_failure(ranks, written.err().as_ref());
}

/// The failure of the first rank that has one, on all ranks.
fn first_failure(ranks: &Ranks, own: Option<&FileError>) -> Result<(), FileError> {
    ranks.first_failure(own.map(encoded)).map_or(Ok(()), |failure| Err(decoded(&failure)))
}

/// The file, the number of the system's error, 0 for another one, and what it says: parted by zeros, which no
/// path has.
fn encoded(error: &FileError) -> String {
    let number = error.source.raw_os_error().unwrap_or(0);
    format!("{}\0{number}\0{}", error.path.display(), error.source)
}

fn decoded(failure: &RankFailure) -> FileError {
    let mut words = failure.message.splitn(3, '\0');
    let mut next = || words.next().unwrap_or_default();
    let (path, number, reason) = (PathBuf::from(next()), next(), next());
    let kind = match number.parse() {
        Ok(number) if number > 0 => io::Error::from_raw_os_error(number).kind(),
        _ => io::ErrorKind::Other,
    };
    let source = io::Error::new(kind, format!("{reason}, on rank {}", failure.rank));
    FileError::new(&path, "write the file", source)
}
