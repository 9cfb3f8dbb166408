//! What the rank that knows all particles does with the model where ranks share the step.

use gluey_geom::{Dim, Space, Twist, Vector};

use super::{PairContact, free_moves};
use crate::model::validate;
use crate::{Contact, ContactError, Mobility, PairState, StepGeometry};

impl<const D: usize, M: Mobility<D>> PairContact<D, M>
where
    Dim<D>: Space<D>,
{
    /// Checks a step and what is remembered before it; writes the displacements without contact, and returns
    /// the residual to reach.
    pub(crate) fn check(
        &self,
        step: &StepGeometry<'_, D>,
        twists: &[Twist<D>],
        free: &mut Vec<Vector<D>>,
    ) -> Result<f64, ContactError> {
        validate(step, twists, &self.domain)?;
        self.check_memory(step)?;
        free.clear();
        free.extend(free_moves(step, twists));
        Ok(self.tolerance(step, free))
    }

    /// Velocity that a unit force gives a particle.
    pub(crate) fn own_mobility(&self, particle: usize, radius: f64) -> f64 {
        self.mobility.own(particle, radius)
    }

    /// What pairs remember.
    pub(crate) fn memory(&self) -> &[PairState] {
        &self.record.state.pairs
    }

    /// Takes over contacts of a step that others solved.
    pub(crate) fn take_over_contacts(&mut self, contacts: Vec<Contact>) {
        self.record.replace(|list| *list = contacts);
    }
}
