//! Periods of a box, whose images may slide along each other.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::Vector;

/// The translations that repeat a box: along the axes that have a period, and, where the second axis has one,
/// with a tilt: the image one period up in `y` is `tilt` further along `x`.
///
/// A simple shear of rate `r` for ever is a tilt that grows by `r` times the period in `y` per unit of time
/// (Lees and Edwards 1972, 10.1088/0022-3719/5/15/006). Tilts that differ by the period in `x` are the same
/// lattice; only the names of the images differ.
///
/// ```
/// use gluey_geom::{Lattice, Vector};
/// let lattice = Lattice::<2>::new([Some(2.0), Some(1.0)]).tilted(0.5);
/// // Across the upper border: down by (0.5, 1).
/// let (arm, image) = lattice.nearest(&Vector::<2>::new(0.4, 0.9));
/// assert!((arm - Vector::<2>::new(-0.1, -0.1)).norm() < 1e-15);
/// assert_eq!(image, [0, -1]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Lattice<const D: usize> {
    #[cfg_attr(feature = "serde", serde(with = "stored_periods"))]
    periods: [Option<f64>; D],
    tilt: f64,
}

impl<const D: usize> Default for Lattice<D> {
    /// No period at all.
    fn default() -> Self {
        Self::new([None; D])
    }
}

impl<const D: usize> Lattice<D> {
    /// The lattice with the period of each axis, if it has one; positive lengths.
    pub fn new(periods: [Option<f64>; D]) -> Self {
        Self { periods, tilt: 0.0 }
    }

    /// The same with a tilt, a length; none unless both `x` and `y` have a period.
    #[must_use]
    pub fn tilted(self, tilt: f64) -> Self {
        let tilts = self.periods[0].is_some() && self.periods[1].is_some();
        Self { tilt: if tilts { tilt } else { 0.0 }, ..self }
    }

    /// Period along each axis, where there is one.
    pub fn periods(&self) -> &[Option<f64>; D] {
        &self.periods
    }

    /// Displacement along `x` of the image one period up in `y`.
    pub fn tilt(&self) -> f64 {
        self.tilt
    }

    /// Displacement along `x` per unit of `y`: the shear strain that makes this lattice of one without tilt.
    pub fn shear(&self) -> f64 {
        self.periods[1].map_or(0.0, |height| self.tilt / height)
    }

    /// The same lattice with a tilt of at most half the period in `x`.
    #[must_use]
    pub fn reduced(self) -> Self {
        Self { tilt: self.periods[0].map_or(0.0, |length| shortest(self.tilt, length).0), ..self }
    }

    /// By how many periods in `x` the tilt exceeds that of [`Lattice::reduced`], where the image `[i, j]` of
    /// this lattice has the name `[i + j turns, j]`.
    pub fn turns(&self) -> i32 {
        self.periods[0].map_or(0, |length| -shortest(self.tilt, length).1)
    }

    /// Whether any direction has a period.
    pub fn is_periodic(&self) -> bool {
        self.periods.iter().any(Option::is_some)
    }

    /// The displacement of an image, which counts periods along each axis.
    pub fn shift(&self, image: &[i32; D]) -> Vector<D> {
        let mut shift = Vector::from_fn(|d, _| self.periods[d].map_or(0.0, |p| f64::from(image[d]) * p));
        shift[0] += f64::from(image[1]) * self.tilt;
        shift
    }

    /// The image of a displacement within half a period of zero along each axis, and which one it is: the
    /// result is the displacement plus [`Lattice::shift`]. It is the shortest wherever that is shorter than
    /// half of every period.
    pub fn nearest(&self, arm: &Vector<D>) -> (Vector<D>, [i32; D]) {
        let (mut nearest, mut image) = (*arm, [0; D]);
        for d in (0..D).rev() {
            let Some(period) = self.periods[d] else { continue };
            let (short, count) = shortest(nearest[d], period);
            nearest[d] = short;
            image[d] = count;
            if d == 1 {
                nearest[0] += f64::from(count) * self.tilt;
            }
        }
        (nearest, image)
    }

    /// The place of a point in the box without tilt that shears into this one, with `y = origin` at rest.
    pub fn to_box(&self, x: &Vector<D>, origin: f64) -> Vector<D> {
        let mut place = *x;
        place[0] -= self.shear() * (x[1] - origin);
        place
    }

    /// The inverse of [`Lattice::to_box`].
    pub fn from_box(&self, place: &Vector<D>, origin: f64) -> Vector<D> {
        let mut x = *place;
        x[0] += self.shear() * (place[1] - origin);
        x
    }
}

/// The shortest image of a distance, and the number of periods to add for it.
fn shortest(distance: f64, period: f64) -> (f64, i32) {
    let count = -(distance / period).round();
    (distance + period * count, count as i32)
}

#[cfg(feature = "serde")]
mod stored_periods {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    pub fn serialize<S: Serializer, const D: usize>(
        periods: &[Option<f64>; D],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        periods.as_slice().serialize(serializer)
    }

    pub fn deserialize<'de, T: Deserializer<'de>, const D: usize>(
        deserializer: T,
    ) -> Result<[Option<f64>; D], T::Error> {
        let periods = Vec::<Option<f64>>::deserialize(deserializer)?;
        let count = periods.len();
        periods.try_into().map_err(|_| T::Error::invalid_length(count, &"one period per axis"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_is_a_translation_of_the_lattice_and_the_shortest() {
        let lattice = Lattice::<3>::new([Some(1.0), Some(1.5), None]).tilted(3.4);
        let arm = Vector::<3>::new(0.9, -2.9, 7.0);
        let (nearest, image) = lattice.nearest(&arm);
        assert!((nearest - arm - lattice.shift(&image)).norm() < 1e-14);
        assert!(nearest[0].abs() <= 0.5 && nearest[1].abs() <= 0.75 && nearest[2] == 7.0);
        let (same, _) = lattice.reduced().nearest(&arm);
        assert!((same - nearest).norm() < 1e-14 && lattice.reduced().tilt().abs() <= 0.5);
    }

    #[test]
    fn images_of_the_reduced_lattice_have_other_names() {
        for tilt in [3.4, -1.3, 0.2] {
            let lattice = Lattice::<2>::new([Some(1.0), Some(1.5)]).tilted(tilt);
            let shift = lattice.reduced().shift(&[2 - 3 * lattice.turns(), -3]);
            assert!((shift - lattice.shift(&[2, -3])).norm() < 1e-14, "{tilt}");
        }
    }

    #[test]
    fn the_box_shears_into_the_lattice() {
        let lattice = Lattice::<2>::new([Some(2.0), Some(0.5)]).tilted(0.3);
        let x = Vector::<2>::new(0.3, 0.8);
        assert!((lattice.from_box(&lattice.to_box(&x, 0.1), 0.1) - x).norm() < 1e-15);
        let up = lattice.to_box(&(x + lattice.shift(&[0, 1])), 0.1) - lattice.to_box(&x, 0.1);
        assert!((up - Vector::<2>::new(0.0, 0.5)).norm() < 1e-15);
        assert_eq!(Lattice::<2>::new([None, Some(1.0)]).tilted(0.3).tilt(), 0.0);
    }
}
