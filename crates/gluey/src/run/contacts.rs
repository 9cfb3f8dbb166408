//! The model of contact in runs.

use gluey_contact::{
    BodyStep, Contact, ContactError, ContactLaw, ContactModel, ContactParams, ContactReport, ContactState,
    Domain, MemoryError, PairContact, WithFixed,
};
use gluey_geom::{Dim, Space, Twist};

use crate::case::Case;
use crate::output::PairForces;

/// Contact among particles some of which may move as they are told: of one process, or shared by ranks.
pub(super) struct Contacts<'a, const D: usize>(Box<dyn Surrounded<D> + 'a>);

/// A model of contact that says within what.
pub(super) trait Surrounded<const D: usize>: ContactModel<D>
where
    Dim<D>: Space<D>,
{
    fn domain(&self) -> &Domain<D>;

    fn params(&self) -> &ContactParams;
}

/// The model of a case on one rank.
pub(super) fn of_case<const D: usize>(case: &Case) -> PairContact<D, WithFixed> {
    let fixed = WithFixed::new(case.given_particles());
    PairContact::with_mobility(case.contact.params(), fixed).within(case.surroundings())
}

impl<'a, const D: usize> Contacts<'a, D>
where
    Dim<D>: Space<D>,
{
    /// In one process.
    pub fn alone(case: &Case) -> Self {
        Self(Box::new(of_case(case)))
    }

    /// By this model.
    #[cfg(feature = "ranks")]
    pub fn by(model: impl Surrounded<D> + 'a) -> Self {
        Self(Box::new(model))
    }

    /// Walls and periods.
    pub fn domain(&self) -> &Domain<D> {
        self.0.domain()
    }

    /// Law and tuning.
    pub fn params(&self) -> &ContactParams {
        self.0.params()
    }

    /// What acts between the particles of a case after the last step.
    pub fn pair_forces(&self, case: &Case) -> PairForces<'_> {
        let has_law = self.params().law != ContactLaw::None;
        PairForces { contacts: has_law.then(|| self.contacts()), repulsion: case.repulsion() }
    }
}

impl<const D: usize> Surrounded<D> for PairContact<D, WithFixed>
where
    Dim<D>: Space<D>,
{
    fn domain(&self) -> &Domain<D> {
        self.domain()
    }

    fn params(&self) -> &ContactParams {
        self.params()
    }
}

#[cfg(feature = "ranks")]
impl<const D: usize> Surrounded<D> for gluey_distributed::SharedContact<'_, D>
where
    Dim<D>: Space<D>,
{
    fn domain(&self) -> &Domain<D> {
        self.domain()
    }

    fn params(&self) -> &ContactParams {
        self.params()
    }
}

impl<const D: usize> ContactModel<D> for Contacts<'_, D>
where
    Dim<D>: Space<D>,
{
    fn correct_bodies(
        &mut self,
        step: &BodyStep<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        self.0.correct_bodies(step, twists)
    }

    fn contacts(&self) -> &[Contact] {
        self.0.contacts()
    }

    fn checkpoint(&self) -> ContactState {
        self.0.checkpoint()
    }

    fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        self.0.resume(state)
    }

    fn reverse(&mut self) {
        self.0.reverse();
    }

    fn set_sliding(&mut self, tilt: f64, tilt_step: f64) {
        self.0.set_sliding(tilt, tilt_step);
    }
}
