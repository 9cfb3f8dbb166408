//! Repulsion in a simulation: forces on the particles where they are, their stress, and what a step has
//! beyond.

use gluey_contact::{
    BodyStep, ContactError, ContactModel, ContactState, Domain, FlowContact, FlowContactParams, FlowForces,
    MemoryError, NormalLaw, Repulsion, TwistMobility,
};
use gluey_geom::{Matrix, Particle, Twist, Wrench};
use gluey_suspension::{Repelled, repelled};

/// Particles that repel each other, and the walls.
#[derive(Debug)]
pub(super) struct Repelling<const D: usize> {
    law: Repulsion,
    surroundings: Domain<D>,
    /// Makes steps of any length possible, where no contact in the flow does.
    implicit: FlowContact<D>,
}

impl<const D: usize> Repelling<D> {
    /// Particles that repel each other by this law, and the walls of their surroundings.
    pub fn new(law: Repulsion, surroundings: Domain<D>) -> Self {
        let params = FlowContactParams { law: NormalLaw::None, ..FlowContactParams::default() };
        let mut implicit = FlowContact::new(params, surroundings.clone());
        implicit.set_repulsion(law);
        Self { law, surroundings, implicit }
    }

    /// The forces between particles where they are now, with a lattice of this tilt; and their stress, minus
    /// the mean product of forces and lines between centres.
    pub fn between(&mut self, particles: &[Particle<D>], tilt: f64) -> (Vec<Wrench<D>>, Matrix<D>) {
        self.surroundings.set_sliding(tilt, 0.0);
        let Repelled { forces, moment } = repelled(&self.law, particles, &self.surroundings);
        let volume: f64 = self.surroundings.lattice.periods().iter().flatten().product();
        let wrenches = forces.into_iter().map(|force| Wrench { force, ..Wrench::default() }).collect();
        (wrenches, -moment / volume)
    }

    /// Changes motions with the forces of the beginning of a step to those with the forces of the step.
    ///
    /// # Errors
    /// If there are no such forces.
    pub fn correct(
        &mut self,
        [tilt, tilt_step, rate]: [f64; 3],
        step: &BodyStep<'_, D>,
        mobility: &mut dyn TwistMobility<D>,
        twists: &mut [Twist<D>],
    ) -> Result<(), ContactError> {
        self.implicit.set_surroundings(tilt, tilt_step, 1.0);
        self.implicit.set_rate(rate);
        self.implicit.begin(step)?;
        self.implicit.correct(step, mobility, twists).map(|_| ())
    }

    /// Ends a step.
    pub fn finish(&mut self) {
        self.implicit.finish();
    }

    /// What the next step depends on.
    pub fn checkpoint(&self) -> ContactState {
        self.implicit.checkpoint()
    }

    /// Goes on from there.
    pub fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        self.implicit.resume(state)
    }
}
