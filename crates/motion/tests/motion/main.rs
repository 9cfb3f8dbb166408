//! Integrators and mobilities beside exact trajectories and each other.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

mod examples;
mod integrator;
mod pair_mobility;
