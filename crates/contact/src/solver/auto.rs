//! The solver for any number of contacts: which of the others is best was measured (docs/decisions/0018-contact-solver.md).

use super::{ActiveSet, Projection, ProjectionSolver, SolveFailure, SolveReport, Uzawa};

/// More contacts than this are solved for by the active set.
const FEW: usize = 2;
/// Two contacts between particles of similar sizes take Uzawa's method about 70 iterations. Where one of three joined particles is
/// tiny it would take millions.
const UZAWA_LIMIT: usize = 10_000;

/// Uzawa's method for one or two contacts, the active set for more, and for those two that are slow.
#[derive(Clone, Copy, Debug, Default)]
pub struct Auto;

impl ProjectionSolver for Auto {
    fn scratch_count(&self) -> usize {
        Uzawa.scratch_count().max(ActiveSet.scratch_count())
    }

    fn solve(
        &self,
        problem: &mut Projection<'_>,
        forces: &mut [f64],
        scratch: &mut [f64],
    ) -> Result<SolveReport, SolveFailure> {
        let limit = problem.iteration_limit;
        let mut spent = 0;
        if forces.len() <= FEW {
            problem.iteration_limit = limit.min(UZAWA_LIMIT);
            match Uzawa.solve(problem, forces, scratch) {
                Err(failure) if failure.contradiction.is_none() && failure.report.iterations < limit => {
                    spent = failure.report.iterations;
                }
                outcome => return outcome,
            }
        }
        problem.iteration_limit = limit - spent;
        let report = ActiveSet.solve(problem, forces, scratch)?;
        Ok(SolveReport { iterations: spent + report.iterations, ..report })
    }
}
