//! The box that particles fill: periodic along some axes, walled along the others.

use gluey_geom::{Aabb, Lattice, Vector};

/// A box of particles: along each axis it is periodic, or has a wall on either side.
///
/// ```
/// use gluey_geom::{Aabb, Vector};
/// use gluey_suspension::Container;
/// // A channel along x, with walls below and above.
/// let channel = Container::<2>::new(Aabb::unit(), [true, false]);
/// assert_eq!(channel.wrapped(&Vector::<2>::new(-0.25, 0.5)).x, 0.75);
/// assert!(channel.is_walled(1) && channel.volume() == 1.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Container<const D: usize> {
    bounds: Aabb<D>,
    lattice: Lattice<D>,
}

impl<const D: usize> Container<D> {
    /// The box `bounds`, with its edge as the period of each periodic axis and walls across the others.
    pub fn new(bounds: Aabb<D>, is_periodic: [bool; D]) -> Self {
        let edges = bounds.extent();
        Self { bounds, lattice: Lattice::new(std::array::from_fn(|d| is_periodic[d].then_some(edges[d]))) }
    }

    /// The space of a lattice, with a corner at the origin, for pairs of particles: where it has no period
    /// there is no end.
    pub fn of_lattice(lattice: Lattice<D>) -> Self {
        let upper = Vector::from_fn(|d, _| lattice.periods()[d].unwrap_or(1.0));
        Self { bounds: Aabb { lower: Vector::zeros(), upper }, lattice }
    }

    /// A box with a corner at the origin that is periodic along all axes.
    pub fn periodic(edges: &Vector<D>) -> Self {
        Self::new(Aabb { lower: Vector::zeros(), upper: *edges }, [true; D])
    }

    /// A box with walls on all sides.
    pub fn walled(bounds: Aabb<D>) -> Self {
        Self::new(bounds, [false; D])
    }

    /// The same with images that slide: that one period up in `y` lies `tilt` further along `x`, a length.
    #[must_use]
    pub fn tilted(self, tilt: f64) -> Self {
        Self { lattice: self.lattice.tilted(tilt), ..self }
    }

    /// The box without tilt.
    pub fn bounds(&self) -> &Aabb<D> {
        &self.bounds
    }

    /// The translations to periodic images.
    pub fn lattice(&self) -> &Lattice<D> {
        &self.lattice
    }

    /// Whether there are walls across an axis.
    pub fn is_walled(&self, axis: usize) -> bool {
        self.lattice.periods()[axis].is_none()
    }

    /// Volume; area in 2D.
    pub fn volume(&self) -> f64 {
        self.bounds.extent().product()
    }

    /// The shortest period, if there is one.
    pub fn shortest_period(&self) -> Option<f64> {
        self.lattice.periods().iter().flatten().copied().reduce(f64::min)
    }

    /// Place of a point in the box without tilt, relative to its lower corner; not wrapped.
    pub(crate) fn place(&self, x: &Vector<D>) -> Vector<D> {
        self.lattice.to_box(x, self.bounds.lower[1]) - self.bounds.lower
    }

    /// The image of a point whose place is in the box.
    pub fn wrapped(&self, x: &Vector<D>) -> Vector<D> {
        let place = self.place(x);
        *x + self.lattice.shift(&std::array::from_fn(|d| {
            self.lattice.periods()[d].map_or(0, |period| -(place[d] / period).floor() as i32)
        }))
    }

    /// Images of a ball that reach into the box, or nearly so at an edge, without the ball: in how many
    /// periods each lies along the axes, and its centre.
    pub fn images_inside(&self, center: &Vector<D>, radius: f64) -> Vec<([i32; D], Vector<D>)> {
        let all = (0..3_i32.pow(D as u32)).map(|n| std::array::from_fn(|d| n / 3_i32.pow(d as u32) % 3 - 1));
        let others = all.filter(|image: &[i32; D]| {
            *image != [0; D] && (0..D).all(|d| image[d] == 0 || !self.is_walled(d))
        });
        // The borders across x are slanted: along x they are further away than straight across.
        let slant = 1f64.hypot(self.lattice.shear());
        let reaches = |image: &Vector<D>| {
            let (place, edges) = (self.lattice.to_box(image, self.bounds.lower[1]), &self.bounds);
            (0..D).all(|d| {
                let reach = if d == 0 { radius * slant } else { radius };
                place[d] > edges.lower[d] - reach && place[d] < edges.upper[d] + reach
            })
        };
        let images = others.map(|image| (image, center + self.lattice.shift(&image)));
        images.filter(|(_, center)| reaches(center)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_wrapped_along_the_lattice() {
        let container = Container::<3>::periodic(&Vector::<3>::new(2.0, 1.0, 3.0)).tilted(0.5);
        let x = Vector::<3>::new(7.3, -4.2, 9.1);
        let wrapped = container.wrapped(&x);
        assert!(container.lattice().nearest(&(wrapped - x)).0.norm() < 1e-13);
        let place = container.place(&wrapped);
        assert!((0..3).all(|d| (0.0..=[2.0, 1.0, 3.0][d]).contains(&place[d])), "{place}");
    }

    #[test]
    fn balls_across_periodic_borders_have_images() {
        let container = Container::<2>::periodic(&Vector::<2>::repeat(1.0)).tilted(0.25);
        let inside = Vector::<2>::new(0.6, 0.5);
        assert!(container.images_inside(&inside, 0.1).is_empty());
        let found = container.images_inside(&Vector::<2>::new(0.5, 0.95), 0.1);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].0, [0, -1]);
        assert!((found[0].1 - Vector::<2>::new(0.25, -0.05)).norm() < 1e-12, "{found:?}");
        assert_eq!(container.images_inside(&Vector::<2>::new(0.05, 0.05), 0.1).len(), 3, "in a corner");
    }
}
