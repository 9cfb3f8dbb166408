//! Time integration of rigid particles in a flow.
//!
//! [`Hydrodynamics`] says how the fluid moves the particles: the finite-element solver implements it, and so
//! do cheap analytic models.

mod hydrodynamics;

pub use hydrodynamics::{Fields, FlowStatistics, Hydrodynamics};
