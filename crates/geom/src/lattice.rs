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

    /// The shortest image of a displacement, and which one it is: the result is the displacement plus
    /// [`Lattice::shift`]. Of images as short as each other it is the first of the nearest row of images in
    /// `y`, of that on the other side, of the next row.
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
        let (nearest, further) = self.nearest_of_rows(&nearest);
        (nearest, std::array::from_fn(|d| image[d] + further[d]))
    }

    /// The same for a displacement within half a period of zero along each axis: in a tilted lattice an image
    /// in another row may be shorter, since rows are elsewhere along `x`. A row is looked at where `y` alone
    /// is shorter than what was found.
    pub fn nearest_of_rows(&self, arm: &Vector<D>) -> (Vector<D>, [i32; D]) {
        let mut best = (*arm, [0; D]);
        let [Some(length), Some(height)] = [self.periods[0], self.periods[1]] else { return best };
        if self.tilt == 0.0 {
            return best;
        }
        let other_side = -1f64.copysign(arm[1]);
        for rows in 1..i32::MAX {
            for up in [other_side, -other_side].map(|side| side * f64::from(rows)) {
                let mut image = *arm;
                image[1] += up * height;
                let across = image.norm_squared() - image[0] * image[0];
                if across >= best.0.norm_squared() {
                    return best;
                }
                let (along, count) = shortest(image[0] + up * self.tilt, length);
                image[0] = along;
                if image.norm_squared() < best.0.norm_squared() {
                    let found =
                        std::array::from_fn(|d| if d == 0 { count } else { (up as i32) * i32::from(d == 1) });
                    best = (image, found);
                }
            }
        }
        best
    }

    /// Calls `visit(image, arm)` for all images of a displacement that are no longer than `farthest`, by
    /// their numbers along the last axis, then along those before.
    pub fn for_each_within(
        &self,
        arm: &Vector<D>,
        farthest: f64,
        mut visit: impl FnMut(&[i32; D], &Vector<D>),
    ) {
        let bounds = |d: usize, place: f64| match self.periods[d] {
            Some(period) => {
                let [from, to] = [-farthest, farthest].map(|end| (end - place) / period);
                [from.floor() as i32, to.ceil() as i32]
            }
            None => [0, 0],
        };
        // Those along x depend on the row.
        let ranges: [[i32; 2]; D] = std::array::from_fn(|d| if d == 0 { [0, 0] } else { bounds(d, arm[d]) });
        let mut image: [i32; D] = std::array::from_fn(|d| ranges[d][0]);
        loop {
            let [from, to] = bounds(0, arm[0] + f64::from(image[1]) * self.tilt);
            for along in from..=to {
                image[0] = along;
                let found = arm + self.shift(&image);
                if found.norm() <= farthest {
                    visit(&image, &found);
                }
            }
            let Some(d) = (1..D).find(|&d| image[d] < ranges[d][1]) else { return };
            image[d] += 1;
            (1..d).for_each(|lower| image[lower] = ranges[lower][0]);
        }
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

    /// Numbers from -1 to 1 that are not in order.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 12345_u64;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 10) as f64 / (1_u64 << 53) as f64 - 1.0
        }
    }

    /// Boxes from flat to high, tilts beyond the period and none at all, with and without a period in `z`.
    fn lattices<const D: usize>() -> Vec<(Lattice<D>, Vector<D>)> {
        let mut next = numbers();
        let lattice = |n: usize| {
            let edges: [f64; D] = std::array::from_fn(|d| if d == 1 { 1.0 } else { 8f64.powf(next()) });
            let periods = std::array::from_fn(|d| (d < 2 || !n.is_multiple_of(3)).then_some(edges[d]));
            let tilt = [0.0, 0.5 * edges[0], 0.5 * next() * edges[0], 3.0 * next() * edges[0]][n % 4];
            let arm = Vector::from_fn(|d, _| 2.0 * next() * edges[d]);
            (Lattice::new(periods).tilted(tilt), arm)
        };
        (0..200).map(lattice).collect()
    }

    /// All images of a displacement up to many periods away, by their numbers from the last axis on.
    fn all_images<const D: usize>(lattice: &Lattice<D>, arm: &Vector<D>) -> Vec<([i32; D], Vector<D>)> {
        let count = |d: usize| lattice.periods()[d].map_or(0, |_| [45, 12, 24][d]);
        let mut images = vec![[0; D]];
        for d in 0..D {
            let along = |k: i32| {
                images.iter().map(move |image| std::array::from_fn(|e| if e == d { k } else { image[e] }))
            };
            images = (-count(d)..=count(d)).flat_map(along).collect();
        }
        images.into_iter().map(|image| (image, arm + lattice.shift(&image))).collect()
    }

    fn nearest_is_the_shortest_of_all<const D: usize>() {
        for (lattice, arm) in lattices::<D>() {
            let (nearest, image) = lattice.nearest(&arm);
            assert!((nearest - arm - lattice.shift(&image)).norm() < 1e-13);
            let all = all_images(&lattice, &nearest);
            let shortest = all.iter().map(|(_, arm)| arm.norm()).fold(f64::INFINITY, f64::min);
            assert!(
                (nearest.norm() - shortest).abs() < 1e-13,
                "{lattice:?} {arm:?}: {nearest:?}, {shortest}"
            );
            let (back, _) = lattice.nearest(&-arm);
            assert!((back.norm() - shortest).abs() < 1e-13);
            let reduced = lattice.reduced();
            assert!(reduced.periods()[0].is_none_or(|p| reduced.tilt().abs() <= 0.5 * p), "{reduced:?}");
            assert!((reduced.nearest(&arm).0.norm() - shortest).abs() < 1e-13);
        }
    }

    #[test]
    fn nearest_is_a_translation_of_the_lattice_and_the_shortest() {
        nearest_is_the_shortest_of_all::<2>();
        nearest_is_the_shortest_of_all::<3>();
    }

    fn images_within_are_those_of_a_loop<const D: usize>() {
        for (n, (lattice, arm)) in lattices::<D>().into_iter().enumerate() {
            let (lattice, arm) = (lattice.reduced(), lattice.nearest(&arm).0);
            let farthest = [0.4, 1.0, 2.5][n % 3];
            let mut found = Vec::new();
            lattice.for_each_within(&arm, farthest, |image, arm| found.push((*image, *arm)));
            let mut expected = all_images(&lattice, &arm);
            expected.retain(|(_, arm)| arm.norm() <= farthest);
            assert_eq!(found, expected, "{lattice:?} {arm:?}");
        }
    }

    #[test]
    fn all_images_within_a_distance_are_found() {
        images_within_are_those_of_a_loop::<2>();
        images_within_are_those_of_a_loop::<3>();
    }

    /// Where two images are as short as each other the choice is one of the displacement.
    #[test]
    fn of_equal_images_it_is_always_the_same() {
        let lattice = Lattice::<2>::new([Some(4.0), Some(1.0)]).tilted(2.0);
        let (nearest, image) = lattice.nearest(&Vector::<2>::new(1.0, 0.5));
        assert_eq!((nearest, image), (Vector::<2>::new(-1.0, -0.5), [0, -1]));
        assert_eq!(lattice.nearest(&Vector::<2>::new(-1.0, -0.5)).0, -nearest);
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
