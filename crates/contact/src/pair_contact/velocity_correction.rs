//! The contact law without a projection: pairs are pushed apart one after the other.

use gluey_geom::{Dim, Space};

use super::{Buffers, Coverage, PairContact, Participation};
use crate::push_apart::{PushParams, Pushed, Unsettled, push_apart};
use crate::rows::Row;
use crate::{ContactError, ContactReport, Mobility, StepGeometry};

impl<const D: usize, M: Mobility<D>> PairContact<D, M>
where
    Dim<D>: Space<D>,
{
    /// The velocity correction: no projection.
    pub(super) fn push(
        &mut self,
        step: &StepGeometry<'_, D>,
        tolerance: f64,
        buffers: &mut Buffers<D>,
    ) -> Result<(Coverage, ContactReport), ContactError> {
        let params = PushParams {
            threshold: self.params.threshold,
            tolerance,
            sweep_limit: self.params.iteration_limit,
        };
        let mut report = ContactReport::default();
        // Pushes have no memory: every pair starts without a force.
        buffers.forces.fill(0.0);
        loop {
            self.list_rows(step, buffers)?;
            let (sweeps, residual) = self.push_rows(buffers, &params)?;
            report.iterations += sweeps;
            report.passes += 1;
            report.residual = residual;
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

    /// Pushes the pairs that take part; the number of sweeps and the largest shortfall left.
    fn push_rows(&self, buffers: &mut Buffers<D>, params: &PushParams) -> Result<(usize, f64), ContactError> {
        let rows = &buffers.rows;
        let mut forces: Vec<f64> = rows.iter().map(|row| buffers.forces[row.candidate as usize]).collect();
        let mut pushed = Pushed {
            positions: &self.neighbours.positions,
            radii: &self.neighbours.radii,
            weights: &buffers.weights,
            displacements: &mut buffers.displacements,
        };
        let settled = push_apart(rows, &mut pushed, &mut forces, params)
            .map_err(|unsettled| self.unsettled(unsettled, rows, params))?;
        for (row, force) in rows.iter().zip(forces) {
            buffers.forces[row.candidate as usize] = force;
            buffers.takes_part[row.candidate as usize] = Participation::Yes;
        }
        Ok(settled)
    }

    fn unsettled(&self, unsettled: Unsettled, rows: &[Row<D>], params: &PushParams) -> ContactError {
        ContactError::NotConverged {
            residual: unsettled.residual,
            tolerance: params.tolerance,
            iterations: params.sweep_limit,
            history: unsettled.history,
            worst: self.neighbours.key(&self.neighbours.candidates[rows[unsettled.worst].candidate as usize]),
        }
    }
}
