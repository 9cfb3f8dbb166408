//! A flow and a multiple of another around the same free bodies, the multiple found from both.
//!
//! A suspension that is sheared at a given stress: the stress is `r A + B` with the flow at the rate one, the
//! flow of the forces between bodies, and the rate `r` that the stress asks for.

use gluey_geom::Wrench;
use gluey_levelset::Ball;
use gluey_linalg::vector;

use super::conditions::{Conditions, Given};
use super::{FirstFlow, Flow, FlowSolver, SolveEffort, flow_of};
use crate::error::StokesError;
use crate::space::Discretisation;

impl<const D: usize> FlowSolver<D> {
    /// The flow under some conditions, without forces on the bodies, plus a multiple of the flow that the
    /// `wrenches` make in a box at rest: `factor` tells the multiple from the two. Without wrenches there is
    /// one flow, and the factor is not asked for. All ranks call this.
    ///
    /// # Errors
    /// Those of [`FlowSolver::solve_on`], and of `factor`.
    pub fn solve_combined<E: From<StokesError>>(
        &mut self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        conditions: &Conditions<'_, D>,
        wrenches: &[Wrench<D>],
        factor: impl FnOnce(&Flow<D>, &Flow<D>) -> Result<f64, E>,
    ) -> Result<Flow<D>, E> {
        if wrenches.is_empty() {
            return Ok(self.solve_on(discretisation, bodies, conditions)?);
        }
        let FirstFlow { mut problem, mut method, flow: first, mut x, watch } =
            self.first_flow(discretisation, bodies, conditions)?;
        let pushed =
            Conditions { stress: conditions.stress, ..Conditions::at_rest().with_wrenches(wrenches) };
        let guess = vec![0.0; x.len()];
        let second = self.solve_with_adaptive_penalty(&mut problem, &mut method, &pushed, &guess)?;
        let factor = factor(&first, &second.flow)?;
        vector::axpy(factor, &second.x, &mut x);
        let pushes: Vec<Wrench<D>> = wrenches.iter().map(|wrench| *wrench * factor).collect();
        let both = Conditions { bodies: Given::Wrenches(&pushes), ..*conditions };
        let lift = problem.lift(conditions.boundary);
        let effort = SolveEffort::of([&first, &second.flow]);
        let mut flow = flow_of(&problem, &both, &lift, &mut x, Vec::new(), &effort)?;
        flow.times = watch.times();
        Ok(flow)
    }
}

impl SolveEffort {
    /// That of two flows together, with the larger residual.
    fn of<const D: usize>([first, second]: [&Flow<D>; 2]) -> Self {
        Self {
            solve_count: first.solve_count + second.solve_count,
            iteration_count: first.iteration_count + second.iteration_count,
            residual: first.residual.max(second.residual),
            fine_operator_applications: first.fine_operator_applications + second.fine_operator_applications,
            traffic: first.solve_traffic + second.solve_traffic,
        }
    }
}
