//! The flow around particles that move, step after step, on ranks.
//!
//! Ranks share the flow, and contacts. What is small is not shared: where particles are, how they move, what
//! contacts remember. Rank zero leads: it knows when a flow is wanted and tells the others where the
//! particles are. The others follow, or do the same work on their particles beside it; what rank zero says
//! holds.

mod hydrodynamics;
mod step_input;
mod suspension;

pub use hydrodynamics::SharedHydrodynamics;
pub use suspension::{Follower, SharedSuspension, SuspensionError};
