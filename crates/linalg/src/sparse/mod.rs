//! Sparse matrices: compressed rows, blocks of unknowns that are coupled alike, symmetric blocks with
//! Galerkin products, slices for products.

mod block_pattern;
mod matrix;
mod pattern;
mod prolongation;
mod sell;
mod symmetric_block;

pub use block_pattern::{BlockGroups, BlockPattern};
pub use matrix::SparseMatrix;
pub use pattern::{Pattern, SparseError};
pub use prolongation::Prolongation;
pub use sell::SellMatrix;
pub use symmetric_block::{LocalTerm, SymmetricBlockMatrix};
