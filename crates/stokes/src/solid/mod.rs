//! The penalised solid: where it is, its stress, and its motion.

mod moments;
mod quadrature;
mod region;
mod stress;

pub use quadrature::PointMatrices;
pub use region::SolidRegion;
pub use stress::{Penalty, SolidOperator, SolidStress};
