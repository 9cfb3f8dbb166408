//! Meshes of a box.

mod tree;

pub(crate) use tree::{COORD_BITS, offsets};
pub use tree::{Cell, MeshError, TreeMesh, half_diagonal};
