//! What tests measure against: exact Stokes flows, orders of convergence, reference data, random packings,
//! counters of allocations and CPU time, ranks that are told to fail, threads that compute by themselves, and
//! programs outside this workspace.
//!
//! ```
//! use gluey_testkit::{convergence_order, exact::{PolynomialFlow, StokesSolution}};
//! use gluey_geom::Vector;
//!
//! let flow = PolynomialFlow { viscosity: 1.0 };
//! assert_eq!(flow.velocity(&Vector::<2>::new(0.0, 0.3)), Vector::<2>::zeros());
//! assert!((convergence_order(&[0.1, 0.05], &[8e-3, 1e-3]) - 3.0).abs() < 1e-12);
//! ```
//!
//! A dev-dependency only: nothing here belongs in a program that users run.

pub mod allocation;
mod alone;
mod clock;
mod convergence;
pub mod exact;
pub mod failing;
pub mod packing;
pub mod reference;
mod stranger;

pub use alone::compute_alone;
pub use clock::cpu_seconds;
pub use convergence::{convergence_order, convergence_orders};
pub use stranger::Stranger;
