//! Balls as a cell sees them.

/// A ball in coordinates in which the cell is the unit cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallInCell<const D: usize> {
    /// Centre.
    pub center: [f64; D],
    /// Radius.
    pub radius: f64,
}

impl<const D: usize> BallInCell<D> {
    /// The same ball of a cube.
    pub(super) fn in_3d(&self) -> BallInCell<3> {
        let center = std::array::from_fn(|d| self.center.get(d).copied().unwrap_or(0.0));
        BallInCell { center, radius: self.radius }
    }
}
