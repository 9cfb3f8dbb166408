//! The contact law without a projection: pairs are pushed apart one after the other.

use super::{Buffers, Coverage, PairContact, Participation};
use crate::push_apart::{Pushed, push_apart};
use crate::solver::SolveReport;
use crate::{ContactError, ContactParams, ContactReport, Mobility, StepGeometry};

impl<const D: usize, M: Mobility<D>> PairContact<D, M> {
    /// The velocity correction: no projection.
    pub(super) fn push(
        &mut self,
        step: &StepGeometry<'_, D>,
        tolerance: f64,
        buffers: &mut Buffers<D>,
    ) -> Result<(Coverage, ContactReport), ContactError> {
        let mut report = ContactReport::default();
        // Pushes have no memory: every pair starts without a force.
        buffers.forces.fill(0.0);
        loop {
            self.list_rows(step, buffers)?;
            let settled = self.push_rows(buffers, tolerance)?;
            report.iterations += settled.iterations;
            report.passes += 1;
            report.residual = settled.residual;
            if !self.neighbours.is_sufficient(&self.domain, step, &buffers.displacements) {
                return Ok((Coverage::Incomplete, report));
            }
            if !self.admit(step, buffers) {
                break;
            }
        }
        let moves = buffers.displacements.iter().zip(&self.neighbours.free);
        for (change, (end, free)) in buffers.changes.iter_mut().zip(moves) {
            *change = (end - free) / step.velocity_weight;
        }
        Ok((Coverage::Complete, report))
    }

    /// Pushes the pairs that take part.
    fn push_rows(&self, buffers: &mut Buffers<D>, tolerance: f64) -> Result<SolveReport, ContactError> {
        let (rows, ContactParams { threshold, iteration_limit, .. }) = (&buffers.rows, &self.params);
        let mut forces: Vec<f64> = rows.iter().map(|row| buffers.forces[row.candidate as usize]).collect();
        let mut pushed = Pushed {
            positions: &self.neighbours.positions,
            radii: &self.neighbours.radii,
            weights: &buffers.weights,
            displacements: &mut buffers.displacements,
        };
        let key = |k: usize| self.neighbours.key(&self.neighbours.candidates[rows[k].candidate as usize]);
        let settled = push_apart(rows, &mut pushed, &mut forces, *threshold, tolerance, *iteration_limit)
            .map_err(|failure| ContactError::of_solve(&failure, tolerance, key))?;
        for (row, force) in rows.iter().zip(forces) {
            buffers.forces[row.candidate as usize] = force;
            buffers.takes_part[row.candidate as usize] = Participation::Yes;
        }
        Ok(settled)
    }
}
