//! Poses, twists, wrenches and round particles.

use std::ops::{Add, Mul, Neg, Sub};

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::{Dim, Rotation, Spin, Vector};

/// Position of the centre and orientation of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Pose<const D: usize> {
    /// Centre.
    pub position: Vector<D>,
    /// Orientation relative to the body's own frame.
    pub orientation: Rotation<D>,
}

impl<const D: usize> Pose<D> {
    /// A body at `position` in its reference orientation.
    pub fn at(position: Vector<D>) -> Self {
        Self { position, orientation: Dim::<D>::identity() }
    }
}

/// Rigid-body velocity: that of the centre and the spin.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Twist<const D: usize> {
    /// Velocity of the centre.
    pub velocity: Vector<D>,
    /// Angular velocity.
    pub spin: Spin<D>,
}

impl<const D: usize> Default for Twist<D> {
    fn default() -> Self {
        Self { velocity: Vector::zeros(), spin: Dim::<D>::zero_spin() }
    }
}

impl<const D: usize> Twist<D> {
    /// Velocity `U + w x r` of the material point at `r` from the centre.
    pub fn velocity_at(&self, r: &Vector<D>) -> Vector<D> {
        self.velocity + Dim::<D>::cross_spin(&self.spin, r)
    }
}

/// Force on a body and torque about its centre. Forces are per unit of depth in 2D.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Wrench<const D: usize> {
    /// Force.
    pub force: Vector<D>,
    /// Torque about the centre; counter-clockwise in 2D.
    pub torque: Spin<D>,
}

impl<const D: usize> Default for Wrench<D> {
    fn default() -> Self {
        Self { force: Vector::zeros(), torque: Dim::<D>::zero_spin() }
    }
}

impl<const D: usize> Wrench<D> {
    /// Power `F.U + T.w` on a body that moves with `twist`.
    pub fn power(&self, twist: &Twist<D>) -> f64 {
        let [torque, spin] = [&self.torque, &twist.spin].map(Dim::<D>::spin_slice);
        self.force.dot(&twist.velocity) + torque.iter().zip(spin).map(|(t, w)| t * w).sum::<f64>()
    }
}

/// Sums, differences and multiples of a pair of a vector and a spin.
macro_rules! linear {
    ($type:ident { $vector:ident, $spin:ident }) => {
        impl<const D: usize> Neg for $type<D> {
            type Output = Self;

            fn neg(self) -> Self {
                Self { $vector: -self.$vector, $spin: -self.$spin }
            }
        }

        impl<const D: usize> Add for $type<D> {
            type Output = Self;

            fn add(self, other: Self) -> Self {
                Self { $vector: self.$vector + other.$vector, $spin: self.$spin + other.$spin }
            }
        }

        impl<const D: usize> Sub for $type<D> {
            type Output = Self;

            fn sub(self, other: Self) -> Self {
                Self { $vector: self.$vector - other.$vector, $spin: self.$spin - other.$spin }
            }
        }

        impl<const D: usize> Mul<f64> for $type<D> {
            type Output = Self;

            fn mul(self, factor: f64) -> Self {
                Self { $vector: self.$vector * factor, $spin: self.$spin * factor }
            }
        }
    };
}

linear!(Twist { velocity, spin });
linear!(Wrench { force, torque });

/// A rigid disc (2D) or sphere (3D).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct Particle<const D: usize> {
    /// Centre and orientation.
    pub pose: Pose<D>,
    /// Radius `a > 0`.
    pub radius: f64,
}

impl<const D: usize> Particle<D> {
    /// A particle of the given radius at `position`.
    pub fn new(position: Vector<D>, radius: f64) -> Self {
        Self { pose: Pose::at(position), radius }
    }

    /// Gap `D_ij = |X_i X_j| - (a_i + a_j)` to another particle (Verdon et al. 2010, eq. 14).
    pub fn gap(&self, other: &Self) -> f64 {
        (other.pose.position - self.pose.position).norm() - (self.radius + other.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twists_are_vectors() {
        let [a, b] = [1.0, -0.3].map(|x| Twist::<3> {
            velocity: Vector::<3>::new(x, 2.0 * x, 0.7),
            spin: Spin::<3>::new(0.1, x, -x),
        });
        assert_eq!(a * 2.0 - b, a + a + -b);
        assert_eq!(a + -a, Twist::default());
        assert_eq!(
            (a + b).velocity_at(&Vector::z()),
            a.velocity_at(&Vector::z()) + b.velocity_at(&Vector::z())
        );
    }

    /// A force at a point does the same work there as its wrench does on the body.
    #[test]
    fn wrenches_do_the_work_of_forces() {
        let (r, f) = (Vector::<3>::new(0.3, -0.2, 0.5), Vector::<3>::new(1.0, 0.4, -0.7));
        let twist =
            Twist::<3> { velocity: Vector::<3>::new(0.1, 2.0, 0.7), spin: Spin::<3>::new(0.1, 3.0, -0.4) };
        let wrench = Wrench::<3> { force: f, torque: Dim::<3>::moment(&r, &f) };
        assert!((wrench.power(&twist) - f.dot(&twist.velocity_at(&r))).abs() < 1e-14);
        assert_eq!(wrench * 2.0 - wrench, wrench);
    }
}
