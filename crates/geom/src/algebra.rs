//! Vectors and matrices of any dimension.

/// A point, displacement or velocity in `D` dimensions.
pub type Vector<const D: usize> = nalgebra::SVector<f64, D>;

/// A second-order tensor in `D` dimensions.
pub type Matrix<const D: usize> = nalgebra::SMatrix<f64, D, D>;
