//! What contact does, beside closed forms, other solvers and what was recorded.

mod bad_input;
mod capsules;
mod cluster;
mod common;
mod dense;
mod encounter;
mod examples;
mod network;
mod plane;
mod projection;
mod push_and_pull;
mod recorded;
mod sliding;
mod surroundings;
