//! Flows around the same bodies in one step, one after the other: only loads are others.

use std::sync::Arc;
use std::time::Instant;

use gluey_geom::Wrench;
use gluey_levelset::Ball;
use gluey_linalg::vector;

use super::conditions::{Conditions, Given, added};
use super::times::Watch;
use super::warm_start::NodalFields;
use super::{Flow, FlowSolver, SolveEffort, flow_of};
use crate::error::StokesError;
use crate::formulation::{Method, Problem};
use crate::space::Discretisation;

/// The flows of a step, of which the last one is what the next step starts from.
pub struct FlowsOfStep<'s, const D: usize> {
    solver: &'s mut FlowSolver<D>,
    discretisation: &'s Discretisation<D>,
    bodies: &'s [Ball<D>],
    ready: Option<ReadyProblem<D>>,
    looseness: f64,
}

/// A problem that the solver is prepared for.
struct ReadyProblem<const D: usize> {
    problem: Problem<D>,
    method: Arc<dyn Method<D>>,
    /// Reduced vector of the last flow.
    x: Vec<f64>,
    /// That of the last one that forces made in a box at rest; none before the first.
    pushed: Vec<f64>,
    /// The flow of the step before.
    before: Option<NodalFields>,
}

impl<const D: usize> FlowSolver<D> {
    /// Begins the flows of a step.
    pub(crate) fn flows_of_step<'s>(
        &'s mut self,
        discretisation: &'s Discretisation<D>,
        bodies: &'s [Ball<D>],
    ) -> FlowsOfStep<'s, D> {
        FlowsOfStep { solver: self, discretisation, bodies, ready: None, looseness: 1.0 }
    }
}

impl<const D: usize> FlowsOfStep<'_, D> {
    /// How many times less accurate than wanted the next flows may be.
    pub fn set_looseness(&mut self, looseness: f64) {
        self.looseness = looseness;
    }

    /// The flow under some conditions, from the last one. All ranks call this.
    ///
    /// # Errors
    /// Those of [`FlowSolver::solve_on`].
    pub fn solve(&mut self, conditions: &Conditions<'_, D>) -> Result<Flow<D>, StokesError> {
        let (mut ready, watch) = self.ready(conditions)?;
        let mut flow = self.driven(&mut ready, conditions)?;
        if conditions.without_mean {
            (flow, _) = self.solver.balanced(&mut ready.problem, &mut ready.method, conditions, flow)?;
        }
        flow.times = watch.times();
        self.ready = Some(ready);
        Ok(flow)
    }

    /// The flow under some conditions, without forces on the bodies but those of contacts, plus a multiple of
    /// the flow that the `wrenches` make in a box at rest: `factor` tells the multiple from the two. Without
    /// wrenches there is one flow, and the factor is not asked for. All ranks call this.
    ///
    /// A suspension that is sheared at a given stress: the stress is `r A + B` with the flow at the rate one,
    /// the flow of the forces between bodies, and the rate `r` that the stress asks for.
    ///
    /// # Errors
    /// Those of [`FlowSolver::solve_on`], and of `factor`.
    pub fn solve_combined<E: From<StokesError>>(
        &mut self,
        conditions: &Conditions<'_, D>,
        wrenches: &[Wrench<D>],
        factor: impl FnOnce(&Flow<D>, &Flow<D>) -> Result<f64, E>,
    ) -> Result<Flow<D>, E> {
        if wrenches.is_empty() {
            return Ok(self.solve(conditions)?);
        }
        let (mut ready, watch) = self.ready(conditions)?;
        let first = self.driven(&mut ready, conditions)?;
        let at_rest =
            Conditions { stress: conditions.stress, ..Conditions::at_rest().with_wrenches(wrenches) };
        let ReadyProblem { problem, method, x, pushed, .. } = &mut ready;
        pushed.resize(x.len(), 0.0);
        let second = self.solver.solve_with_adaptive_penalty(problem, method, &at_rest, pushed)?;
        let factor = factor(&first, &second.flow)?;
        let mut both = x.clone();
        vector::axpy(factor, &second.x, &mut both);
        *pushed = second.x;
        let of_contacts = conditions.given_wrenches();
        let all: Vec<Wrench<D>> = wrenches.iter().map(|wrench| *wrench * factor).collect();
        let all = added(&all, of_contacts);
        let with_all = Conditions { bodies: Given::Wrenches(&all), ..*conditions };
        let lift = problem.lift(conditions.boundary);
        let mut flow = flow_of(problem, &with_all, &lift, &mut both, Vec::new(), &SolveEffort::default())?;
        [&first, &second.flow].into_iter().for_each(|part| flow.count_effort_of(part));
        (flow.residual, flow.times) = (first.residual.max(second.flow.residual), watch.times());
        self.ready = Some(ready);
        Ok(flow)
    }

    /// The problem that the solver is prepared for, and when that was.
    fn ready(&mut self, conditions: &Conditions<'_, D>) -> Result<(ReadyProblem<D>, Watch), StokesError> {
        let start = Instant::now();
        if let Some(ready) = self.ready.take() {
            return Ok((ready, Watch { start, assembled: start, prepared: start }));
        }
        let mut problem = self.solver.problem(self.discretisation, self.bodies)?;
        problem.system.space.hold(&conditions.held(self.bodies.len()));
        let assembled = Instant::now();
        let mut method = self.solver.method.clone();
        self.solver.prepare(&mut problem, &mut method)?;
        let prepared = Instant::now();
        let (x, before) = self.solver.initial_guess(&problem, conditions)?;
        let ready = ReadyProblem { problem, method, x, pushed: Vec::new(), before };
        Ok((ready, Watch { start, assembled, prepared }))
    }

    /// The flow under some conditions from the last one, which it becomes.
    fn driven(
        &mut self,
        ready: &mut ReadyProblem<D>,
        conditions: &Conditions<'_, D>,
    ) -> Result<Flow<D>, StokesError> {
        let ReadyProblem { problem, method, x, before, .. } = ready;
        let tolerance = self.solver.params.tolerance;
        self.solver.params.tolerance = tolerance * self.looseness;
        let adapted = self.solver.solve_with_adaptive_penalty(problem, method, conditions, x);
        self.solver.params.tolerance = tolerance;
        let adapted = adapted?;
        *x = adapted.x;
        self.solver.keep_for_next(problem, x, &adapted.flow.pressure, before.take());
        Ok(adapted.flow)
    }
}
