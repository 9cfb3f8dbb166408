//! The projection of velocities on those that keep gaps open, linearised anew until gaps at the end of the
//! step are exact.
//!
//! Both contact models solve it this way: what they know of their bodies stands behind [`JacobianRow`],
//! [`Response`] and [`Linearised`].

use crate::ContactParams;
use crate::delassus::{JacobianRow, Response, ScaledDelassus};
use crate::solver::{Projection, ProjectionSolver, SolveFailure, SolveReport};

/// Effort and accuracy of a projection.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Effort {
    pub iterations: usize,
    pub passes: usize,
    pub residual: f64,
}

/// Failure of a projection. Contacts are numbered as the problem numbers them.
#[derive(Clone, Debug)]
pub(crate) enum Failure {
    Solve(SolveFailure),
    Gap { contact: usize, gap: f64, passes: usize },
}

/// A projection with gaps that are not linear in the velocities.
pub(crate) trait Linearised {
    /// Linearises about the bodies where they are at the beginning of the step.
    fn begin(&mut self);

    /// Solves the linear problem, and moves the bodies to the end of the step.
    fn project(&mut self) -> Result<SolveReport, SolveFailure>;

    /// Linearises about the bodies where they are now, after so many passes. Returns the contact whose gap
    /// there is farthest from what it should be, beyond the tolerance, and that gap.
    fn linearise(&mut self, pass: usize) -> Option<(usize, f64)>;
}

/// Solves `problem` with as many linearisations as its gaps need; adds to the effort so far.
pub(crate) fn solve(
    problem: &mut impl Linearised,
    params: &ContactParams,
    effort: &mut Effort,
) -> Result<(), Failure> {
    // The first linearisation is the paper's: about the bodies where they are.
    problem.begin();
    loop {
        let report = problem.project().map_err(Failure::Solve)?;
        effort.passes += 1;
        effort.iterations += report.iterations;
        effort.residual = report.residual;
        let off = if params.exact_gap { problem.linearise(effort.passes) } else { None };
        let Some((contact, gap)) = off else { return Ok(()) };
        if effort.passes >= params.pass_limit {
            return Err(Failure::Gap { contact, gap, passes: effort.passes });
        }
    }
}

/// Tuning of the linear problems of a step.
#[derive(Clone, Copy)]
pub(crate) struct Tuning {
    pub solver: &'static dyn ProjectionSolver,
    /// Residual to reach; unit: length.
    pub tolerance: f64,
    pub iteration_limit: usize,
}

/// The linear problem: forces of scaled rows that are at least `floors` and open `free_gaps`.
pub(crate) struct LinearProblem<'a, R: JacobianRow, C> {
    pub operator: ScaledDelassus<'a, R, C>,
    /// Mobilities of the bodies.
    pub weights: &'a [R::Weight],
    pub free_gaps: &'a [f64],
    pub floors: &'a [f64],
    /// A guess, then the solution.
    pub forces: &'a mut [f64],
    pub scratch: &'a mut [f64],
}

impl<R: JacobianRow, C: Response<R>> LinearProblem<'_, R, C> {
    /// Solves for the forces; leaves `c` times the changes of the motions in those of the operator.
    pub(crate) fn solve(&mut self, tuning: &Tuning) -> Result<SolveReport, SolveFailure> {
        let report = match self.operator.rows {
            // One contact has a closed form.
            [row] if !C::IS_COUPLED => {
                let free_force = -self.free_gaps[0] / row.compliance(self.weights);
                if free_force.is_nan() {
                    return Err(SolveFailure::not_a_number());
                }
                self.forces[0] = free_force.max(self.floors[0]);
                SolveReport { iterations: 1, residual: 0.0 }
            }
            _ => {
                let mut problem = Projection {
                    operator: &mut self.operator,
                    free_gaps: self.free_gaps,
                    floors: self.floors,
                    tolerance: tuning.tolerance,
                    iteration_limit: tuning.iteration_limit,
                };
                tuning.solver.solve(&mut problem, self.forces, self.scratch)?
            }
        };
        self.operator.move_bodies(self.forces);
        Ok(report)
    }
}
