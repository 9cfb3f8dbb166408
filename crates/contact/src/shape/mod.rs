//! Contact between shapes that are not round, with rotation.
//!
//! A shape is a convex *core* (a point, a segment, a polytope) with a rounding radius `r` about it: all
//! points within `r` of the core. Closest points of the cores are parry's; the gap of a pair is their
//! distance less both radii, and is exact as long as the cores do not meet. Its rate of change is
//!
//! ```text
//! G V = n.(v_j + w_j x r_j) - n.(v_i + w_i x r_i) = n.(v_j - v_i) + (r_j x n).w_j - (r_i x n).w_i
//! ```
//!
//! with `n` from `i` to `j` and `r` from the centres to the points of contact. [`ShapeContact`] projects
//! twists on those whose gaps stay open, `M (v - v*) = G^T lambda`, with the same laws, memory and solvers as
//! [`crate::PairContact`]; shapes whose core is a point give the same velocities.
//!
//! ```
//! use gluey_contact::shape::{Capsule, ShapeContact};
//! use gluey_contact::{BodyStep, ContactModel, ContactParams};
//! use gluey_geom::{Pose, Twist, Vector};
//!
//! // Two bars, one across the end of the other.
//! let shapes = [[2.0, 0.0], [0.0, 2.0]].map(|half| Capsule::new(Vector::from(half), 0.5));
//! let mut contact = ShapeContact::new(ContactParams::default(), shapes.to_vec());
//! let poses = [Pose::at(Vector::<2>::zeros()), Pose::at(Vector::<2>::new(2.0, 3.05))];
//! let drift = [Twist::default(); 2];
//! let step = BodyStep { poses: &poses, radii: &[], drift: &drift, velocity_weight: 0.1, dt: 0.1 };
//! let mut twists = [Twist::default(), Twist { velocity: Vector::<2>::new(0.0, -1.0), ..Twist::default() }];
//! contact.correct_bodies(&step, &mut twists)?;
//! // The lower bar gives way and turns clockwise.
//! assert!(twists[0].velocity.y < 0.0 && twists[0].spin[0] < 0.0);
//! # Ok::<(), gluey_contact::ContactError>(())
//! ```

mod bodies;
mod capsule;
mod closest;
mod contact;
mod points;
mod problem;

use gluey_geom::{Dim, Pose, Twist, Vector};

pub use capsule::Capsule;
pub use closest::gap;
pub use contact::ShapeContact;

/// A convex core with a rounding, in the frame of the body: the origin is the centre of the shape.
pub trait Shape<const D: usize>: Sync {
    /// Radius of the rounding, `> 0`.
    fn rounding(&self) -> f64;

    /// Radius of a ball about the centre that holds the shape.
    fn reach(&self) -> f64;

    /// Radius of the sphere whose drag the shape is taken to feel: `M = a` for translation and `(4/3) a^3`
    /// for rotation, both over `6 pi eta` (Stokes 1851; force `6 pi eta a u`, torque `8 pi eta a^3 w`).
    fn drag_radius(&self) -> f64;

    /// The point of the core that is farthest in a direction.
    fn core_support(&self, direction: &Vector<D>) -> Vector<D>;

    /// `h` if the core is the segment from `-h` to `h`: its closest points are in closed form. For other
    /// cores they are iterated (GJK), to `5e-8` of the distance of the cores in the worst case; contact can
    /// be no more exact.
    fn half_axis(&self) -> Option<Vector<D>> {
        None
    }
}

/// Bodies of different kinds are `Box<dyn Shape<D>>`.
impl<const D: usize, S: Shape<D> + ?Sized> Shape<D> for Box<S> {
    fn rounding(&self) -> f64 {
        (**self).rounding()
    }

    fn reach(&self) -> f64 {
        (**self).reach()
    }

    fn drag_radius(&self) -> f64 {
        (**self).drag_radius()
    }

    fn core_support(&self, direction: &Vector<D>) -> Vector<D> {
        (**self).core_support(direction)
    }

    fn half_axis(&self) -> Option<Vector<D>> {
        (**self).half_axis()
    }
}

/// A body moved by a displacement and turned by a rotation vector, given as a twist times a time.
pub fn displaced<const D: usize>(pose: &Pose<D>, by: &Twist<D>) -> Pose<D> {
    let orientation = Dim::<D>::advance(&pose.orientation, &by.spin, 1.0);
    Pose { position: pose.position + by.velocity, orientation }
}
