//! Meshes of a box.

mod implicit;
mod part;
mod tree;

pub use implicit::ImplicitTree;
pub use part::{Cuts, Part};
pub(crate) use tree::{COORD_BITS, offsets};
pub use tree::{Cell, MeshError, TreeMesh, half_diagonal};
