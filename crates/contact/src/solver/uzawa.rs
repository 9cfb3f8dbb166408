//! Uzawa's algorithm, `lambda <- max(floor, lambda - rho w)` (Verdon et al. 2010, eq. 29; DOI 10.3166/REMN.16.365-383).

use super::{
    Projection, ProjectionSolver, ResidualHistory, SolveFailure, SolveReport, gaps_under, largest_eigenvalue,
    residual,
};

/// The paper's solver: gradient steps of fixed length in the forces.
///
/// The step `rho = 1/||A||` comes from an estimate of the norm; it converges below `2/||A||` (in terms of the paper's
/// multipliers `delta = lambda/c` that is `0 < rho < 2/||c^2 B M^-1 B^T||`), and is halved should the estimate be so
/// poor that the residual grows.
#[derive(Clone, Debug, Default)]
pub struct Uzawa {
    gaps: Vec<f64>,
}

impl ProjectionSolver for Uzawa {
    fn solve(
        &mut self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
    ) -> Result<SolveReport, SolveFailure> {
        self.gaps.resize(forces.len(), 0.0);
        let mut norm = largest_eigenvalue(problem.operator, forces.len());
        let mut history = ResidualHistory::default();
        let mut least = f64::INFINITY;
        let mut iteration = 0;
        loop {
            iteration += 1;
            gaps_under(problem, forces, &mut self.gaps);
            let (worst, residual) = residual(&self.gaps, forces, problem.floors, norm);
            history.record(iteration, residual);
            let report = SolveReport { iterations: iteration, residual };
            if residual <= problem.tolerance {
                return Ok(report);
            }
            if iteration >= problem.iteration_limit || !residual.is_finite() {
                history.close(iteration, residual);
                return Err(SolveFailure { report, history, worst });
            }
            least = least.min(residual);
            if residual > 100.0 * least {
                (norm, least) = (2.0 * norm, residual);
            }
            step(forces, &self.gaps, problem.floors, 1.0 / norm);
        }
    }
}

fn step(forces: &mut [f64], gaps: &[f64], floors: &[f64], rho: f64) {
    for ((force, gap), floor) in forces.iter_mut().zip(gaps).zip(floors) {
        *force = (*force - rho * gap).max(*floor);
    }
}
