//! The flow around particles that move, step after step, on ranks.
//!
//! Ranks share the flow, and contacts. What is small is not shared: where particles are, how they move, what
//! contacts remember. All ranks have it, and do the same work on it side by side.

mod hydrodynamics;
mod suspension;

pub use hydrodynamics::SharedHydrodynamics;
pub use suspension::{SharedSuspension, SuspensionError};
