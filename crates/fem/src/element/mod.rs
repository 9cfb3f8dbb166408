//! The Q2-Q1 element on the unit cube: shape functions, quadrature, element matrices.

mod lagrange;
mod matrices;
mod quadrature;

pub use lagrange::{derivatives_1d, gradient, multi_index, node_count, value, values_1d};
pub use matrices::{ReferenceMatrices, add_viscous};
pub use quadrature::{gauss, gauss_cube};
