//! What contact does, beside closed forms, other solvers and what was recorded.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

mod bad_input;
mod capsules;
mod cluster;
mod common;
mod crowds;
mod dense;
mod encounter;
mod examples;
mod film_images;
mod films;
mod network;
mod plane;
mod projection;
mod push_and_pull;
mod recorded;
mod sliding;
mod surroundings;
