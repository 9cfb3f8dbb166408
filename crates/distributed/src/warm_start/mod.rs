//! Initial guesses on ranks: the last two flows, which belong to another mesh with other owners, extrapolated
//! in time as in one process.
//!
//! Flows are kept in pieces, one for the run of each rank in the order of cells, right at the nodes of the
//! cells in it. Each rank asks for the values at the nodes of its new cells: the key of a point says which
//! run holds it. Motions of bodies are known to all ranks, as they are in a flow. What is kept of a film goes
//! to the owner of its first body, who has it for the rank that the film belongs to now.

mod films;
mod flows;
mod pieces;
mod points;
mod transfer;

pub use flows::KeptFlows;
pub use pieces::{PieceError, SavedPiece};
