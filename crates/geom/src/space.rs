//! Types and operations that depend on the dimension: spins, rotations and the cross product.

use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Neg, Sub};

use nalgebra::{UnitComplex, UnitQuaternion};
#[cfg(feature = "serde")]
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::Vector;

/// Angular velocity: one number in 2D (positive counter-clockwise), a vector in 3D. Unit: 1/time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spin<const D: usize>([f64; 3]);

/// Orientation: a unit complex number in 2D, a unit quaternion in 3D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<const D: usize>(Turn);

#[derive(Clone, Copy, Debug, PartialEq)]
enum Turn {
    Plane(UnitComplex<f64>),
    Space(UnitQuaternion<f64>),
}

/// The dimension `D`, 2 or 3, with the operations whose form depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dim<const D: usize>;

impl<const D: usize> Dim<D> {
    /// Number of rotational degrees of freedom: 1 in 2D, 3 in 3D.
    pub const ROT: usize = {
        assert!(D == 2 || D == 3, "space has two or three dimensions");
        D * (D - 1) / 2
    };
    /// Number of rigid-body degrees of freedom: 3 in 2D, 6 in 3D.
    pub const RIGID: usize = D + Self::ROT;

    /// The spin at rest.
    pub fn zero_spin() -> Spin<D> {
        Spin::default()
    }

    /// The reference orientation.
    pub fn identity() -> Rotation<D> {
        Rotation(match D {
            2 => Turn::Plane(UnitComplex::identity()),
            _ => Turn::Space(UnitQuaternion::identity()),
        })
    }

    /// Velocity `w x r` of a point at `r` from the axis.
    pub fn cross_spin(w: &Spin<D>, r: &Vector<D>) -> Vector<D> {
        let [x, y, z] = w.0;
        match D {
            2 => Vector::from_fn(|d, _| if d == 0 { -x * r[1] } else { x * r[0] }),
            _ => from_space(&Vector::<3>::new(x, y, z).cross(&in_space(r))),
        }
    }

    /// Moment `r x f` of a force `f` at `r`; the adjoint of [`Dim::cross_spin`]: `(w x r).f = w.(r x f)`.
    pub fn moment(r: &Vector<D>, f: &Vector<D>) -> Spin<D> {
        match D {
            2 => Spin([r[0] * f[1] - r[1] * f[0], 0.0, 0.0]),
            _ => Spin(in_space(r).cross(&in_space(f)).into()),
        }
    }

    /// Orientation after turning at the constant rate `w` (space frame) for the time `dt`.
    pub fn advance(q: &Rotation<D>, w: &Spin<D>, dt: f64) -> Rotation<D> {
        Rotation(match q.0 {
            Turn::Plane(q) => Turn::Plane(UnitComplex::new(w.0[0] * dt) * q),
            Turn::Space(q) => Turn::Space(UnitQuaternion::from_scaled_axis(Vector::<3>::from(w.0) * dt) * q),
        })
    }

    /// The vector `v` of the body frame, seen in the space frame.
    pub fn rotate(q: &Rotation<D>, v: &Vector<D>) -> Vector<D> {
        match q.0 {
            Turn::Plane(q) => {
                let turned = q * Vector::<2>::new(v[0], v[1]);
                Vector::from_fn(|d, _| turned[d])
            }
            Turn::Space(q) => from_space(&(q * in_space(v))),
        }
    }

    /// The spin as a slice of `ROT` numbers.
    pub fn spin_slice(w: &Spin<D>) -> &[f64] {
        &w.0[..Self::ROT]
    }
}

impl<const D: usize> Rotation<D> {
    /// Angle of the turn from one orientation to another, between 0 and pi.
    pub fn angle_to(&self, other: &Self) -> f64 {
        match (self.0, other.0) {
            (Turn::Plane(from), Turn::Plane(to)) => from.angle_to(&to).abs(),
            (Turn::Space(from), Turn::Space(to)) => from.angle_to(&to),
            _ => unreachable!("both are of one dimension"),
        }
    }
}

/// A vector of three coordinates as one of `D = 3`, and back.
fn in_space<const D: usize>(x: &Vector<D>) -> Vector<3> {
    Vector::<3>::from_fn(|d, _| x[d])
}

fn from_space<const D: usize>(x: &Vector<3>) -> Vector<D> {
    Vector::from_fn(|d, _| x[d])
}

