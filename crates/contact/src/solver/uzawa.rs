//! Uzawa's algorithm, `lambda <- max(floor, lambda - rho w)` (Verdon et al. 2010, eq. 29; DOI
//! 10.3166/REMN.16.365-383).

use super::infeasibility::{InfeasibilityMonitor, MONITOR_VECTOR_COUNT};
use super::{
    ConvergenceLog, Projection, ProjectionSolver, SolveFailure, SolveReport, gaps_under, largest_eigenvalue,
    split,
};

/// The paper's solver: gradient steps of fixed length in the forces.
///
/// The step `rho = 1/||A||` comes from an estimate of the norm; it converges below `2/||A||` (in terms of the
/// paper's multipliers `delta = lambda/c` that is `0 < rho < 2/||c^2 B M^-1 B^T||`), and is halved should the
/// estimate be so poor that the residual grows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uzawa;

impl ProjectionSolver for Uzawa {
    fn scratch_count(&self) -> usize {
        1 + MONITOR_VECTOR_COUNT
    }

    fn solve(
        &self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<SolveReport, SolveFailure> {
        let [gaps, mark, ray, image] = split(scratch, forces.len());
        let mut norm = largest_eigenvalue(problem.operator, ray, image);
        let mut monitor = InfeasibilityMonitor::new([mark, ray, image], problem, forces);
        let mut log = ConvergenceLog::new();
        let mut least = f64::INFINITY;
        loop {
            gaps_under(problem, forces, gaps);
            log.record(problem.residual(gaps, forces, norm));
            if log.has_converged(problem) {
                return Ok(log.report());
            }
            log.check(&mut monitor, problem, forces, norm)?;
            least = least.min(log.residual);
            if log.residual > 100.0 * least {
                (norm, least) = (2.0 * norm, log.residual);
            }
            step(forces, gaps, problem.floors, 1.0 / norm);
        }
    }
}

fn step(forces: &mut [f64], gaps: &[f64], floors: &[f64], rho: f64) {
    for ((force, gap), floor) in forces.iter_mut().zip(gaps).zip(floors) {
        *force = (*force - rho * gap).max(*floor);
    }
}
