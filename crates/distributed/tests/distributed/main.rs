//! Flows and contacts that ranks share, in one binary: every binary would compile the solvers anew.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

mod contact;
mod failures;
mod flows;
mod pieces;
mod rigid;
mod serial;
mod sheared;
mod support;
mod surfaces;
mod trajectory;
