//! Where all particles are known: the step is checked and partitioned there, and its outcome comes together.

use gluey_geom::{Dim, Space, Twist, Vector};

use crate::part::partition::{Motion, Partitioner};
use crate::part::{PartFrame, RankShare};
use crate::{Contact, ContactError, ContactParams, Domain, Mobility, PairContact, StepGeometry};

/// Contact of particles that ranks share, as the rank that knows all particles sees it.
///
/// A step begins with [`Coordinator::begin`]. While some rank found that the search had not gone far enough,
/// [`Coordinator::widen`] partitions the particles anew; then [`Coordinator::finish`] takes over what came of
/// it. Contacts and memory stay here, and change at the end of a step only.
#[derive(Debug)]
pub struct Coordinator<const D: usize, M> {
    /// The model on one rank, which has memory and surroundings.
    contact: PairContact<D, M>,
    dealer: Partitioner<D>,
    /// By particle.
    free: Vec<Vector<D>>,
    mobilities: Vec<f64>,
    widening: f64,
    frame: PartFrame<D>,
}

impl<const D: usize, M: Mobility<D>> Coordinator<D, M>
where
    Dim<D>: Space<D>,
{
    /// What `contact` does alone, for ranks.
    pub fn new(contact: PairContact<D, M>) -> Self {
        let (dealer, frame) = (Partitioner::default(), PartFrame::default());
        Self { contact, dealer, free: Vec::new(), mobilities: Vec::new(), widening: 1.0, frame }
    }

    /// The model on one rank.
    pub fn alone(&self) -> &PairContact<D, M> {
        &self.contact
    }

    /// The same, to change it between steps.
    pub fn alone_mut(&mut self) -> &mut PairContact<D, M> {
        &mut self.contact
    }

    /// The parameters.
    pub fn params(&self) -> &ContactParams {
        self.contact.params()
    }

    /// The walls and periods.
    pub fn domain(&self) -> &Domain<D> {
        self.contact.domain()
    }

    /// What all ranks know of the step that was begun.
    pub fn frame(&self) -> &PartFrame<D> {
        &self.frame
    }

    /// Checks a step, and deals its particles to so many ranks.
    ///
    /// # Errors
    /// Those of [`PairContact::correct`] that show before anything is solved.
    pub fn begin(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &[Twist<D>],
        rank_count: usize,
    ) -> Result<Vec<RankShare<D>>, ContactError> {
        let tolerance = self.contact.check(step, twists, &mut self.free)?;
        self.mobilities.clear();
        self.mobilities
            .extend((0..).zip(step.radii).map(|(i, &radius)| self.contact.own_mobility(i, radius)));
        self.widening = 1.0;
        self.frame = PartFrame {
            params: self.contact.params().clone(),
            domain: self.contact.domain().clone(),
            velocity_weight: step.velocity_weight,
            dt: step.dt,
            tolerance,
            wall_slack: 0.0,
        };
        self.partition(step, &self.free.clone(), rank_count)
    }

    /// Deals the particles anew, for a search that finds what these displacements (by particle) close.
    ///
    /// # Errors
    /// [`ContactError::TooFast`].
    pub fn widen(
        &mut self,
        step: &StepGeometry<'_, D>,
        needed: &[Vector<D>],
        rank_count: usize,
    ) -> Result<Vec<RankShare<D>>, ContactError> {
        self.widening *= 2.0;
        for wall in &self.frame.domain.walls {
            let farthest = needed.iter().map(|s| wall.normal.dot(s).abs()).fold(0.0, f64::max);
            self.frame.wall_slack = self.frame.wall_slack.max(farthest);
        }
        self.partition(step, needed, rank_count)
    }

    fn partition(
        &mut self,
        step: &StepGeometry<'_, D>,
        needed: &[Vector<D>],
        rank_count: usize,
    ) -> Result<Vec<RankShare<D>>, ContactError> {
        let motion = Motion {
            free: &self.free,
            needed,
            widening: self.widening,
            mobilities: &self.mobilities,
            memory: self.contact.memory(),
        };
        self.dealer.partition(step, &self.frame.domain, &motion, rank_count)
    }

    /// Displacements without contact of the step that was begun, by particle.
    pub fn free(&self) -> &[Vector<D>] {
        &self.free
    }

    /// Takes over the contacts of all ranks, and the memory they leave.
    pub fn finish(&mut self, contacts: Vec<Contact>) {
        self.contact.take_over_contacts(contacts);
    }
}
