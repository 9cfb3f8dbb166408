//! Balls as a cell sees them.

/// A ball in coordinates in which the cell is the unit cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallInCell<const D: usize> {
    /// Centre.
    pub center: [f64; D],
    /// Radius.
    pub radius: f64,
}
