//! Krylov methods, smoothing and direct solvers: exact answers, bounds, and every way to fail.

mod chebyshev;
mod direct;
mod examples;
mod krylov;
#[path = "../support/mod.rs"]
mod support;
