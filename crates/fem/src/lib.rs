//! Q2-Q1 finite elements on a 2^D-tree mesh of a box, with hanging nodes.
//!
//! Every cell is a scaled copy of the unit cube, so an element matrix is a fixed matrix times a power of the
//! cell size: `K_c = eta_c h_c^(D-2) K` for `int 2 eta eps(u):eps(v)`, and the operators need no stored
//! Jacobians.
//!
//! ```
//! use gluey_fem::{NodeMap, TreeMesh};
//! use gluey_geom::Aabb;
//! let mesh = TreeMesh::<2>::uniform(Aabb::unit(), [1, 1], [false; 2], 3).unwrap();
//! let nodes = NodeMap::new(&mesh, 2);
//! assert_eq!((mesh.cell_count(), nodes.node_count()), (64, 17 * 17));
//! ```
//!
//! The rooms, lowest first; a room knows only those before it: meshes, [`element`] on the unit cube, spaces
//! of nodes, operators on [`cells`].
//!
//! Not for curved boundaries or unstructured meshes: the domain is a box, particles are immersed.

pub mod cells;
pub mod element;
mod mesh;
mod space;

pub use cells::{CHUNK_CELLS, Chunks};
pub use element::{ReferenceMatrices, add_viscous};
pub use mesh::{Cell, MeshError, TreeMesh};
pub use space::{Constraint, Evaluator, Interpolation, NodeMap};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
