//! Particles that are held or driven: what the flow is told of them, and what that takes.

use gluey_geom::{Dim, Particle, Space, Twist, Vector};
use gluey_motion::Holding;
use gluey_stokes::GivenOf;

use super::StokesFlow;

impl<const D: usize> StokesFlow<D>
where
    Dim<D>: Space<D>,
{
    /// The motion that is given to a particle now; `None` for one that is free.
    pub(super) fn given_twist(&self, particle: usize) -> Option<Twist<D>> {
        let twist = self.given.get(particle).copied().flatten()?;
        Some(twist * self.shear_factor)
    }

    /// What is known of each body in a flow relative to one that moves with `undisturbed` at its centre; no
    /// entries where all are free.
    pub(super) fn given_bodies(
        &self,
        particles: &[Particle<D>],
        undisturbed: impl Fn(&Vector<D>) -> Twist<D>,
    ) -> Vec<GivenOf<D>> {
        let wrench = |particle: usize| self.acting.get(particle).copied().unwrap_or_default();
        let of_body = |(index, particle): (usize, &Particle<D>)| match self.given_twist(index) {
            Some(twist) => GivenOf::Twist(twist - undisturbed(&particle.pose.position)),
            None => GivenOf::Wrench(wrench(index)),
        };
        match self.given.is_empty() {
            true => Vec::new(),
            false => particles.iter().enumerate().map(of_body).collect(),
        }
    }

    /// What held the particles whose motions are given in the last flow.
    pub(super) fn last_holding(&self) -> Option<Holding<D>> {
        let flow = self.last.as_ref()?;
        let acting = |particle: usize| self.acting.get(particle).copied().unwrap_or_default();
        let held = self.given.iter().enumerate().filter(|(_, given)| given.is_some());
        Some(Holding {
            mean_velocity: flow.mean_velocity?,
            force_density: flow.mean_force + self.force_density.unwrap_or_else(Vector::zeros),
            wrenches: held.map(|(index, _)| (index, flow.wrenches[index] - acting(index))).collect(),
        })
    }
}
