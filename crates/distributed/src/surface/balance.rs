//! Flows without mean flow around bodies that are held in a box without walls, as in the serial solver: the
//! flow is linear in a uniform force on fluid and bodies, and the matrix of the mean velocities that unit
//! forces drive is the permeability.

use std::sync::Arc;

use gluey_geom::{Dim, Matrix, Space, Vector};
use gluey_stokes::{Conditions, GivenOf, StokesError};

use super::{SharedTree, SurfaceBodies};
use crate::flow::{BoxFlow, FlowError, MyFlow};
use crate::warm_start::WarmStart;

impl BoxFlow {
    /// The flow with a uniform force so that nothing flows on the mean; what is kept is the flow without that
    /// force. All ranks call this.
    ///
    /// # Errors
    /// [`FlowError`], on all ranks. [`FlowError::Conditions`] unless bodies are held in a box without walls,
    /// and for stresses.
    pub(super) fn balanced<const D: usize>(
        &self,
        around: &SurfaceBodies<'_, D>,
        leaves: &mut SharedTree<'_, '_, D>,
        conditions: &Conditions<'_, D>,
        kept: Option<&mut Option<Arc<WarmStart<D>>>>,
    ) -> Result<MyFlow<D>, FlowError>
    where
        Dim<D>: Space<D>,
    {
        let held = conditions.held(around.balls.len());
        if held.is_empty() || conditions.stress || leaves.tree.frame().periodic().contains(&false) {
            return Err(FlowError::Conditions);
        }
        let first = Conditions { without_mean: false, ..*conditions };
        let mut flow = self.solve_from(around, leaves, &first, kept)?;
        let at_rest: Vec<GivenOf<D>> = held.into_iter().map(GivenOf::at_rest).collect();
        let (mut permeability, mut driven) = (Matrix::<D>::zeros(), Vec::new());
        for axis in 0..D {
            let unit = Vector::<D>::from_fn(|d, _| if d == axis { 1.0 } else { 0.0 });
            let force = |_: &Vector<D>| unit;
            let conditions = Conditions::at_rest().with_force(Some(&force)).with_bodies(&at_rest);
            let one = self.solve_from(around, leaves, &conditions, None)?;
            permeability.set_column(axis, &one.mean_velocity.unwrap_or_else(Vector::zeros));
            driven.push(one);
        }
        let Some(inverse) = permeability.try_inverse() else {
            let what = "flows without mean flow around bodies that let nothing through";
            return Err(FlowError::of_all(StokesError::Unsupported { what }));
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
