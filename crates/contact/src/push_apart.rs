//! The older velocity correction: push near pairs apart after the move, one after the other.
//!
//! Verdon et al. (2010, section 2.4) mention it as what the gluey model replaces: each pair whose gap after the move is
//! below a threshold is moved apart along its normal to the threshold, a particle of radius `a` by a share `1/a`; sweeps
//! over the pairs are repeated until no pair is too near. Divided by the rate the moves are corrections of velocity.

use gluey_geom::Vector;

use crate::constraints::Constraint;
use crate::solver::ResidualHistory;
use crate::{ContactError, StepGeometry};

/// When the pushing ends.
pub(crate) struct PushParams {
    /// Gap to keep, relative to the mean radius of a pair.
    pub threshold: f64,
    /// Shortfall that is left, in units of length.
    pub tolerance: f64,
    /// Most sweeps over all pairs.
    pub sweep_limit: usize,
}

/// Pushes until all gaps under `displacements` are at the threshold; adds to `forces` what the pushes amount to.
/// Returns the number of sweeps and the largest shortfall left.
pub(crate) fn push_apart<const D: usize>(
    step: &StepGeometry<'_, D>,
    constraints: &mut [Constraint<D>],
    displacements: &mut [Vector<D>],
    forces: &mut [f64],
    params: &PushParams,
) -> Result<(usize, f64), ContactError> {
    let mut history = Vec::new();
    let mut worst = (0, 0.0);
    for sweep in 1..=params.sweep_limit {
        worst = (0, 0.0);
        for (k, (constraint, force)) in constraints.iter_mut().zip(&mut *forces).enumerate() {
            let shortfall = push(step, constraint, displacements, force, params.threshold)?;
            if shortfall > worst.1 {
                worst = (k, shortfall);
            }
        }
        if sweep.is_power_of_two() {
            history.push((sweep, worst.1));
        }
        if worst.1 <= params.tolerance {
            return Ok((sweep, worst.1));
        }
    }
    Err(ContactError::NotConverged {
        residual: worst.1,
        tolerance: params.tolerance,
        iterations: params.sweep_limit,
        history: ResidualHistory { entries: history },
        worst: constraints[worst.0].pair,
    })
}

/// Pushes one pair; returns by how much its gap was too small.
fn push<const D: usize>(
    step: &StepGeometry<'_, D>,
    constraint: &mut Constraint<D>,
    displacements: &mut [Vector<D>],
    force: &mut f64,
    threshold: f64,
) -> Result<f64, ContactError> {
    let separation = constraint.separation(step.positions, displacements);
    let shortfall = 0.5 * threshold * constraint.rest - (separation.norm() - constraint.rest);
    if shortfall <= 0.0 {
        return Ok(0.0);
    }
    constraint.point_along(&separation)?;
    let compliance = 1.0 / step.radii[constraint.tail] + 1.0 / step.radii[constraint.head];
    let impulse = constraint.normal * (shortfall / compliance);
    displacements[constraint.head] += impulse / step.radii[constraint.head];
    displacements[constraint.tail] -= impulse / step.radii[constraint.tail];
    *force += shortfall / (compliance * step.rate);
    Ok(shortfall)
}
