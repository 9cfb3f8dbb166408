//! What parts of one mesh ask of each other.

/// Reduced velocities on the parts of a mesh: an entry belongs to one part, its owner; others that have it
/// keep a copy. Products of the operator with such vectors are sums over the own cells of each part.
pub trait SharedVelocities {
    /// Sets the copies to what the owners have.
    fn update(&mut self, x: &mut [f32]);

    /// Adds the copies to what the owners have, and clears them.
    fn accumulate(&mut self, x: &mut [f32]);

    /// Clears the copies.
    fn clear(&self, x: &mut [f32]);

    /// Adds up the blocks of twists, of equal size for each body here, at owners and copies.
    fn sum_blocks(&mut self, blocks: &mut [f64]);

    /// Completes sums over the own entries to sums over all.
    fn complete(&self, sums: &mut [f64]);

    /// From sums over own cells to sums over all cells, at owners and copies.
    fn sum(&mut self, x: &mut [f32]) {
        self.accumulate(x);
        self.update(x);
    }
}

/// A mesh in one piece.
pub struct Alone;

impl SharedVelocities for Alone {
    fn update(&mut self, _: &mut [f32]) {}

    fn accumulate(&mut self, _: &mut [f32]) {}

    fn clear(&self, _: &mut [f32]) {}

    fn sum_blocks(&mut self, _: &mut [f64]) {}

    fn complete(&self, _: &mut [f64]) {}
}
