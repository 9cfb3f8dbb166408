//! The older velocity correction: push near pairs apart after the move, one after the other.
//!
//! Verdon et al. (2010, section 2.4) mention it as what the gluey model replaces: each pair whose gap after
//! the move is below a threshold is moved apart along its normal to the threshold, a particle of radius `a`
//! by a share `1/a`; sweeps over the pairs are repeated until no pair is too near. Divided by the rate the
//! moves are corrections of velocity.

use gluey_geom::Vector;

use crate::rows::{GROUND, Row};
use crate::solver::{ResidualHistory, SolveFailure, SolveReport};

/// Particles that are pushed.
pub(crate) struct Pushed<'a, const D: usize> {
    pub positions: &'a [Vector<D>],
    pub radii: &'a [f64],
    /// `c` times the mobility of each place.
    pub weights: &'a [f64],
    pub displacements: &'a mut [Vector<D>],
}

/// Pushes until all gaps are at the threshold, relative to the mean radius of a pair (to half the radius, for
/// a wall), but for a shortfall of the `tolerance`, a length; in so many sweeps over all pairs at most. Adds
/// to `forces` what the pushes amount to.
pub(crate) fn push_apart<const D: usize>(
    rows: &[Row<D>],
    pushed: &mut Pushed<'_, D>,
    forces: &mut [f64],
    threshold: f64,
    tolerance: f64,
    sweep_limit: usize,
) -> Result<SolveReport, SolveFailure> {
    let mut history = ResidualHistory::default();
    let mut worst = (0, 0.0);
    for sweep in 1..=sweep_limit {
        worst = (0, 0.0);
        for (k, (row, force)) in rows.iter().zip(&mut *forces).enumerate() {
            let shortfall = push(row, pushed, force, threshold);
            // What is not a number is farthest from where it should be.
            if shortfall > worst.1 || shortfall.is_nan() {
                worst = (k, if shortfall.is_nan() { f64::INFINITY } else { shortfall });
            }
        }
        if sweep.is_power_of_two() {
            history.entries.push((sweep, worst.1));
        }
        if worst.1 <= tolerance {
            return Ok(SolveReport { iterations: sweep, residual: worst.1 });
        }
    }
    let report = SolveReport { iterations: sweep_limit, residual: worst.1 };
    Err(SolveFailure { report, history, worst: worst.0, infeasible: None })
}

/// Pushes one pair; returns by how much its gap was too small.
fn push<const D: usize>(row: &Row<D>, pushed: &mut Pushed<'_, D>, force: &mut f64, threshold: f64) -> f64 {
    let (head, tail) = (row.head as usize, row.tail as usize);
    let separation = row.separation(pushed.positions, pushed.displacements);
    let size = if row.tail == GROUND { pushed.radii[head] } else { row.rest };
    let shortfall = 0.5 * threshold * size - row.gap_at(&separation);
    if shortfall <= 0.0 {
        return 0.0;
    }
    // Centres that have come to coincide are pushed back the way they came.
    let normal = if row.is_flat { row.normal } else { separation.try_normalize(0.0).unwrap_or(row.normal) };
    let behind = if row.tail == GROUND { 0.0 } else { pushed.weights[tail] };
    let impulse = shortfall / (pushed.weights[head] + behind);
    pushed.displacements[head] += normal * (impulse * pushed.weights[head]);
    if behind > 0.0 {
        pushed.displacements[tail] -= normal * (impulse * behind);
    }
    *force += impulse;
    shortfall
}
