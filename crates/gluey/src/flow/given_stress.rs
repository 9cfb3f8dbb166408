//! Shear at a given stress: the rate follows.
//!
//! The mean shear stress is `r A + B`, with `A` of the flow at the rate one and `B` of the flow that forces
//! between particles make at rest, their own share included. Both are solved for on one mesh, so the rate
//! `r = (sigma - B) / A` is exact. Velocities count by the strain, `u_1 + u_2 / r`, as at the rate one.
//! Contacts scale with the flow; their stress is known after the step only and is no part of what is given.

use gluey_fem::TreeMesh;
use gluey_geom::{Dim, Matrix, Space};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, Flow, Stress};

use super::StokesFlow;
use super::error::FlowError;

impl<const D: usize> StokesFlow<D>
where
    Dim<D>: Space<D>,
{
    /// The flow in a sheared box at the stress that is given, its velocities by the strain.
    pub(super) fn solve_at_stress(
        &mut self,
        mesh: TreeMesh<D>,
        balls: &[Ball<D>],
    ) -> Result<Flow<D>, FlowError> {
        let Some(mut control) = self.control else { return self.solve_sheared(mesh, balls, &[], true) };
        let mut gradient = Matrix::<D>::zeros();
        gradient[(0, 1)] = self.rate();
        let (direction, volume) = (self.rate(), self.domain.extent().product());
        let viscosity = self.params.viscosity;
        let of_bodies =
            move |flow: &Flow<D>| flow.stress.as_ref().map(|stress: &Stress<D>| stress.of_bodies(volume));
        let shear_stress = move |flow: &Flow<D>| of_bodies(flow).map_or(0.0, |stress| stress[(0, 1)]);
        let at_rate_one = move |flow: &Flow<D>| viscosity * direction + shear_stress(flow);
        let conditions = Conditions::in_linear_flow(&gradient).with_stress();
        let mut rate = None;
        let inverse_rate = |sheared: &Flow<D>, pushed: &Flow<D>| {
            let at_rest = control.pair_stress[(0, 1)] + shear_stress(pushed);
            let found = (direction * control.stress - at_rest) / at_rate_one(sheared);
            rate = Some(found);
            match found > 0.0 {
                true => Ok(found.recip()),
                false => Err(FlowError::NotDriven { stress: control.stress, at_rest: direction * at_rest }),
            }
        };
        let acts = self.acting.iter().any(|wrench| wrench.force.amax() > 0.0);
        let pushes = if acts { &self.acting[..] } else { &[] };
        let flow = self.solver.solve_combined(mesh, balls, &conditions, pushes, inverse_rate)?;
        control.rate = rate.unwrap_or_else(|| direction * control.stress / at_rate_one(&flow));
        self.control = Some(control);
        Ok(flow)
    }
}
