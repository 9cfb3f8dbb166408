//! Cells whose penalty is too small for the flow that was found.

use gluey_fem::ImplicitTree;
use gluey_geom::{Dim, Space};
use gluey_linalg::KrylovError;
use gluey_stokes::part::WeakCell;
use gluey_stokes::{Problem, RaisedPenalties};
use rustc_hash::FxHashMap;

use super::context::SolveContext;
use super::trial::Trial;

/// A cell whose penalty is too small, as ranks tell each other: its key, the factor, a body and the share of
/// energy that it takes.
pub(super) type WeakCellRecord = [u64; 4];

/// What came before a flow that can be trusted.
#[derive(Default)]
pub(super) struct Before {
    /// How penalties were changed.
    pub raised: RaisedPenalties,
    /// Iterations of flows that could not be.
    pub iterations: usize,
}

impl<'a, const D: usize> SolveContext<'_, 'a, D>
where
    Dim<D>: Space<D>,
{
    /// Own cells whose penalty is too small for what was found, as in one process also for a flow that
    /// did not converge.
    pub(super) fn weak_cells(
        &self,
        tree: &ImplicitTree<'_, D>,
        problem: &Problem<D>,
        trial: &Trial<D>,
    ) -> Vec<WeakCellRecord> {
        if !matches!(trial.report, Ok(_) | Err(KrylovError::NotConverged { .. })) {
            return Vec::new();
        }
        let weak = problem.weak_cells(&trial.velocity, &self.conditions.strain);
        let cells = self.level.part.mesh.cells();
        let named = |weak: &WeakCell| {
            let body = u64::from(self.bodies.ids[weak.body as usize]);
            let key = tree.key(&cells[weak.cell as usize]);
            [key, weak.factor().to_bits(), body, weak.share.to_bits()]
        };
        weak.iter().map(named).collect()
    }

    /// Those of named cells that the part holds, with their factors.
    pub(super) fn found(&self, tree: &ImplicitTree<'_, D>, named: &[WeakCellRecord]) -> Vec<(u32, f64)> {
        let cells = self.level.part.mesh.cells().iter().zip(0..);
        let places: FxHashMap<u64, u32> = cells.map(|(cell, place)| (tree.key(cell), place)).collect();
        let found = named.iter().map(|&[key, factor, ..]| (places.get(&key), f64::from_bits(factor)));
        found.filter_map(|(place, factor)| Some((*place?, factor))).collect()
    }
}
