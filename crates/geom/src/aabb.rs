//! Axis-aligned boxes.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::Vector;

/// An axis-aligned box `[lower, upper]`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Aabb<const D: usize> {
    /// Corner with the smallest coordinates.
    pub lower: Vector<D>,
    /// Corner with the largest coordinates.
    pub upper: Vector<D>,
}

impl<const D: usize> Aabb<D> {
    /// The unit box `[0, 1]^D`.
    pub fn unit() -> Self {
        Self { lower: Vector::zeros(), upper: Vector::repeat(1.0) }
    }

    /// Edge lengths.
    pub fn extent(&self) -> Vector<D> {
        self.upper - self.lower
    }

    /// Centre of the box.
    pub fn center(&self) -> Vector<D> {
        (self.lower + self.upper) * 0.5
    }

    /// Whether `x` lies in the closed box.
    pub fn contains(&self, x: &Vector<D>) -> bool {
        (0..D).all(|d| self.lower[d] <= x[d] && x[d] <= self.upper[d])
    }

    /// Distance from `x` to the nearest face, positive inside.
    pub fn depth(&self, x: &Vector<D>) -> f64 {
        (0..D).map(|d| (x[d] - self.lower[d]).min(self.upper[d] - x[d])).fold(f64::INFINITY, f64::min)
    }
}
