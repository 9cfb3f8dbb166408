//! Contact of particles that ranks share.
//!
//! All ranks know all particles and the memory of all contacts. Search, rows and islands are those of each
//! (`gluey_contact::part`); what comes of a step goes to all.

mod partners;

use gluey_contact::part::{Centers, PartContact, PartOutcome, RankOf};
use gluey_contact::{
    BodyStep, Contact, ContactError, ContactLaw, ContactModel, ContactParams, ContactReport, ContactState,
    Domain, MemoryError, PairContact, StepGeometry, WithFixed,
};
use gluey_geom::{Dim, Twist};
use gluey_parallel::{Communicator, Ranks};

use partners::{Sharers, all_of};

/// Contacts between discs or spheres that ranks share, all of which call the same methods with the same
/// numbers.
///
/// The velocity correction, which pushes one pair after the other, is done by each rank for itself, and so is
/// everything where there is one rank.
pub struct SharedContact<'a, const D: usize> {
    ranks: &'a Ranks,
    contact: PartContact<D, WithFixed>,
    load: ContactLoad,
    centers: Centers<D>,
}

/// Work of ranks in the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactLoad {
    /// Pairs of the rank that has most.
    pub most_pairs: usize,
    /// Pairs of all ranks.
    pub pair_count: usize,
    /// Pairs of all ranks in islands that reach across ranks.
    pub shared_pair_count: usize,
}

impl<'a, const D: usize> SharedContact<'a, D> {
    /// What `contact` does alone, by ranks.
    pub fn new(contact: PairContact<D, WithFixed>, ranks: &'a Ranks) -> Self {
        let (contact, load) = (PartContact::new(contact), ContactLoad::default());
        Self { ranks, contact, load, centers: Centers::default() }
    }

    /// The parameters.
    pub fn params(&self) -> &ContactParams {
        self.contact.alone().params()
    }

    /// The walls and periods.
    pub fn domain(&self) -> &Domain<D> {
        self.contact.alone().domain()
    }

    /// The work in the last step; none if each rank did it alone.
    pub fn load(&self) -> ContactLoad {
        self.load
    }

    /// Whether ranks have a part each in a step.
    pub fn is_shared(&self) -> bool {
        self.ranks.size() > 1 && matches!(self.params().law, ContactLaw::Gluey | ContactLaw::Inelastic)
    }

    /// Corrects `twists`, which are those of rank zero then; on an error they and the memory are as before.
    ///
    /// # Errors
    /// Those of [`PairContact::correct`], on all ranks.
    pub fn correct(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        self.load = ContactLoad::default();
        share_twists(self.ranks, twists);
        if !self.is_shared() {
            return self.contact.alone_mut().correct(step, twists);
        }
        self.contact.begin(step, twists)?;
        let rank = RankOf { rank: self.ranks.rank(), size: self.ranks.size() };
        loop {
            let share = self.contact.share(step, rank)?;
            let solved = self.contact.solve(step, &share, &Sharers::new(self.ranks, &share));
            let outcomes = match solved {
                Ok(outcome) => all_of(self.ranks, &outcome),
                Err(failure) => {
                    let told = all_of(self.ranks, &failure.here().cloned());
                    return Err(failure.of_all(told));
                }
            };
            if let Some(report) = self.finish(outcomes, twists) {
                return Ok(report);
            }
        }
    }

    /// Takes over what came of a step on all ranks; nothing where they have to search farther.
    fn finish(&mut self, outcomes: Vec<PartOutcome<D>>, twists: &mut [Twist<D>]) -> Option<ContactReport> {
        let (mut joined, mut is_complete) = (ContactReport::default(), true);
        let (mut all_contacts, mut all_moves) = (Vec::new(), Vec::new());
        for outcome in outcomes {
            match outcome {
                PartOutcome::Complete { report, shared_row_count, changes, contacts } => {
                    joined = joined.joined(report);
                    self.load.most_pairs = self.load.most_pairs.max(report.pair_count);
                    self.load.shared_pair_count += shared_row_count;
                    changes.iter().for_each(|(index, change)| twists[*index as usize].velocity += change);
                    all_contacts.extend(contacts);
                }
                PartOutcome::Incomplete(moves) => {
                    is_complete = false;
                    all_moves.extend(moves);
                }
            }
        }
        self.load.pair_count = joined.pair_count;
        match is_complete {
            true => self.contact.finish(all_contacts),
            false => self.contact.widen(all_moves),
        }
        is_complete.then_some(joined)
    }
}

/// Replaces twists by those of rank zero: what was computed beside it by another machine may differ in the
/// last bit.
fn share_twists<const D: usize>(ranks: &Ranks, twists: &mut [Twist<D>]) {
    let of_twist = |twist: &Twist<D>| [twist.velocity.as_slice(), Dim::<D>::spin_slice(&twist.spin)].concat();
    let mut numbers: Vec<f64> = twists.iter().flat_map(of_twist).collect();
    ranks.share(&mut numbers);
    for (twist, said) in twists.iter_mut().zip(numbers.chunks_exact(D + Dim::<D>::ROT)) {
        twist.velocity.copy_from_slice(&said[..D]);
        (0..Dim::<D>::ROT).for_each(|k| twist.spin[k] = said[D + k]);
    }
}

impl<const D: usize> ContactModel<D> for SharedContact<'_, D> {
    fn correct_bodies(
        &mut self,
        step: &BodyStep<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        let mut centers = std::mem::take(&mut self.centers);
        let outcome = self.correct(&centers.of(step), twists);
        self.centers = centers;
        outcome
    }

    fn contacts(&self) -> &[Contact] {
        self.contact.alone().contacts()
    }

    fn checkpoint(&self) -> ContactState {
        self.contact.alone().checkpoint()
    }

    fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        self.contact.alone_mut().resume(state)
    }

    fn reverse(&mut self) {
        self.contact.alone_mut().reverse();
    }

    fn set_sliding(&mut self, tilt: f64, tilt_step: f64) {
        self.contact.alone_mut().set_sliding(tilt, tilt_step);
    }
}
