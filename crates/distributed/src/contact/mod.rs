//! Contact of particles that ranks share.
//!
//! Rank zero leads here too: it knows all particles, deals them to ranks by space at each step, and has the
//! memory of contacts. Search, rows and islands are those of the ranks (`gluey_contact::part`).

mod messages;
mod partners;
mod words;

use std::rc::Rc;

use gluey_contact::part::{Coordinator, PartContact, PartFrame, RankShare};
use gluey_contact::{
    BodyStep, Contact, ContactError, ContactLaw, ContactModel, ContactParams, ContactReport, ContactState,
    Domain, MemoryError, PairContact, StepGeometry, WithFixed,
};
use gluey_geom::{Dim, Space, Twist, Vector};
use gluey_parallel::{Communicator, Ranks};

use crate::memory::Memory;
use crate::orders::Order;
use messages::{Verdict, collect, partition};
use partners::Sharers;
use words::Outcome;

/// Contacts between discs or spheres that ranks share, as rank zero sees them; the others are
/// [`ContactFollower`]s.
///
/// The velocity correction, which pushes one pair after the other, is done by rank zero alone, and so is
/// everything where there is one rank.
pub struct SharedContact<'a, const D: usize> {
    ranks: &'a Ranks,
    /// Knows whether the others, who follow a [`SharedSuspension`](crate::SharedSuspension), wait for this
    /// rank; none where they know themselves when a step comes.
    memory: Option<Rc<Memory<D>>>,
    lead: Coordinator<D, WithFixed>,
    part: PartContact<D>,
    load: ContactLoad,
    centers: [Vec<Vector<D>>; 2],
}

/// What ranks had in the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactLoad {
    /// Pairs of the rank that has most.
    pub most_pairs: usize,
    /// Pairs of all ranks.
    pub pair_count: usize,
    /// Pairs of all ranks in islands that reach across ranks.
    pub shared_pair_count: usize,
}

/// Does its part in the contacts that rank zero corrects with [`SharedContact`].
#[derive(Debug, Default)]
pub struct ContactFollower<const D: usize> {
    part: PartContact<D>,
}

/// Contact failed; rank zero has the error.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ContactFailure {
    /// What rank zero says of it.
    pub message: String,
}

/// What rank zero has to hear after a part of a step.
enum StepOutcome<const D: usize> {
    Done(Vec<Outcome<D>>),
    /// Displacements of all particles.
    Incomplete(Vec<Vector<D>>),
    Failed(ContactError),
}

impl<const D: usize> ContactFollower<D>
where
    Dim<D>: Space<D>,
{
    /// Takes part in one step.
    ///
    /// # Errors
    /// [`ContactFailure`], on all ranks.
    pub fn step(&mut self, ranks: &Ranks) -> Result<(), ContactFailure> {
        loop {
            match Verdict::hear(ranks) {
                Verdict::Deal(frame) => {
                    let shares = partition(ranks, Vec::new());
                    work(&mut self.part, &frame, &shares, ranks);
                }
                Verdict::Done => return Ok(()),
                Verdict::Failed(message) => return Err(ContactFailure { message }),
            }
        }
    }
}

/// Solves the part of a rank; what came of it on all ranks, for rank zero.
fn work<const D: usize>(
    part: &mut PartContact<D>,
    frame: &PartFrame<D>,
    shares: &RankShare<D>,
    ranks: &Ranks,
) -> Option<StepOutcome<D>>
where
    Dim<D>: Space<D>,
{
    match part.correct(frame, shares, &Sharers::new(ranks, shares)) {
        Ok(outcome) if outcome.is_complete => {
            let own = Outcome::of(&outcome, part, shares);
            Some(StepOutcome::Done(
                collect(ranks, &own.words())?.iter().filter_map(|w| Outcome::from_words(w)).collect(),
            ))
        }
        Ok(_) => {
            let own =
                shares.particles.iter().zip(part.displacements()).filter(|(of, _)| of.owner == shares.rank);
            let moves = own.map(|(particle, change)| (particle.index, *change)).collect();
            let own = Outcome { changes: moves, ..Outcome::default() };
            let all = collect(ranks, &own.words())?;
            let mut moves: Vec<_> = all
                .iter()
                .filter_map(|w| Outcome::from_words(w))
                .flat_map(|of: Outcome<D>| of.changes)
                .collect();
            moves.sort_unstable_by_key(|of| of.0);
            Some(StepOutcome::Incomplete(moves.into_iter().map(|of| of.1).collect()))
        }
        Err(failure) => {
            let all = collect(ranks, &failure.words())?;
            Some(StepOutcome::Failed(failure.of_all(&all)))
        }
    }
}

