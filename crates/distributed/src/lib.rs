//! Stokes flow around rigid bodies in a box whose cells are shared by ranks.
//!
//! `-div(2 eta eps(u)) + grad p = 0`, `div u = 0`, `u = g` on the walls, rigid motions under given forces and
//! torques in the bodies: the solver of `gluey-stokes` on the part of a rank, with multigrid
//! on the same levels. A rank holds the cells of its run in the Morton order of the tree, with those around
//! them, on every level; no vector is longer than that, and no rank has the whole tree.
//!
//! ```
//! use gluey_distributed::{BoxFlow, equal_cuts};
//! use gluey_fem::ImplicitTree;
//! use gluey_geom::{Aabb, Vector};
//! use gluey_parallel::Threads;
//!
//! let wants = |_: &Vector<2>, _: f64, _: u8| true;
//! let speeds = Threads::run(3, |ranks| {
//!     let mut tree = ImplicitTree::new(Aabb::unit(), [1; 2], [true, false], 3, &wants).expect("a tree");
//!     let cuts = equal_cuts(&tree, ranks);
//!     let shear = |x: &Vector<2>| Vector::<2>::new(x[1], 0.0);
//!     let flow = BoxFlow { viscosity: 1.0, tolerance: 1e-10, max_iterations: 100 };
//!     let mine = flow.solve(&mut tree, &cuts, ranks, &shear).expect("a flow");
//!     // Between moving walls every node moves with its height.
//!     mine.points().iter().zip(mine.velocity()).all(|(x, u)| (u - shear(x)).norm() < 1e-8)
//! })?;
//! assert_eq!(speeds, [true; 3]);
//! # Ok::<(), gluey_parallel::RankFailure>(())
//! ```
//!
//! Contacts between particles are shared too ([`SharedContact`], `docs/design/ranks.md`).
//!
//! Surfaces that cut cells are those of the formulation `unfitted` on the part of each rank
//! (`docs/design/ranks.md`). Not for viscosities that vary.

mod contact;
mod cuts;
mod flow;
mod memory;
mod moving;
mod surface;
mod warm_start;

pub use contact::{ContactLoad, SharedContact};
pub use cuts::{cuts_of_work, equal_cuts, weighted_cuts};
pub use flow::{BoxFlow, LocalFlow};
pub use gluey_stokes::part::LevelSizes;
pub use memory::FlowMemory;
pub use moving::{SharedHydrodynamics, SharedSuspension, SuspensionError};
pub use surface::SurfaceBodies;
pub use warm_start::{PieceError, SavedPiece};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
