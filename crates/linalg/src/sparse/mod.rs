//! Sparse matrices: compressed rows, blocks of unknowns that are coupled alike, slices for products.

mod block_pattern;
mod matrix;
mod pattern;
mod sell;

pub use block_pattern::{BlockGroups, BlockPattern};
pub use matrix::SparseMatrix;
pub use pattern::{Pattern, SparseError};
pub use sell::SellMatrix;
