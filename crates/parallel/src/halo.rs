//! The ghosts of a vector, with the ranks that own them: nothing where a rank is alone.

use std::ops::{AddAssign, Range};

use crate::communicator::Communicator;
use crate::ghosts::GhostPlan;
use crate::number::Number;
use crate::ranks::Ranks;

/// Copies that vectors of one kind hold of what other ranks own, entry by entry. Without ghosts, as in a
/// program of one rank, all of it does nothing.
#[derive(Clone, Debug, Default)]
pub struct Halo(Option<Box<SharedEntries>>);

#[derive(Clone, Debug)]
struct SharedEntries {
    ranks: Ranks,
    plan: GhostPlan,
    /// Entries that this rank owns, in ascending order.
    owned: Vec<Range<usize>>,
}

impl Halo {
    /// The ghosts of a plan of single entries, in vectors of which this rank owns some ranges.
    pub fn new(ranks: &Ranks, plan: GhostPlan, owned: Vec<Range<usize>>) -> Self {
        Self(Some(Box::new(SharedEntries { ranks: ranks.clone(), plan, owned })))
    }

    /// Sets the ghosts to what their owners have.
    pub fn update<T: Number>(&mut self, x: &mut [T]) {
        if let Some(SharedEntries { ranks, plan, .. }) = self.0.as_deref_mut() {
            plan.update::<T, 1>(ranks, x);
        }
    }

    /// Adds the ghosts to what their owners have, and clears them.
    pub fn accumulate<T: Number + AddAssign>(&mut self, x: &mut [T]) {
        if let Some(SharedEntries { ranks, plan, .. }) = self.0.as_deref_mut() {
            plan.accumulate::<T, 1>(ranks, x);
        }
    }

    /// From sums of each rank to sums of all, at owners and ghosts.
    pub fn sum<T: Number + AddAssign>(&mut self, x: &mut [T]) {
        self.accumulate(x);
        self.update(x);
    }

    /// Clears what this rank does not own.
    pub fn clear<T: Copy + Default>(&self, x: &mut [T]) {
        let Some(SharedEntries { owned, .. }) = self.0.as_deref() else { return };
        let mut first = 0;
        for range in owned {
            x[first..range.start].fill(T::default());
            first = range.end;
        }
        x[first..].fill(T::default());
    }

    /// Whether there are no ghosts anywhere.
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// What this rank owns of a vector, range by range: all of it where there are no ghosts.
    pub fn owned<'x, T>(&'x self, x: &'x [T]) -> impl Iterator<Item = &'x [T]> {
        let shared = self.0.as_deref();
        let ranges = shared.into_iter().flat_map(|shared| &shared.owned).map(|range| &x[range.clone()]);
        ranges.chain(shared.is_none().then_some(x))
    }

    /// The number of ghosts, and of ranks that this one sends values to.
    pub fn counts(&self) -> [usize; 2] {
        self.0.as_deref().map_or([0; 2], |shared| [shared.plan.ghost_count(), shared.plan.neighbour_count()])
    }

    /// Adds up numbers over all ranks.
    pub fn sum_over_ranks(&self, numbers: &mut [f64]) {
        if let Some(SharedEntries { ranks, .. }) = self.0.as_deref() {
            ranks.sum(numbers);
        }
    }
}
