//! Suspensions of discs and spheres: how they begin, how they are arranged, how well a mean is known.
//!
//! ```text
//! packing      random, equilibrium or lattice arrangements at a volume fraction, of one or many sizes
//! repulsion    forces that decay with the gap, images and walls included
//! structure    g(r), g(theta), S(k), contacts and clusters, gaps, fabric, diffusion, profiles
//! statistics   block averages with confidence intervals, transients
//! ```
//!
//! ```
//! use gluey_geom::Vector;
//! use gluey_suspension::packing::{Amount, Arrangement, Packing, PackingParams};
//! use gluey_suspension::structure::ProximityNetwork;
//! use gluey_suspension::Container;
//!
//! // 100 hard spheres at a volume fraction of 0.3.
//! let container = Container::<3>::periodic(&Vector::<3>::repeat(1.0));
//! let params = PackingParams {
//!     arrangement: Arrangement::Equilibrium { sweep_count: 100 },
//!     ..PackingParams::new(Amount::Count { fraction: 0.3, count: 100 })
//! };
//! let spheres = Packing::new(&container, &params)?;
//! assert!(spheres.smallest_gap(&container) >= 0.0);
//!
//! // Nearer than 0.2 radii each has 8 phi (1.1^3 - 1) g = 1.6 others, with Carnahan and Starling's g.
//! let reach = 0.2 * spheres.radii[0];
//! let network = ProximityNetwork::new(&container, &spheres.positions, &spheres.radii, reach);
//! let near = 2.0 * network.pair_count() as f64 / 100.0;
//! assert!((1.0..2.4).contains(&near));
//! # Ok::<(), gluey_suspension::packing::PackingError>(())
//! ```
//!
//! Everything is linear in the number of particles at a given range, takes periodic images that slide
//! ([`gluey_geom::Lattice`]) and gives the same bits on every run.
//!
//! Not for particles that are not round, nor for frozen or jammed arrangements.

mod container;
pub mod packing;
mod pairs;
mod repulsion;
pub mod statistics;
pub mod structure;

pub use container::Container;
pub use pairs::{NearPair, for_each_pair};
pub use repulsion::{Repelled, repelled};

/// The examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
