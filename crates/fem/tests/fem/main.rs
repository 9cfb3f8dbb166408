//! Meshes and their parts, points of pictures, and the example.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

mod examples;
mod meshes;
mod parts;
mod points;
