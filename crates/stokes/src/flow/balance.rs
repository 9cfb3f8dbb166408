//! Flows without mean flow around bodies that are held in a box without walls.
//!
//! What is held takes up any force, so that the mean gradient of the pressure has to be given, or the mean
//! velocity: then a uniform force `g` on fluid and bodies is sought. The flow is linear in it, `u = u_0 +
//! sum_d g_d u_d`, with the flows `u_d` around bodies at rest that the force `e_d` drives, and `g` makes the
//! mean vanish. The matrix of the mean velocities of the `u_d` is the permeability, symmetric and positive
//! definite.

use std::sync::Arc;

use gluey_geom::{Matrix, Vector};
use gluey_linalg::vector;

use super::conditions::{Conditions, GivenOf};
use super::{Flow, FlowSolver};
use crate::error::StokesError;
use crate::formulation::{Method, Problem};

impl<const D: usize> FlowSolver<D> {
    /// The flow with a uniform force so that nothing flows on the mean, for one without it. Whether penalties
    /// were raised on the way is told too.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] unless bodies are held by their surfaces in a box without walls, and for
    /// stresses; those of the solves.
    pub(super) fn balanced(
        &mut self,
        problem: &mut Problem<D>,
        method: &mut Arc<dyn Method<D>>,
        conditions: &Conditions<'_, D>,
        mut flow: Flow<D>,
    ) -> Result<(Flow<D>, bool), StokesError> {
        let unsupported = |what| Err(StokesError::Unsupported { what });
        let has_walls = problem.discretisation().mesh.periodic().contains(&false);
        let (Some(mean), false) = (flow.mean_velocity, has_walls) else {
            return unsupported("flows without mean flow, but around held bodies in boxes without walls,");
        };
        if conditions.stress {
            return unsupported("stresses of flows without mean flow around held bodies");
        }
        let held = conditions.held(problem.all_bodies.len());
        let at_rest: Vec<GivenOf<D>> = held.into_iter().map(GivenOf::at_rest).collect();
        let (mut permeability, mut driven, mut is_raised) = (Matrix::<D>::zeros(), Vec::new(), false);
        for axis in 0..D {
            let unit = Vector::<D>::from_fn(|d, _| if d == axis { 1.0 } else { 0.0 });
            let force = |_: &Vector<D>| unit;
            let conditions = Conditions::at_rest().with_force(Some(&force)).with_bodies(&at_rest);
            let guess = vec![0.0; problem.system.dim()];
            let adapted = self.solve_with_adaptive_penalty(problem, method, &conditions, &guess)?;
            is_raised |= adapted.is_raised;
            permeability.set_column(axis, &adapted.flow.mean_velocity.unwrap_or_else(Vector::zeros));
            driven.push(adapted.flow);
        }
        let Some(inverse) = permeability.try_inverse() else {
            return unsupported("flows without mean flow around bodies that let nothing through");
        };
        flow.mean_force = -(inverse * mean);
        let factors: Vec<f64> = flow.mean_force.iter().copied().collect();
        for (factor, driven) in factors.into_iter().zip(&driven) {
            add(&mut flow, factor, driven);
        }
        flow.mean_velocity = Some(mean + permeability * flow.mean_force);
        Ok((flow, is_raised))
    }
}

/// Adds a multiple of a flow around the same bodies on the same mesh.
fn add<const D: usize>(flow: &mut Flow<D>, factor: f64, other: &Flow<D>) {
    vector::axpy(factor, &other.velocity, &mut flow.velocity);
    vector::axpy(factor, &other.pressure, &mut flow.pressure);
    let twists = flow.twists.iter_mut().zip(&other.twists);
    twists.for_each(|(twist, other)| *twist = *twist + *other * factor);
    let wrenches = flow.wrenches.iter_mut().zip(&other.wrenches);
    wrenches.for_each(|(wrench, other)| *wrench = *wrench + *other * factor);
    for (film, other) in flow.films.iter_mut().zip(&other.films) {
        let sides = film.wrenches.iter_mut().zip(&other.wrenches);
        sides.for_each(|(wrench, other)| *wrench = *wrench + *other * factor);
    }
    flow.solve_count += other.solve_count;
    flow.iteration_count += other.iteration_count;
    flow.fine_operator_applications += other.fine_operator_applications;
    flow.solve_traffic = flow.solve_traffic + other.solve_traffic;
}
