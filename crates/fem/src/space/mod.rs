//! Continuous Lagrange spaces on a mesh, and interpolation between those of two meshes.

mod evaluator;
mod interpolation;
mod nodes;
mod points;

pub use evaluator::Evaluator;
pub use interpolation::Interpolation;
pub use nodes::{Constraint, NodeMap};
pub use points::{CellPoint, points_of_cells};
