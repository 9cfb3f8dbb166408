//! Cases whose flow and contact ranks share, here threads: what they write is what one process writes.

mod pieces;
#[path = "../support/runs.rs"]
mod runs;
mod tables;