impl<const D: usize> Spin<D> {
    /// Its size.
    pub fn norm(&self) -> f64 {
        Vector::<3>::from(self.0).norm()
    }
}

impl Spin<2> {
    /// A spin, positive counter-clockwise.
    pub fn new(spin: f64) -> Self {
        Self([spin, 0.0, 0.0])
    }
}

impl Spin<3> {
    /// A spin about an axis.
    pub fn new(x: f64, y: f64, z: f64) -> Self {
        Self([x, y, z])
    }
}

impl From<Vector<3>> for Spin<3> {
    fn from(spin: Vector<3>) -> Self {
        Self(spin.into())
    }
}

impl<const D: usize> Index<usize> for Spin<D> {
    type Output = f64;

    fn index(&self, k: usize) -> &f64 {
        &self.0[..Dim::<D>::ROT][k]
    }
}

impl<const D: usize> IndexMut<usize> for Spin<D> {
    fn index_mut(&mut self, k: usize) -> &mut f64 {
        &mut self.0[..Dim::<D>::ROT][k]
    }
}

impl<const D: usize> Add for Spin<D> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl<const D: usize> AddAssign for Spin<D> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const D: usize> Sub for Spin<D> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - other.0[k]))
    }
}

impl<const D: usize> Neg for Spin<D> {
    type Output = Self;

    fn neg(self) -> Self {
        Self(self.0.map(|number| -number))
    }
}

impl<const D: usize> Mul<f64> for Spin<D> {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|number| number * factor))
    }
}

#[cfg(feature = "serde")]
impl<const D: usize> Serialize for Spin<D> {
    /// As many numbers as there are.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match D {
            2 => [self.0[0]].serialize(serializer),
            _ => self.0.serialize(serializer),
        }
    }
}

#[cfg(feature = "serde")]
impl<'de, const D: usize> Deserialize<'de> for Spin<D> {
    fn deserialize<T: Deserializer<'de>>(deserializer: T) -> Result<Self, T::Error> {
        match D {
            2 => <[f64; 1]>::deserialize(deserializer).map(|[spin]| Self([spin, 0.0, 0.0])),
            _ => Deserialize::deserialize(deserializer).map(Self),
        }
    }
}

#[cfg(feature = "serde")]
impl<const D: usize> Serialize for Rotation<D> {
    /// As the complex number or the quaternion.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Turn::Plane(q) => q.serialize(serializer),
            Turn::Space(q) => q.serialize(serializer),
        }
    }
}

#[cfg(feature = "serde")]
impl<'de, const D: usize> Deserialize<'de> for Rotation<D> {
    fn deserialize<T: Deserializer<'de>>(deserializer: T) -> Result<Self, T::Error> {
        match D {
            2 => Deserialize::deserialize(deserializer).map(|q| Self(Turn::Plane(q))),
            _ => Deserialize::deserialize(deserializer).map(|q| Self(Turn::Space(q))),
        }
    }
}

/// Volume of a sphere, area of a disc: `4 pi a^3 / 3`, `pi a^2`.
pub fn ball_volume<const D: usize>(radius: f64) -> f64 {
    let unit = if D == 2 { std::f64::consts::PI } else { 4.0 / 3.0 * std::f64::consts::PI };
    unit * radius.powi(D as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cross_and_moment_are_adjoint<const D: usize>(spin: Spin<D>) {
        let r = Vector::<D>::from_fn(|i, _| 0.3 + 0.7 * i as f64);
        let f = Vector::<D>::from_fn(|i, _| 1.1 - 0.4 * (i * i) as f64);
        let power = Dim::<D>::cross_spin(&spin, &r).dot(&f);
        let moment = Dim::<D>::moment(&r, &f);
        let other: f64 =
            Dim::<D>::spin_slice(&spin).iter().zip(Dim::<D>::spin_slice(&moment)).map(|(a, b)| a * b).sum();
        assert!((power - other).abs() < 1e-14);
    }

    #[test]
    fn volumes_of_balls() {
        assert!((ball_volume::<2>(2.0) - 12.566_370_614_359_172).abs() < 1e-14);
        assert!((ball_volume::<3>(0.5) - std::f64::consts::FRAC_PI_6).abs() < 1e-15);
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
