//! Types and operations that depend on the dimension: spins, rotations and the cross product.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Neg, Sub};

use nalgebra::{SVector, UnitComplex, UnitQuaternion};

use crate::Vector;

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::Dim<2> {}
    impl Sealed for super::Dim<3> {}
}

/// Types that go into checkpoints: with the feature `serde`, those that can be serialised; all types without
/// it.
#[cfg(feature = "serde")]
pub trait Stored: serde::Serialize + serde::de::DeserializeOwned {}

#[cfg(feature = "serde")]
impl<T: serde::Serialize + serde::de::DeserializeOwned> Stored for T {}

/// Types that go into checkpoints: with the feature `serde`, those that can be serialised; all types without
/// it.
#[cfg(not(feature = "serde"))]
pub trait Stored {}

#[cfg(not(feature = "serde"))]
impl<T> Stored for T {}

/// Tag of the dimension `D`; `Dim<2>` and `Dim<3>` implement [`Space`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dim<const D: usize>;

/// Angular velocity: one number in 2D (positive counter-clockwise), a vector in 3D. Unit: 1/time.
pub type Spin<const D: usize> = <Dim<D> as Space<D>>::Spin;

/// Orientation: a unit complex number in 2D, a unit quaternion in 3D.
pub type Rotation<const D: usize> = <Dim<D> as Space<D>>::Rotation;

/// The operations whose form depends on the dimension.
pub trait Space<const D: usize>: sealed::Sealed + Copy + Debug + Default + Send + Sync + 'static {
    /// Number of rotational degrees of freedom: 1 in 2D, 3 in 3D.
    const ROT: usize;
    /// Number of rigid-body degrees of freedom: 3 in 2D, 6 in 3D.
    const RIGID: usize;
    /// Angular velocity.
    type Spin: Copy
        + Debug
        + PartialEq
        + Send
        + Sync
        + 'static
        + Stored
        + Add<Output = Self::Spin>
        + AddAssign
        + Sub<Output = Self::Spin>
        + Neg<Output = Self::Spin>
        + Mul<f64, Output = Self::Spin>
        + Index<usize, Output = f64>
        + IndexMut<usize>;
    /// Orientation of a body.
    type Rotation: Copy + Debug + PartialEq + Send + Sync + 'static + Stored;

    /// The spin at rest.
    fn zero_spin() -> Self::Spin;
    /// The reference orientation.
    fn identity() -> Self::Rotation;
    /// Velocity `w x r` of a point at `r` from the axis.
    fn cross_spin(w: &Self::Spin, r: &Vector<D>) -> Vector<D>;
    /// Moment `r x f` of a force `f` at `r`; the adjoint of [`Space::cross_spin`]: `(w x r).f = w.(r x f)`.
    fn moment(r: &Vector<D>, f: &Vector<D>) -> Self::Spin;
    /// Orientation after turning at the constant rate `w` (space frame) for the time `dt`.
    fn advance(q: &Self::Rotation, w: &Self::Spin, dt: f64) -> Self::Rotation;
    /// The vector `v` of the body frame, seen in the space frame.
    fn rotate(q: &Self::Rotation, v: &Vector<D>) -> Vector<D>;
    /// The spin as a slice of `ROT` numbers.
    fn spin_slice(w: &Self::Spin) -> &[f64];
}

impl Space<2> for Dim<2> {
    const ROT: usize = 1;
    const RIGID: usize = 3;
    type Spin = SVector<f64, 1>;
    type Rotation = UnitComplex<f64>;

    fn zero_spin() -> Self::Spin {
        SVector::zeros()
    }

    fn identity() -> Self::Rotation {
        UnitComplex::identity()
    }

    fn cross_spin(w: &Self::Spin, r: &Vector<2>) -> Vector<2> {
        Vector::<2>::new(-w[0] * r[1], w[0] * r[0])
    }

    fn moment(r: &Vector<2>, f: &Vector<2>) -> Self::Spin {
        SVector::<f64, 1>::new(r[0] * f[1] - r[1] * f[0])
    }

    fn advance(q: &Self::Rotation, w: &Self::Spin, dt: f64) -> Self::Rotation {
        UnitComplex::new(w[0] * dt) * q
    }

    fn rotate(q: &Self::Rotation, v: &Vector<2>) -> Vector<2> {
        q * v
    }

    fn spin_slice(w: &Self::Spin) -> &[f64] {
        w.as_slice()
    }
}

impl Space<3> for Dim<3> {
    const ROT: usize = 3;
    const RIGID: usize = 6;
    type Spin = SVector<f64, 3>;
    type Rotation = UnitQuaternion<f64>;

    fn zero_spin() -> Self::Spin {
        SVector::zeros()
    }

    fn identity() -> Self::Rotation {
        UnitQuaternion::identity()
    }

    fn cross_spin(w: &Self::Spin, r: &Vector<3>) -> Vector<3> {
        w.cross(r)
    }

    fn moment(r: &Vector<3>, f: &Vector<3>) -> Self::Spin {
        r.cross(f)
    }

    fn advance(q: &Self::Rotation, w: &Self::Spin, dt: f64) -> Self::Rotation {
        UnitQuaternion::from_scaled_axis(w * dt) * q
    }

    fn rotate(q: &Self::Rotation, v: &Vector<3>) -> Vector<3> {
        q * v
    }

    fn spin_slice(w: &Self::Spin) -> &[f64] {
        w.as_slice()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cross_and_moment_are_adjoint<const D: usize>(spin: Spin<D>)
    where
        Dim<D>: Space<D>,
    {
        let r = Vector::<D>::from_fn(|i, _| 0.3 + 0.7 * i as f64);
        let f = Vector::<D>::from_fn(|i, _| 1.1 - 0.4 * (i * i) as f64);
        let power = Dim::<D>::cross_spin(&spin, &r).dot(&f);
        let moment = Dim::<D>::moment(&r, &f);
        let other: f64 =
            Dim::<D>::spin_slice(&spin).iter().zip(Dim::<D>::spin_slice(&moment)).map(|(a, b)| a * b).sum();
        assert!((power - other).abs() < 1e-14);
    }

    #[test]
    fn moments_do_the_work_of_forces() {
        cross_and_moment_are_adjoint::<2>(Spin::<2>::new(-0.7));
        cross_and_moment_are_adjoint::<3>(Spin::<3>::new(-0.7, 0.2, 1.3));
    }

    #[test]
    fn advancing_turns_by_the_angle() {
        let q = Dim::<3>::advance(&Dim::<3>::identity(), &Spin::<3>::new(0.0, 0.0, 0.5), 2.0);
        let turned = Dim::<3>::rotate(&q, &Vector::<3>::x());
        assert!((turned - Vector::<3>::new(1f64.cos(), 1f64.sin(), 0.0)).norm() < 1e-14);
        let q = Dim::<2>::advance(&Dim::<2>::identity(), &Spin::<2>::new(0.5), 2.0);
        let turned = Dim::<2>::rotate(&q, &Vector::<2>::x());
        assert!((turned - Vector::<2>::new(1f64.cos(), 1f64.sin())).norm() < 1e-14);
    }
}
