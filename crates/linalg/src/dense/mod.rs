//! Small dense matrices.

mod cholesky;
mod sweep;

pub use cholesky::{BlockError, BlockJacobi, BlockJacobiError, invert_general, invert_spd};
pub use sweep::DenseSymmetric;
