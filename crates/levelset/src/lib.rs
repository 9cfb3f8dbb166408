//! Signed distances of rigid bodies and the laws that mix the properties of fluid and solid.
//!
//! The level set `alpha(x)` is positive inside a body and negative outside (Verdon et al. 2010, eq. 1). For a
//! ball `alpha_i(x) = a_i - |X_i - x|` (eq. 2), for several bodies `alpha = max_i alpha_i` (eq. 3).
//!
//! ```
//! use gluey_geom::Vector;
//! use gluey_levelset::{Ball, LevelSet, Ramp};
//! let disc = Ball::new(Vector::<2>::new(0.5, 0.5), 0.05);
//! assert!((disc.value(&Vector::<2>::new(0.5, 0.53)) - 0.02).abs() < 1e-15);
//! assert_eq!(Ramp::new(0.01).fraction(0.005), 0.5);
//! ```

mod ball;
mod mixing;
mod tree;

pub use ball::{Ball, Body, LevelSet, nearest, nearest_image};
pub use mixing::{Ramp, ViscosityLaw};
pub use tree::BallTree;

/// The examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
