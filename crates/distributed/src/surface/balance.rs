//! Flows without mean flow around bodies that are held in a box without walls, as in the serial solver: the
//! flow is linear in a uniform force on fluid and bodies, and the matrix of the mean velocities that unit
//! forces drive is the permeability.

use gluey_fem::{Cuts, ImplicitTree};
use gluey_geom::{Dim, Matrix, Space, Vector};
use gluey_parallel::Communicator;
use gluey_stokes::{Conditions, GivenOf, StokesError};

use super::SurfaceBodies;
use crate::flow::{BoxFlow, FlowError, MyFlow};

impl BoxFlow {
    /// The flow with a uniform force so that nothing flows on the mean. All ranks call this.
    ///
    /// # Errors
    /// [`FlowError`], on all ranks. [`FlowError::Conditions`] unless bodies are held in a box without walls,
    /// and for stresses.
    pub(super) fn balanced<const D: usize>(
        &self,
        around: &SurfaceBodies<'_, D>,
        tree: &mut ImplicitTree<'_, D>,
        cuts: &Cuts,
        ranks: &dyn Communicator,
        conditions: &Conditions<'_, D>,
    ) -> Result<MyFlow<D>, FlowError>
    where
        Dim<D>: Space<D>,
    {
        let held = conditions.held(around.balls.len());
        if held.is_empty() || conditions.stress || tree.frame().periodic().contains(&false) {
            return Err(FlowError::Conditions);
        }
        let mut solve = |conditions: &Conditions<'_, D>| {
            self.solve_around_surfaces(around, tree, cuts, ranks, conditions)
        };
        let mut flow = solve(&Conditions { without_mean: false, ..*conditions })?;
        let at_rest: Vec<GivenOf<D>> = held.into_iter().map(GivenOf::at_rest).collect();
        let (mut permeability, mut driven) = (Matrix::<D>::zeros(), Vec::new());
        for axis in 0..D {
            let unit = Vector::<D>::from_fn(|d, _| if d == axis { 1.0 } else { 0.0 });
            let force = |_: &Vector<D>| unit;
            let one = solve(&Conditions::at_rest().with_force(Some(&force)).with_bodies(&at_rest))?;
            permeability.set_column(axis, &one.mean_velocity.unwrap_or_else(Vector::zeros));
            driven.push(one);
        }
        let Some(inverse) = permeability.try_inverse() else {
            let what = "flows without mean flow around bodies that let nothing through";
            return Err(StokesError::Unsupported { what }.into());
        };
        let mean = flow.mean_velocity.unwrap_or_else(Vector::zeros);
        flow.mean_force = -(inverse * mean);
        for (factor, driven) in flow.mean_force.iter().copied().collect::<Vec<f64>>().into_iter().zip(&driven)
        {
            flow.add(factor, driven);
        }
        flow.mean_velocity = Some(mean + permeability * flow.mean_force);
        Ok(flow)
    }
}
