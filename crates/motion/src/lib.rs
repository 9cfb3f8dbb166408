//! Time integration of rigid particles in a flow, `x^{n+1} = x^n + c u^n + drift`.
//!
//! [`Hydrodynamics`] says how the fluid moves the particles. The finite-element solver implements it, and so
//! do two analytic models that cost nothing: [`BackgroundFlow`] (particles follow a linear flow and do not
//! see each other) and [`PairMobility`] (two equal spheres in an unbounded linear flow, exact).
//! [`Integrator`] moves the particles by explicit Euler or Adams-Bashforth 2 and owns the velocity history.
//!
//! ```
//! use gluey_geom::{Particle, Vector};
//! use gluey_motion::{Configuration, Hydrodynamics, Integrator, LinearFlow, PairMobility, Scheme};
//!
//! let mut flow = PairMobility::new(LinearFlow::shear(1.0, 0.5));
//! let mut particles = [
//!     Particle::new(Vector::<3>::new(0.3, 0.525, 0.5), 0.05),
//!     Particle::new(Vector::<3>::new(0.7, 0.475, 0.5), 0.05),
//! ];
//! let mut integrator = Integrator::new(Scheme::AdamsBashforth2);
//! for n in 0..20 {
//!     let predicted = flow.predict(&Configuration::at(0.05 * n as f64, &particles))?;
//!     integrator.advance(0.05, &mut particles, &predicted.twists);
//! }
//! assert!((particles[0].pose.position.x - 0.325).abs() < 1e-3);
//! # Ok::<(), gluey_motion::PairMobilityError>(())
//! ```
//!
//! Not for inertia: velocities follow positions at once (Stokes flow), there is no mass and no acceleration.

mod approach;
mod error_estimate;
mod hydrodynamics;
mod integrator;
mod linear_flow;
mod mobility_table;
mod pair_mobility;

pub use approach::approach_mobility;
pub use error_estimate::ErrorEstimate;
/// Names of what [`Hydrodynamics::films`] and [`Hydrodynamics::near_mobility`] return.
pub use gluey_contact::{Film, LoneDrag, PairKey, TwistMobility};
pub use hydrodynamics::{
    Configuration, ContactLoads, Fields, FlowStatistics, Holding, Hydrodynamics, MeanStress, NextLoads,
    NoForces, Prediction, ResumeError,
};
pub use integrator::{Integrator, Scheme};
pub use linear_flow::{BackgroundFlow, LinearFlow};
pub use mobility_table::{MobilityTable, PairCoefficients};
pub use pair_mobility::{PairMobility, PairMobilityError};

/// The examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
