//! Small dense matrices.

mod cholesky;
mod eigen;
mod sweep;

pub use cholesky::{BlockError, invert_spd};
pub use eigen::{largest_ratio, lowest_modes};
pub use sweep::DenseSymmetric;
