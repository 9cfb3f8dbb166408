//! The projection of an island of which other ranks have other rows: those here are solved for by the methods
//! of any island, with forces and motions exchanged, and sums over all rows.

use gluey_geom::Vector;

use super::{Instant, IslandSlice, IslandWorkspace, NormalRow, Outcome, with_rows};
use crate::ContactParams;
use crate::delassus::Response;
use crate::islands::Islands;
use crate::part::Partners;
use crate::projection::{self, Effort, Linearised, Tuning};
use crate::solver::{ELSEWHERE, Factor, SolveFailure, SolveReport};

/// Context of the solve of an island that several ranks have rows of.
pub(crate) struct SharedContext<'a, const D: usize> {
    pub params: &'a ContactParams,
    pub tuning: Tuning,
    /// `c`.
    pub velocity_weight: f64,
    /// Those who have the other rows.
    pub partners: &'a dyn Partners<D>,
    /// Of the particle of each slot, the same on all ranks.
    pub numbers: &'a [u32],
}

impl<const D: usize> IslandWorkspace<D> {
    /// Solves for the only island.
    pub(crate) fn solve_shared(&mut self, islands: &Islands<D>, context: &SharedContext<'_, D>) -> Outcome {
        let mut island = self.slice(islands, context.tuning.solver.scratch_count());
        let mut effort = Effort::default();
        island.scale(|largest| context.partners.complete(&mut [], largest));
        let mut problem = SharedProblem { island: &mut island, context };
        projection::solve(&mut problem, context.params, &mut effort)?;
        island.unscale();
        Ok(effort)
    }
}

/// The only island of a slice as the part of one that other ranks have other rows of.
struct SharedProblem<'a, 'b, const D: usize> {
    island: &'a mut IslandSlice<'b, D>,
    context: &'a SharedContext<'a, D>,
}

impl<const D: usize> Linearised for SharedProblem<'_, '_, D> {
    fn begin(&mut self) {
        self.island.moved.fill(Vector::zeros());
        self.island.set_free_gaps(Instant::Beginning);
    }

    fn project(&mut self) -> Result<SolveReport, SolveFailure> {
        let SharedContext { partners, numbers, tuning, velocity_weight, .. } = *self.context;
        let response = SharedMobility { weights: self.island.weights, partners, numbers };
        self.island.project(response, &tuning, velocity_weight)
    }

    fn linearise(&mut self, _pass: usize) -> Option<(usize, f64)> {
        let own = self.island.farthest_off(self.context.tuning.tolerance);
        let own_off = own.map_or(0.0, |(.., off)| off);
        let mut largest = [own_off];
        self.context.partners.complete(&mut [], &mut largest);
        if largest[0] == 0.0 {
            return None;
        }
        self.island.set_free_gaps(Instant::End);
        let farthest = own.filter(|_| own_off == largest[0]).map(|(row, gap, _)| (row, gap));
        Some(farthest.unwrap_or((ELSEWHERE, f64::NAN)))
    }
}

/// The mobility of slots on which other ranks act too.
struct SharedMobility<'a, const D: usize> {
    /// `c` times the mobility of each slot.
    weights: &'a [f64],
    partners: &'a dyn Partners<D>,
    /// Of the particle of each slot, on all ranks.
    numbers: &'a [u32],
}

impl<const D: usize> Response<NormalRow<D>> for SharedMobility<'_, D> {
    /// A force here moves slots of contacts elsewhere.
    const IS_COUPLED: bool = true;

    fn respond(&self, motions: &mut [Vector<D>]) {
        self.partners.accumulate(&mut motions[1..]);
        motions.iter_mut().zip(self.weights).for_each(|(motion, weight)| *motion *= *weight);
        self.partners.update(&mut motions[1..]);
    }

    fn factor(&self, rows: &[NormalRow<D>]) -> Option<Factor> {
        Some(with_rows(Factor::new(0), rows, self.weights, |slot| self.numbers[slot as usize] as usize))
    }

    fn place(&self) -> Option<usize> {
        Some(self.partners.rank())
    }

    fn gather(&self, numbers: &[f64]) -> Vec<Vec<f64>> {
        self.partners.gather(numbers)
    }

    fn complete(&self, sums: &mut [f64], largest: &mut [f64]) {
        self.partners.complete(sums, largest);
    }
}
