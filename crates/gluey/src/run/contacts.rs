//! The model of contact in runs: of one process, or shared by ranks.

use gluey_contact::{
    BodyStep, Contact, ContactError, ContactForce, ContactModel, ContactNetwork, ContactParams,
    ContactReport, ContactState, Domain, FlowContact, FlowForces, MemoryError, PairContact, Wall, WithFixed,
};
use gluey_geom::{Particle, Twist, Vector};

use crate::case::{Case, Strategy};
use crate::output::PairForces;

/// A model of contact that says within what.
pub(super) trait Surrounded<const D: usize>: ContactModel<D> {
    /// Walls and periods.
    fn domain(&self) -> &Domain<D>;

    /// Law and tuning.
    fn params(&self) -> &ContactParams;

    /// What acts between the particles of a case after the last step.
    fn pair_forces(&self, case: &Case) -> PairForces<'_, D> {
        let has_law = case.contact.strategy != Strategy::None;
        let contacts = has_law.then(|| self.contacts());
        PairForces { contacts, in_flow: self.forces_in_flow(), repulsion: case.repulsion() }
    }

    /// The forces of contacts after the last step over `6 pi eta`, one for each, where they act in the flow.
    fn forces_in_flow(&self) -> Option<Vec<ContactForce<D>>> {
        None
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

/// The model of a case: velocities corrected after the flow by `P`, or forces that act in it.
#[derive(Debug)]
pub(super) enum CaseContact<const D: usize, P> {
    AfterFlow(P),
    InFlow(Box<FlowContact<D>>, ContactParams),
}

impl<const D: usize, P> CaseContact<D, P> {
    /// That of a case, where `after_flow` makes a model of that of one rank, in which some particles may move
    /// as they are told.
    pub fn of_case(case: &Case, after_flow: impl FnOnce(PairContact<D, WithFixed>) -> P) -> Self {
        let params = case.contact.params();
        if let Some(in_flow) = case.flow_contact() {
            let domain = case.surroundings();
            let along = |wall: &Wall<D>| case.velocity_of_wall(wall);
            let along = domain.walls.iter().map(along).collect();
            let contact = FlowContact::new(in_flow, domain).with_walls_along(along);
            return Self::InFlow(Box::new(contact), params);
        }
        let fixed = WithFixed::new(case.given_particles());
        Self::AfterFlow(after_flow(PairContact::with_mobility(params, fixed).within(case.surroundings())))
    }
}

/// What both kinds of models do alike.
macro_rules! delegate {
    ($self:ident, $model:ident => $call:expr) => {
        match $self {
            Self::AfterFlow($model) => $call,
            Self::InFlow($model, _) => $call,
        }
    };
}

impl<const D: usize, P: ContactModel<D>> ContactModel<D> for CaseContact<D, P> {
    fn correct_bodies(
        &mut self,
        step: &BodyStep<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        delegate!(self, model => model.correct_bodies(step, twists))
    }

    fn contacts(&self) -> &[Contact] {
        delegate!(self, model => model.contacts())
    }

    fn checkpoint(&self) -> ContactState {
        delegate!(self, model => model.checkpoint())
    }

    fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        delegate!(self, model => model.resume(state))
    }

    fn reverse(&mut self) {
        delegate!(self, model => model.reverse())
    }

    fn set_sliding(&mut self, tilt: f64, tilt_step: f64) {
        delegate!(self, model => model.set_sliding(tilt, tilt_step))
    }

    fn in_flow(&mut self) -> Option<&mut dyn FlowForces<D>> {
        delegate!(self, model => model.in_flow())
    }
}

impl<const D: usize, P: Surrounded<D>> Surrounded<D> for CaseContact<D, P> {
    fn domain(&self) -> &Domain<D> {
        delegate!(self, model => model.domain())
    }

    fn params(&self) -> &ContactParams {
        match self {
            Self::AfterFlow(model) => model.params(),
            Self::InFlow(_, params) => params,
        }
    }

    fn forces_in_flow(&self) -> Option<Vec<ContactForce<D>>> {
        match self {
            Self::AfterFlow(_) => None,
            Self::InFlow(model, _) => Some(model.forces_of_contacts()),
        }
    }
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
