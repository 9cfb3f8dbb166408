//! The contact step of one of several ranks, on its own particles and copies of others.

use gluey_geom::{Dim, Space, Vector};

use super::{Buffers, PairContact, PairMemory, Participation};
use crate::island_projection::{IslandWorkspace, SharedContext};
use crate::islands::{Grouping, Islands, SortedParticles};
use crate::memory::GammaRule;
use crate::neighbours::{Ownership, PartSearch};
use crate::part::{PartFailure, PartFrame, PartMemory, PartOutcome, Partners, RankShare};
use crate::projection::Failure;
use crate::rows::{GROUND, Row};
use crate::solver::ELSEWHERE;
use crate::{
    Contact, ContactError, ContactParams, ContactReport, Mobility, PairKey, PairState, Partner, StepGeometry,
};

/// Mobilities as they are told.
#[derive(Clone, Debug, Default)]
struct ReplicatedMobility(Vec<f64>);

impl<const D: usize> Mobility<D> for ReplicatedMobility {
    fn own(&self, particle: usize, _radius: f64) -> f64 {
        self.0[particle]
    }
}

/// Contact of the particles of one rank: see [`crate::part`].
#[derive(Debug)]
pub struct PartContact<const D: usize> {
    contact: PairContact<D, ReplicatedMobility>,
    particles: Particles<D>,
    /// Rows in islands that reach across ranks.
    shared: Islands<D>,
    workspace: IslandWorkspace<D>,
    shared_rows: Vec<Row<D>>,
    /// Of each place: how many ranks have rows on it (in the first component), whether this one has.
    touches: Vec<Vector<D>>,
    is_touched: Vec<bool>,
    /// Whether rows that are set apart are new.
    has_fresh: bool,
}

/// The particles of the rank, by place.
#[derive(Debug, Default)]
struct Particles<const D: usize> {
    positions: Vec<Vector<D>>,
    free: Vec<Vector<D>>,
    radii: Vec<f64>,
    reach: Vec<f64>,
    ownership: Ownership,
}

impl<const D: usize> Default for PartContact<D> {
    fn default() -> Self {
        Self {
            contact: PairContact::with_mobility(ContactParams::default(), ReplicatedMobility::default()),
            particles: Particles::default(),
            shared: Islands::default(),
            workspace: IslandWorkspace::default(),
            shared_rows: Vec::new(),
            touches: Vec::new(),
            is_touched: Vec::new(),
            has_fresh: false,
        }
    }
}

