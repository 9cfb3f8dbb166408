//! Flows around the true surfaces of bodies, the formulation `unfitted`, on cells that
//! ranks share.
//!
//! A rank sets the problem of one process up on its part of the finest mesh, which reaches far enough around
//! surfaces for all that follows from places alone: cut cells, aggregates, penalties, films, blocks of the
//! smoother. Only sums over cells go between ranks. Coarser levels are those of bodies whose nodes move with
//! them.

mod conditions;
mod context;
mod films;
mod solve;
mod space;
mod sums;
mod trial;
mod weak;

pub use context::{SharedTree, SurfaceBodies};

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failure here is a failing test")]
mod tests;
