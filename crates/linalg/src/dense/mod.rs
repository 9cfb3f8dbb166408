//! Small dense matrices.

mod cholesky;
mod sweep;

pub use cholesky::{BlockError, invert_spd};
pub use sweep::DenseSymmetric;
