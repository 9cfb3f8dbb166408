//! The model of contact in runs: of one process, or shared by ranks.

use gluey_contact::{
    ContactError, ContactLaw, ContactModel, ContactNetwork, ContactParams, Domain, PairContact, WithFixed,
};
use gluey_geom::{Particle, Vector};

use crate::case::Case;
use crate::output::PairForces;

/// A model of contact that says within what.
pub(super) trait Surrounded<const D: usize>: ContactModel<D> {
    /// Walls and periods.
    fn domain(&self) -> &Domain<D>;

    /// Law and tuning.
    fn params(&self) -> &ContactParams;

    /// What acts between the particles of a case after the last step.
    fn pair_forces(&self, case: &Case) -> PairForces<'_> {
        let has_law = self.params().law != ContactLaw::None;
        PairForces { contacts: has_law.then(|| self.contacts()), repulsion: case.repulsion() }
    }

    /// What is taken of the network of contacts between particles where they are now.
    ///
    /// # Errors
    /// If the contacts are not those of these particles.
    fn of_network<T>(
        &self,
        particles: &[Particle<D>],
        take: impl FnOnce(&ContactNetwork<'_, D>) -> T,
    ) -> Result<T, ContactError> {
        let centers: Vec<Vector<D>> = particles.iter().map(|particle| particle.pose.position).collect();
        let radii: Vec<f64> = particles.iter().map(|particle| particle.radius).collect();
        Ok(take(&ContactNetwork::new(self.contacts(), &centers, &radii, self.domain())?))
    }
}

/// The model of a case on one rank, where some particles may move as they are told.
pub(super) fn of_case<const D: usize>(case: &Case) -> PairContact<D, WithFixed> {
    let fixed = WithFixed::new(case.given_particles());
    PairContact::with_mobility(case.contact.params(), fixed).within(case.surroundings())
}

impl<const D: usize> Surrounded<D> for PairContact<D, WithFixed> {
    fn domain(&self) -> &Domain<D> {
        self.domain()
    }

    fn params(&self) -> &ContactParams {
        self.params()
    }
}

#[cfg(feature = "ranks")]
impl<const D: usize> Surrounded<D> for gluey_distributed::SharedContact<'_, D> {
    fn domain(&self) -> &Domain<D> {
        self.domain()
    }

    fn params(&self) -> &ContactParams {
        self.params()
    }
}
