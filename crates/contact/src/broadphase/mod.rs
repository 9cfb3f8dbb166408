//! Search for balls that meet: a cell list, and parry's bounding volume hierarchy for very different sizes.

mod cells;
mod hierarchy;
mod search;

use gluey_geom::Vector;

pub use cells::CellList;
pub use hierarchy::Hierarchy;
pub use search::Broadphase;

/// Ratio of the largest to the mean radius beyond which the hierarchy is faster than the cell list.
const SIZE_RATIO: f64 = 4.0;

/// So few balls are looked at in no time, wherever they are.
const FEW: usize = 1000;

/// The cell list for balls of similar sizes that fill their space, the hierarchy otherwise.
#[derive(Clone, Debug, Default)]
pub struct BestOf {
    cells: CellList,
    hierarchy: Hierarchy,
}

impl<const D: usize> Broadphase<D> for BestOf {
    fn meeting(
        &mut self,
        centers: &[Vector<D>],
        radii: &[f64],
        asker_count: usize,
        pairs: &mut Vec<(u32, u32)>,
    ) {
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let sum: f64 = radii.iter().sum();
        let are_similar = largest * radii.len() as f64 <= SIZE_RATIO * sum;
        if are_similar && (radii.len() < FEW || !self.cells.is_crowded(centers, radii)) {
            self.cells.meeting(centers, radii, asker_count, pairs);
        } else {
            self.hierarchy.meeting(centers, radii, asker_count, pairs);
        }
    }
}

#[cfg(test)]
mod tests;
