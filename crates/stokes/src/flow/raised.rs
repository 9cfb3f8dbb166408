//! How penalties were changed for a flow.

use std::ops::AddAssign;

/// Counts of how penalties were changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RaisedPenalties {
    /// How often those of all cells at surfaces were doubled, for smoothers that need it.
    pub doubled: usize,
    /// Cells in which they were raised, because flows took too little notice of their surfaces.
    pub cells: usize,
    /// Flows that were solved again for that.
    pub solved_again: usize,
}

impl AddAssign for RaisedPenalties {
    fn add_assign(&mut self, other: Self) {
        self.doubled += other.doubled;
        self.cells += other.cells;
        self.solved_again += other.solved_again;
    }
}
