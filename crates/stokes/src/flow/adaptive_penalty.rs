//! Flows whose penalties are large enough: where the smoother or the flow shows that they are not, the
//! problem is set up again with larger ones.

use std::sync::Arc;

use gluey_linalg::KrylovError;

use super::conditions::Conditions;
use super::raised::RaisedPenalties;
use super::{Flow, FlowSolver, SolveEffort};
use crate::error::StokesError;
use crate::formulation::{Method, Problem};

/// How often penalties are raised for one flow, at most.
pub const MOST_ROUNDS: usize = 6;

/// A flow whose penalties are large enough, and the reduced vector it belongs to.
pub(super) struct FlowWithAdaptedPenalty<const D: usize> {
    pub flow: Flow<D>,
    pub x: Vec<f64>,
    /// Whether the problem has got larger penalties for it.
    pub is_raised: bool,
}

impl<const D: usize> FlowSolver<D> {
    /// How penalties were changed since this was asked last.
    pub fn take_raised_penalties(&mut self) -> RaisedPenalties {
        std::mem::take(&mut self.raised_penalties)
    }

    /// Prepares the solver for a problem; where the smoother finds a penalty too small, for one with larger
    /// penalties instead. Whether it did so is told.
    ///
    /// # Errors
    /// Those of [`crate::SaddleSolver::prepare`].
    pub(super) fn prepare(
        &mut self,
        problem: &mut Problem<D>,
        method: &mut Arc<dyn Method<D>>,
    ) -> Result<bool, StokesError> {
        let mut is_stiffened = false;
        loop {
            let Err(error) = self.solver(problem).prepare(problem) else { return Ok(is_stiffened) };
            let is_weak = matches!(error, StokesError::SurfaceBlock { .. } | StokesError::AtSurface(_));
            let stiffer = method.stiffened().filter(|_| problem.discretisation().any(is_weak));
            *method = stiffer.ok_or(error)?;
            self.raised_penalties.doubled += 1;
            self.rebuild(problem, method.as_ref())?;
            is_stiffened = true;
        }
    }

    /// The same problem with another method.
    fn rebuild(&self, problem: &mut Problem<D>, method: &dyn Method<D>) -> Result<(), StokesError> {
        let held = problem.system.space.held_of_all().to_vec();
        let discretisation = problem.discretisation().clone();
        *problem = Problem::on(&discretisation, &problem.all_bodies, self.params.viscosity, method)?;
        problem.system.space.hold(&held);
        Ok(())
    }

    /// The flow under some conditions from a guess; where it, or what a solver without convergence has of it,
    /// shows that penalties are too small, the flow with larger ones.
    ///
    /// # Errors
    /// Those of the solver, [`StokesError::WeakSurface`].
    pub(super) fn solve_with_adaptive_penalty(
        &mut self,
        problem: &mut Problem<D>,
        method: &mut Arc<dyn Method<D>>,
        conditions: &Conditions<'_, D>,
        guess: &[f64],
    ) -> Result<FlowWithAdaptedPenalty<D>, StokesError> {
        let mut wasted = SolveEffort::default();
        for rounds in 0.. {
            let mut x = guess.to_vec();
            let (lift, mut b) = problem.discretisation().agreed(conditions.data(problem))?;
            problem.system.complete(&mut b);
            let solved = self.solved(problem, conditions, [&lift, &b], &mut x);
            let velocity = match &solved {
                Ok(flow) => &flow.velocity,
                Err(StokesError::Krylov(KrylovError::NotConverged { .. })) => &problem.velocity(&lift, &x),
                Err(error) => return Err(error.clone()),
            };
            let weak = problem.weak_cells(velocity, &conditions.strain);
            let Some(first) = weak.first() else {
                let mut flow = solved?;
                flow.solve_count += wasted.solve_count;
                flow.iteration_count += wasted.iteration_count;
                return Ok(FlowWithAdaptedPenalty { flow, x, is_raised: rounds > 0 });
            };
            let [cell, body] = [first.cell, first.body].map(|index| index as usize);
            let error = StokesError::WeakSurface { body, cell, share: first.share, rounds };
            let raised = method.raised(&weak).filter(|_| rounds < MOST_ROUNDS);
            if let Ok(flow) = &solved {
                wasted.solve_count += flow.solve_count;
                wasted.iteration_count += flow.iteration_count;
            }
            *method = raised.ok_or_else(|| solved.err().unwrap_or(error))?;
            self.raised_penalties.cells += weak.len();
            self.raised_penalties.solved_again += 1;
            self.rebuild(problem, method.as_ref())?;
            self.prepare(problem, method)?;
        }
        unreachable!("the rounds are limited")
    }
}
