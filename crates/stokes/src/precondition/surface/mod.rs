//! The preconditioner of cut cells, around the levels with eliminated bodies.

mod correction;
mod roots;
mod shared;
mod smoother;

pub use correction::SurfaceCorrection;
pub use shared::SharedVelocities;
pub use smoother::{AssembledSmoother, SurfaceSmoother};
