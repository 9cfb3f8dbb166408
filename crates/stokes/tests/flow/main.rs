//! Tests of the flow against exact answers: identities first, then analytic solutions and their orders, then
//! the reference data. One binary, since every binary would compile the solvers anew.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

mod closing;
mod errors;
mod exactness;
mod examples;
mod forces;
mod formulations;
mod laws;
mod mobility;
mod operators;
mod orders;
mod pairs;
mod penalised;
mod sheared;
mod single;
mod solvers;
mod support;
mod unfitted;
