//! Runs that are killed, asked to stop, gone on with, or on machines that fail: nothing is lost, and the end
//! has the same bits.

mod hardship;
mod killed;
#[path = "../support/program.rs"]
mod program;
mod resume;
mod signals;
#[cfg(unix)]
mod stopped;
