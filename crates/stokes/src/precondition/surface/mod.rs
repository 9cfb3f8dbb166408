//! The preconditioner of cut cells, around the levels with eliminated bodies.

mod correction;
mod roots;
mod smoother;

pub use correction::SurfaceCorrection;
