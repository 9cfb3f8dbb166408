//! Vectors, rotations, poses, twists and wrenches in `D` = 2 and 3 dimensions.
//!
//! Code that is the same in every dimension is written once for `D`; what is not (the number of rotations,
//! the cross product, quaternions) stands behind [`Spin`], [`Rotation`] and the functions of [`Dim`]. For
//! another dimension the number of rotations, [`Dim::ROT`], does not compile.
//!
//! ```
//! use gluey_geom::{Twist, Vector, Spin};
//! let shear: Twist<2> = Twist { velocity: Vector::<2>::new(0.2, 0.0), spin: Spin::<2>::new(-0.5) };
//! let at_rim = shear.velocity_at(&Vector::<2>::new(0.0, 0.1));
//! assert!((at_rim.x - 0.25).abs() < 1e-15);
//! ```

mod aabb;
mod algebra;
mod lattice;
mod motion;
mod space;

pub use aabb::Aabb;
pub use algebra::{Matrix, Vector};
pub use lattice::Lattice;
pub use motion::{Particle, Pose, Twist, Wrench};
pub use space::{Dim, Rotation, Spin, ball_volume};

/// The examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
