//! Continuous Lagrange spaces on a mesh, and interpolation between those of two meshes.

mod evaluator;
mod interpolation;
mod nodes;

pub use evaluator::Evaluator;
pub use interpolation::Interpolation;
pub use nodes::{Constraint, NodeMap};
