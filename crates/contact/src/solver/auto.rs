//! The solver for any number of contacts: which of the others is best was measured
//! (docs/design/contact.md).

use super::whole::improve;
use super::{
    ActiveSet, Projection, ProjectionSolver, SolveFailure, SolveReport, Uzawa, largest_eigenvalue, split,
};

/// More contacts than this are solved for by the active set.
const FEW: usize = 2;
/// Uzawa's method solves two contacts between particles of similar sizes in far fewer iterations; where one
/// of three joined particles is tiny it would take millions.
const UZAWA_LIMIT: usize = 10_000;
/// Iterations of the active set before Newton steps are tried, and one more for each contact.
const FIRST_TRY: (usize, usize) = (500, 1);

/// Uzawa's method for one or two contacts, the active set for more; where those are slow, as in jammed
/// clusters, the method of multipliers with Newton steps, after which they are not.
#[derive(Clone, Copy, Debug, Default)]
pub struct Auto;

impl ProjectionSolver for Auto {
    fn scratch_count(&self) -> usize {
        Uzawa.scratch_count().max(ActiveSet.scratch_count())
    }

    /// Nothing is allocated where Newton steps are not needed.
    fn solve(
        &self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<SolveReport, SolveFailure> {
        let mut budget = Budget { limit: problem.iteration_limit, spent: 0 };
        let outcome = budget.solve(problem, forces, scratch);
        problem.iteration_limit = budget.limit;
        outcome
    }
}

/// Iterations that may be made and that were.
struct Budget {
    limit: usize,
    spent: usize,
}

impl Budget {
    fn solve(
        &mut self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<SolveReport, SolveFailure> {
        let (start, each) = FIRST_TRY;
        let count = problem.count(forces.len());
        let first_try = start + each * count;
        let outcome = if count <= FEW {
            self.attempt(&Uzawa, UZAWA_LIMIT, problem, forces, scratch)
        } else {
            self.attempt(&ActiveSet, first_try, problem, forces, scratch)
        };
        if self.is_over(&outcome) {
            return outcome;
        }
        let [x, y] = split(scratch, forces.len());
        let norm = largest_eigenvalue(problem.operator, x, y);
        if let Some(report) = improve(problem, forces, norm, self.limit - self.spent) {
            self.spent += report.iterations;
            if report.residual <= problem.tolerance {
                return Ok(SolveReport { iterations: self.spent, ..report });
            }
        }
        self.attempt(&ActiveSet, usize::MAX, problem, forces, scratch)
    }

    /// Lets `solver` make so many iterations, at least one.
    fn attempt(
        &mut self,
        solver: &dyn ProjectionSolver,
        most: usize,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<SolveReport, SolveFailure> {
        problem.iteration_limit = most.min(self.limit.saturating_sub(self.spent)).max(1);
        let mut outcome = solver.solve(problem, forces, scratch);
        let report = match &mut outcome {
            Ok(report) => report,
            Err(failure) => &mut failure.report,
        };
        self.spent += report.iterations;
        report.iterations = self.spent;
        outcome
    }

    /// Whether there is nothing more to try.
    fn is_over(&self, outcome: &Result<SolveReport, SolveFailure>) -> bool {
        match outcome {
            Ok(_) => true,
            Err(failure) => failure.infeasible.is_some() || self.spent >= self.limit,
        }
    }
}
