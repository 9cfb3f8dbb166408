//! Capsules: rods with round ends.

use std::f64::consts::PI;

use gluey_geom::Vector;

use super::Shape;

/// The points within `radius` of the segment from `-half_axis` to `half_axis`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule<const D: usize> {
    /// Half of the segment, in the frame of the body; zero for a disc or sphere.
    pub half_axis: Vector<D>,
    /// Radius.
    pub radius: f64,
}

impl<const D: usize> Capsule<D> {
    /// A capsule.
    pub fn new(half_axis: Vector<D>, radius: f64) -> Self {
        Self { half_axis, radius }
    }
}

impl<const D: usize> Shape<D> for Capsule<D> {
    fn rounding(&self) -> f64 {
        self.radius
    }

    fn reach(&self) -> f64 {
        self.half_axis.norm() + self.radius
    }

    /// The sphere (disc) of the same volume (area). That understates the drag of slender rods, on their
    /// rotation most.
    fn drag_radius(&self) -> f64 {
        let (h, a) = (self.half_axis.norm(), self.radius);
        if D == 2 { (a * (a + 4.0 * h / PI)).sqrt() } else { (a * a * (a + 1.5 * h)).cbrt() }
    }

    fn core_support(&self, direction: &Vector<D>) -> Vector<D> {
        if self.half_axis.dot(direction) < 0.0 { -self.half_axis } else { self.half_axis }
    }

    fn half_axis(&self) -> Option<Vector<D>> {
        Some(self.half_axis)
    }
}