impl<'a, const D: usize> SharedContact<'a, D>
where
    Dim<D>: Space<D>,
{
    /// What `contact` does alone, with the ranks that each call [`ContactFollower::step`] at each step.
    pub fn new(contact: PairContact<D, WithFixed>, ranks: &'a Ranks) -> Self {
        let (part, load) = (PartContact::default(), ContactLoad::default());
        let centers = [Vec::new(), Vec::new()];
        Self { ranks, memory: None, lead: Coordinator::new(contact), part, load, centers }
    }

    /// The same with ranks that [follow](crate::SharedSuspension::follow), and the memory of the flow
    /// that they share.
    pub fn leading(contact: PairContact<D, WithFixed>, ranks: &'a Ranks, memory: Rc<Memory<D>>) -> Self {
        Self { memory: Some(memory), ..Self::new(contact, ranks) }
    }

    /// The parameters.
    pub fn params(&self) -> &ContactParams {
        self.lead.params()
    }

    /// The walls and periods.
    pub fn domain(&self) -> &Domain<D> {
        self.lead.domain()
    }

    /// What ranks had in the last step; nothing if rank zero did it alone.
    pub fn load(&self) -> ContactLoad {
        self.load
    }

    /// Whether other ranks take part in a step.
    pub fn is_shared(&self) -> bool {
        self.ranks.size() > 1 && matches!(self.lead.params().law, ContactLaw::Gluey | ContactLaw::Inelastic)
    }

    /// Corrects `twists`; on an error they and the memory are as before.
    ///
    /// # Errors
    /// Those of [`PairContact::correct`].
    pub fn correct(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        self.load = ContactLoad::default();
        if !self.is_shared() {
            return self.lead.alone_mut().correct(step, twists);
        }
        let memory = self.memory.clone();
        let is_sharing = |is_sharing| memory.iter().for_each(|memory| memory.is_sharing.set(is_sharing));
        is_sharing(true);
        if memory.is_some() {
            Order::Contact.share(self.ranks);
        }
        let solved = self.solve(step, twists);
        match &solved {
            Ok(_) => Verdict::<D>::Done.tell(self.ranks),
            Err(error) => Verdict::<D>::Failed(error.to_string()).tell(self.ranks),
        }
        is_sharing(false);
        Ok(self.take_over(solved?, twists))
    }

    /// What comes of a step on all ranks.
    fn solve(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &[Twist<D>],
    ) -> Result<Vec<Outcome<D>>, ContactError> {
        let mut shares = self.lead.begin(step, twists, self.ranks.size())?;
        loop {
            Verdict::Deal(self.lead.frame().clone()).tell(self.ranks);
            let own = partition(self.ranks, shares);
            match work(&mut self.part, self.lead.frame(), &own, self.ranks) {
                Some(StepOutcome::Done(outcomes)) => return Ok(outcomes),
                Some(StepOutcome::Incomplete(moves)) => {
                    shares = self.lead.widen(step, &moves, self.ranks.size())?;
                }
                Some(StepOutcome::Failed(error)) => return Err(error),
                None => return Ok(Vec::new()),
            }
        }
    }

    fn take_over(&mut self, outcomes: Vec<Outcome<D>>, twists: &mut [Twist<D>]) -> ContactReport {
        let mut report = ContactReport::default();
        let mut contacts = Vec::with_capacity(outcomes.iter().map(|of| of.contacts.len()).sum());
        for of_rank in outcomes {
            report = report.joined(of_rank.report);
            self.load.most_pairs = self.load.most_pairs.max(of_rank.report.pair_count);
            self.load.shared_pair_count += of_rank.shared_row_count;
            for (index, change) in of_rank.changes {
                twists[index as usize].velocity += change;
            }
            contacts.extend(of_rank.contacts);
        }
        self.load.pair_count = report.pair_count;
        self.lead.finish(contacts);
        report
    }
}

impl<const D: usize> ContactModel<D> for SharedContact<'_, D>
where
    Dim<D>: Space<D>,
{
    fn correct_bodies(
        &mut self,
        step: &BodyStep<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        let mut centers = std::mem::take(&mut self.centers);
        let [positions, drift] = &mut centers;
        positions.clear();
        positions.extend(step.poses.iter().map(|pose| pose.position));
        drift.clear();
        drift.extend(step.drift.iter().map(|drift| drift.velocity));
        let (radii, velocity_weight, dt) = (step.radii, step.velocity_weight, step.dt);
        let outcome = self.correct(&StepGeometry { positions, radii, drift, velocity_weight, dt }, twists);
        self.centers = centers;
        outcome
    }

    fn contacts(&self) -> &[Contact] {
        self.lead.alone().contacts()
    }

    fn checkpoint(&self) -> ContactState {
        self.lead.alone().checkpoint()
    }

    fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        self.lead.alone_mut().resume(state)
    }

    fn reverse(&mut self) {
        self.lead.alone_mut().reverse();
    }

    fn set_sliding(&mut self, tilt: f64, tilt_step: f64) {
        self.lead.alone_mut().set_sliding(tilt, tilt_step);
    }
}
