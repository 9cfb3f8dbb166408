//! Accelerated projected gradients (Nesterov 1983) with restarts (O'Donoghue and Candes 2015, DOI
//! 10.1007/s10208-013-9150-3, the gradient scheme; for contact: Mazhar et al. 2015, DOI 10.1145/2735627).
//!
//! From the extrapolated forces `y = x + beta (x - x_before)` a projected gradient step
//! `x = max(floor, y - w(y)/||A||)`; the extrapolation starts anew when it has gone uphill. The number of
//! iterations goes like the square root of that of Uzawa's algorithm.

use super::infeasibility::{InfeasibilityMonitor, MONITOR_VECTOR_COUNT};
use super::{
    ConvergenceLog, Projection, ProjectionSolver, SolveFailure, SolveReport, gaps_under, largest_eigenvalue,
    split,
};

/// Safety of the estimated norm, a lower bound.
const NORM_SAFETY: f64 = 1.1;

/// The solver for many contacts when a few digits are enough.
#[derive(Clone, Copy, Debug, Default)]
pub struct Accelerated;

impl ProjectionSolver for Accelerated {
    fn scratch_count(&self) -> usize {
        3 + MONITOR_VECTOR_COUNT
    }

    fn solve(
        &self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<SolveReport, SolveFailure> {
        let [gaps, ahead, before, mark, ray, image] = split(scratch, forces.len());
        let mut norm = NORM_SAFETY * largest_eigenvalue(problem.operator, ray, image);
        let mut monitor = InfeasibilityMonitor::new([mark, ray, image], problem, forces);
        let mut log = ConvergenceLog::new();
        let (mut least, mut momentum) = (f64::INFINITY, 1.0);
        ahead.copy_from_slice(forces);
        loop {
            gaps_under(problem, ahead, gaps);
            // At the extrapolated forces, which in the end are the forces.
            log.record(problem.residual(gaps, ahead, norm));
            if log.has_converged(problem) {
                forces.copy_from_slice(ahead);
                return Ok(log.report());
            }
            log.check(&mut monitor, problem, forces, norm)?;
            least = least.min(log.residual);
            if log.residual > 100.0 * least {
                (norm, least, momentum) = (2.0 * norm, log.residual, 1.0);
            }
            before.copy_from_slice(forces);
            let mut turned = [descend(forces, ahead, gaps, before, problem.floors, 1.0 / norm)];
            problem.operator.complete(&mut turned, &mut []);
            let momentum_now = if turned[0] > 0.0 { 1.0 } else { momentum };
            momentum = extrapolate(forces, before, ahead, problem.floors, momentum_now);
        }
    }
}

/// `x = max(floor, y - rho w)`; the step turns back on the extrapolation where this is positive:
/// `(y - x) . (x - before)`.
fn descend(x: &mut [f64], y: &[f64], gaps: &[f64], before: &[f64], floors: &[f64], rho: f64) -> f64 {
    let mut product = 0.0;
    for k in 0..x.len() {
        x[k] = (y[k] - rho * gaps[k]).max(floors[k]);
        product += (y[k] - x[k]) * (x[k] - before[k]);
    }
    product
}

/// `y = max(floor, x + beta (x - before))`; returns the next momentum.
fn extrapolate(x: &[f64], before: &[f64], y: &mut [f64], floors: &[f64], momentum: f64) -> f64 {
    let next = 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt());
    let beta = (momentum - 1.0) / next;
    for k in 0..x.len() {
        y[k] = (x[k] + beta * (x[k] - before[k])).max(floors[k]);
    }
    next
}