impl<const D: usize> PartContact<D>
where
    Dim<D>: Space<D>,
{
    /// Solves for the contacts of a step. All ranks call this with the same frame.
    ///
    /// # Errors
    /// [`PartFailure`], on all ranks.
    pub fn correct(
        &mut self,
        frame: &PartFrame<D>,
        shares: &RankShare<D>,
        partners: &dyn Partners<D>,
    ) -> Result<PartOutcome, PartFailure> {
        let mut buffers = std::mem::take(&mut self.contact.buffers);
        let outcome = self.step(frame, shares, partners, &mut buffers);
        self.contact.buffers = buffers;
        outcome
    }

    /// The contacts of this rank's pairs after the last step, sorted.
    pub fn contacts(&self) -> &[Contact] {
        &self.contact.record.contacts
    }

    /// Changes of the velocities in the last step, one for each particle that was sent here.
    pub fn changes(&self) -> &[Vector<D>] {
        &self.contact.buffers.changes
    }

    /// Displacements in the last step, one for each particle that was sent here.
    pub fn displacements(&self) -> &[Vector<D>] {
        &self.contact.buffers.displacements
    }

    /// Pairs and walls that the last search found for this rank, and what is remembered besides.
    pub fn candidates(&self) -> impl Iterator<Item = PairKey> {
        let neighbours = &self.contact.neighbours;
        neighbours.candidates.iter().map(|candidate| neighbours.key(candidate))
    }

    fn step(
        &mut self,
        frame: &PartFrame<D>,
        shares: &RankShare<D>,
        partners: &dyn Partners<D>,
        buffers: &mut Buffers<D>,
    ) -> Result<PartOutcome, PartFailure> {
        self.load(frame, shares);
        let mut particles = std::mem::take(&mut self.particles);
        let mut ownership = std::mem::take(&mut particles.ownership);
        let step = StepGeometry {
            positions: &particles.positions,
            radii: &particles.radii,
            drift: &[],
            velocity_weight: frame.velocity_weight,
            dt: frame.dt,
        };
        let part = PartSearch {
            ownership: &mut ownership,
            free: &particles.free,
            reach: &particles.reach,
            wall_slack: frame.wall_slack,
        };
        self.contact.neighbours.search_part(&step, &frame.domain, part);
        let outcome = self.solve(frame, &step, partners, buffers);
        self.particles = Particles { ownership, ..particles };
        outcome
    }

    /// Takes over particles and memory, and searches.
    fn load(&mut self, frame: &PartFrame<D>, shares: &RankShare<D>) {
        let Self { contact, particles, .. } = self;
        contact.params = frame.params.clone();
        contact.domain = frame.domain.clone();
        let of = &shares.particles;
        let own = |list: &mut Vec<f64>, value: fn(&crate::part::PartParticle<D>) -> f64| {
            list.clear();
            list.extend(of.iter().map(value));
        };
        own(&mut particles.radii, |particle| particle.radius);
        own(&mut particles.reach, |particle| particle.reach);
        own(&mut contact.mobility.0, |particle| particle.mobility);
        particles.positions.clear();
        particles.positions.extend(of.iter().map(|particle| particle.position));
        particles.free.clear();
        particles.free.extend(of.iter().map(|particle| particle.free));
        let Ownership { names, is_own } = &mut particles.ownership;
        names.clear();
        names.extend(of.iter().map(|particle| particle.index));
        is_own.clear();
        is_own.extend(of.iter().map(|particle| particle.owner == shares.rank));
        contact.record.contacts.clear();
        contact.record.state.pairs.clear();
        let place =
            |order: u32| of.binary_search_by_key(&order, |particle| particle.order).unwrap_or(0) as u32;
        let state = |memory: &PartMemory| {
            let first = place(memory.pair.first) as usize;
            let pair = match memory.pair.second {
                Partner::Wall(wall) => PairKey::wall(first, wall as usize),
                Partner::Particle { index, image } => PairKey::across(first, place(index) as usize, image),
            };
            PairState { pair, gamma: memory.gamma, lambda: memory.lambda }
        };
        contact.record.state.pairs.extend(shares.memory.iter().map(state));
    }

    fn solve(
        &mut self,
        frame: &PartFrame<D>,
        step: &StepGeometry<'_, D>,
        partners: &dyn Partners<D>,
        buffers: &mut Buffers<D>,
    ) -> Result<PartOutcome, PartFailure> {
        let begun = self.contact.begin(step, buffers);
        agree(partners, begun)?;
        let mut report = ContactReport::default();
        let is_complete = loop {
            let solved = self.solve_own(frame, step, (partners, &mut *buffers), &mut report);
            agree(partners, solved)?;
            self.solve_shared(frame, partners, buffers, &mut report)?;
            self.publish(frame, partners, buffers);
            for part in buffers.takes_part.iter_mut().filter(|part| **part == Participation::Fresh) {
                *part = Participation::Yes;
            }
            let neighbours = &self.contact.neighbours;
            let complete = |sums: &mut [f64]| partners.complete(sums, &mut []);
            let is_sufficient =
                neighbours.is_sufficient_here(&frame.domain, frame.dt, &buffers.displacements, complete);
            let admits = self.contact.admit(step, buffers);
            let mut any = [!is_sufficient, admits].map(|any| f64::from(u8::from(any)));
            partners.complete(&mut [], &mut any);
            if any[0] > 0.0 || any[1] == 0.0 {
                break any[0] == 0.0;
            }
        };
        let shared_row_count = self.shared_rows.len();
        if !is_complete {
            return Ok(PartOutcome { is_complete, report, shared_row_count });
        }
        agree(partners, self.contact.check_given_motions(step, frame.tolerance, buffers))?;
        let report = self.contact.summary(report, buffers);
        self.contact.remember(step, frame.tolerance, buffers);
        Ok(PartOutcome { is_complete, report, shared_row_count })
    }

    /// Lists the rows, sets those in islands that reach across ranks apart, and solves the other islands.
    fn solve_own(
        &mut self,
        frame: &PartFrame<D>,
        step: &StepGeometry<'_, D>,
        (partners, buffers): (&dyn Partners<D>, &mut Buffers<D>),
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let listed = self.contact.list_rows(step, buffers);
        if listed.is_err() {
            buffers.rows.clear();
        }
        self.find_shared(partners, buffers);
        listed?;
        let tuning = self.contact.tuning(frame.tolerance);
        self.contact.part_islands(step, &tuning, buffers);
        self.set_apart();
        self.contact.solve_parted(step, tuning, buffers, report)
    }

    /// Counts the ranks that have rows on each movable particle.
    fn find_shared(&mut self, partners: &dyn Partners<D>, buffers: &Buffers<D>) {
        let count = self.contact.neighbours.count();
        self.is_touched.clear();
        self.is_touched.resize(count, false);
        for place in buffers.rows.iter().flat_map(|row| [row.tail, row.head]).filter(|&end| end != GROUND) {
            self.is_touched[place as usize] |= buffers.weights[place as usize] > 0.0;
        }
        self.touches.clear();
        let mark = |&touched: &bool| Vector::from_fn(|d, _| if d == 0 && touched { 1.0 } else { 0.0 });
        self.touches.extend(self.is_touched.iter().map(mark));
        partners.accumulate(&mut self.touches);
        partners.update(&mut self.touches);
    }

    /// Whether several ranks have rows on a place.
    fn is_shared(&self, place: u32) -> bool {
        place != GROUND && self.touches[place as usize][0] > 1.0
    }

    /// Sets the rows of islands that reach across ranks apart, which are not to be solved for here.
    fn set_apart(&mut self) {
        let mut islands = std::mem::take(&mut self.contact.islands);
        self.shared_rows.clear();
        self.has_fresh = false;
        for island in &mut islands.islands {
            if islands.slots[island.slots.clone()].iter().any(|slot| self.is_shared(slot.place)) {
                self.shared_rows.extend_from_slice(&islands.rows[island.rows.clone()]);
                self.has_fresh |= std::mem::take(&mut island.is_fresh);
            }
        }
        self.shared_rows.sort_unstable_by_key(|row| row.rank);
        self.contact.islands = islands;
    }

    /// Solves for the islands that reach across ranks, if some of their contacts are new.
    fn solve_shared(
        &mut self,
        frame: &PartFrame<D>,
        partners: &dyn Partners<D>,
        buffers: &mut Buffers<D>,
        report: &mut ContactReport,
    ) -> Result<(), PartFailure> {
        let mut any = [f64::from(u8::from(self.has_fresh))];
        partners.complete(&mut [], &mut any);
        if any[0] == 0.0 {
            return Ok(());
        }
        let tuning = self.contact.tuning(frame.tolerance);
        self.gather_shared(frame, buffers);
        let place = |place: u32| Some(place).filter(|&place| self.is_shared(place));
        let places: Vec<_> = self.shared.slots.iter().skip(1).map(|slot| place(slot.place)).collect();
        partners.select(Some(&places));
        let name = |place: u32| self.contact.neighbours.name(place).unwrap_or(u32::MAX);
        let numbers: Vec<u32> = self.shared.slots.iter().map(|slot| name(slot.place)).collect();
        let Self { contact, shared, workspace, .. } = self;
        let context = SharedContext {
            params: &contact.params,
            tuning,
            velocity_weight: frame.velocity_weight,
            partners,
            numbers: &numbers,
        };
        let outcome = workspace.solve_shared(shared, &context);
        partners.select(None);
        match outcome {
            Ok(effort) => report.count_effort(&effort),
            Err(failure) => return Err(self.explain_shared(&failure, frame.tolerance)),
        }
        for (row, &force) in self.shared.rows.iter().zip(&self.workspace.forces) {
            buffers.forces[row.candidate as usize] = force;
        }
        for (slot, &change) in self.shared.slots.iter().zip(&self.workspace.changes).skip(1) {
            buffers.changes[slot.place as usize] = change;
        }
        Ok(())
    }

    /// Makes one island of the rows that are set apart, with the particles of this rank on which only others
    /// have rows.
    fn gather_shared(&mut self, frame: &PartFrame<D>, buffers: &Buffers<D>) {
        let rule = GammaRule::new(&frame.params, frame.velocity_weight, frame.dt);
        let neighbours = &self.contact.neighbours;
        let is_relayed = |&place: &u32| {
            let at = place as usize;
            neighbours.is_own(at) && !self.is_touched[at] && self.is_shared(place)
        };
        let relayed: Vec<u32> = (0..neighbours.count() as u32).filter(is_relayed).collect();
        let places = SortedParticles {
            positions: &neighbours.positions,
            free: &neighbours.free,
            weights: &buffers.weights,
        };
        self.shared.part(&self.shared_rows, &places, Grouping::Whole(&relayed), |_| true);
        let scratch_count = frame.params.solver.method().scratch_count();
        self.workspace.prepare(&self.shared, scratch_count, |row| {
            let PairMemory { gamma, lambda } = buffers.memory[row.candidate as usize];
            (buffers.forces[row.candidate as usize], rule.floor(gamma, lambda))
        });
    }

    /// Brings the changes of velocities, each from the rank that found it, to all that hold the particle.
    fn publish(&mut self, frame: &PartFrame<D>, partners: &dyn Partners<D>, buffers: &mut Buffers<D>) {
        let neighbours = &self.contact.neighbours;
        for place in 0..neighbours.count() {
            let is_shared = self.is_shared(place as u32);
            let is_found_here = match neighbours.is_own(place) {
                true => self.is_touched[place] || is_shared,
                false => self.is_touched[place] && !is_shared,
            };
            if !is_found_here {
                buffers.changes[place] = Vector::zeros();
            }
        }
        partners.accumulate(&mut buffers.changes);
        partners.update(&mut buffers.changes);
        let moves = neighbours.free.iter().zip(&buffers.changes);
        for (displacement, (free, change)) in buffers.displacements.iter_mut().zip(moves) {
            *displacement = free + change * frame.velocity_weight;
        }
    }

    /// The failure of the islands that reach across ranks, as far as it is one of contacts here.
    fn explain_shared(&self, failure: &Failure, tolerance: f64) -> PartFailure {
        let is_elsewhere = match failure {
            Failure::Solve(failure) => match &failure.infeasible {
                Some(rows) => rows.is_empty(),
                None => failure.worst == ELSEWHERE,
            },
            Failure::Gap { contact, .. } => *contact == ELSEWHERE,
        };
        if is_elsewhere {
            let message = "contacts of other ranks cannot be satisfied".to_owned();
            return PartFailure::Elsewhere { message };
        }
        let neighbours = &self.contact.neighbours;
        let key =
            |row: usize| neighbours.key(&neighbours.candidates[self.shared.rows[row].candidate as usize]);
        PartFailure::Here(ContactError::of_projection(failure, tolerance, key, key))
    }
}

/// The failure of one rank is one of all.
fn agree<const D: usize>(
    partners: &dyn Partners<D>,
    outcome: Result<(), ContactError>,
) -> Result<(), PartFailure> {
    let own = outcome.as_ref().err().map(ToString::to_string);
    match (partners.first_failure(own), outcome) {
        (_, Err(error)) => Err(PartFailure::Here(error)),
        (Some(message), Ok(())) => Err(PartFailure::Elsewhere { message }),
        (None, Ok(())) => Ok(()),
    }
}
