//! Q2-Q1 finite elements on a 2^D-tree mesh of a box, with hanging nodes.
//!
//! Every cell is a scaled copy of the unit cube, so an element matrix is a fixed matrix times a power of the
//! cell size: `K_c = eta_c h_c^(D-2) K` for `int 2 eta eps(u):eps(v)`, and the operators need no stored
//! Jacobians.
//!
//! ```
//! use gluey_fem::cells::{CellData, CellOperator, Workspace};
//! use gluey_fem::{Chunks, NodeMap, TreeMesh};
//! use gluey_geom::{Aabb, Vector};
//! use std::sync::Arc;
//!
//! // A rigid rotation has no strain: the viscous operator makes no force of it, hanging nodes or not.
//! let wants = |lower: &Vector<2>, h: f64, _| lower.norm() < 2.0 * h;
//! let mesh = TreeMesh::refine(Aabb::unit(), [1, 1], [false; 2], 5, wants)?;
//! let (velocity, pressure) = (NodeMap::new(&mesh, 2), NodeMap::new(&mesh, 1));
//! let uniform = |cell| CellData { cell, viscous: 1.0, divergence: 1.0, points: &[] };
//! let cells = (0..mesh.cell_count()).map(uniform);
//! let chunks = Arc::new(Chunks::new(&velocity, &pressure));
//! let operator = CellOperator::<f64, 2>::new(&chunks, &velocity, cells, 1, &[], 0);
//! let points = (0..velocity.node_count()).map(|node| velocity.point(node));
//! let rotation: Vec<f64> = points.flat_map(|x| [-x[1], x[0]]).collect();
//! let mut force = vec![f64::NAN; operator.velocity_dim()];
//! operator.viscous(&rotation, &mut force, &mut Workspace::default());
//! assert!(force.iter().all(|force| force.abs() < 1e-12));
//! # Ok::<(), gluey_fem::MeshError>(())
//! ```
//!
//! The rooms, lowest first; a room knows only those before it: meshes, [`element`] on the unit cube, spaces
//! of nodes, operators on [`cells`].
//!
//! Not for curved boundaries or unstructured meshes: the domain is a box, particles are immersed.

pub mod cells;
pub mod cut;
pub mod element;
mod mesh;
mod space;

pub use cells::{CHUNK_CELLS, Chunks};
pub use element::{ReferenceMatrices, add_viscous};
pub use mesh::{Cell, Cuts, ImplicitTree, MeshError, Part, TreeMesh, half_diagonal};
pub use space::{CellPoint, Constraint, Evaluator, Interpolation, NodeMap, points_of_cells};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
