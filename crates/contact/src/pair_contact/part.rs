//! The contact step of one of several ranks, on its own particles and copies of others.

use gluey_geom::{Twist, Vector};

use super::{Buffers, PairContact, PairMemory, Participation, free_moves};
use crate::island_projection::{IslandWorkspace, SharedContext};
use crate::islands::{Grouping, Islands, SortedParticles};
use crate::memory::GammaRule;
use crate::model::validate;
use crate::neighbours::{Ownership, PartSearch};
use crate::part::partition::{Partitioner, SearchedMoves};
use crate::part::{PartFailure, PartOutcome, Partners, RankOf, RankShare};
use crate::projection::Failure;
use crate::rows::{GROUND, Row};
use crate::solver::ELSEWHERE;
use crate::{Contact, ContactError, ContactParams, ContactReport, Mobility, PairKey, StepGeometry};

/// Mobilities of the particles of a rank.
#[derive(Clone, Debug, Default)]
struct PartMobility(Vec<f64>);

impl<const D: usize> Mobility<D> for PartMobility {
    fn own(&self, particle: usize, _radius: f64) -> f64 {
        self.0[particle]
    }
}

/// Contact of particles that ranks share, all of which call the same methods: see [`crate::part`].
///
/// A step begins with [`PartContact::begin`]. [`PartContact::share`] and [`PartContact::solve`] follow, and
/// again after [`PartContact::widen`] while the search of some rank had not gone far enough; then
/// [`PartContact::finish`] takes over what came of it. Contacts and memory change there only.
#[derive(Debug)]
pub struct PartContact<const D: usize, M> {
    /// The model of one process, which has the memory of all contacts.
    alone: PairContact<D, M>,
    partitioner: Partitioner<D>,
    /// Displacements without contact, of all particles.
    free: Vec<Vector<D>>,
    searched: SearchedMoves<D>,
    /// Displacements along a wall's normal up to which walls are candidates, beyond the free ones.
    wall_slack: f64,
    /// Residual to reach.
    tolerance: f64,
    /// Of this rank.
    contact: PairContact<D, PartMobility>,
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

impl<const D: usize, M: Mobility<D>> PartContact<D, M> {
    /// What `alone` does in one process.
    pub fn new(alone: PairContact<D, M>) -> Self {
        Self {
            alone,
            partitioner: Partitioner::default(),
            free: Vec::new(),
            searched: SearchedMoves::default(),
            wall_slack: 0.0,
            tolerance: 0.0,
            contact: PairContact::with_mobility(ContactParams::default(), PartMobility::default()),
            particles: Particles::default(),
            shared: Islands::default(),
            workspace: IslandWorkspace::default(),
            shared_rows: Vec::new(),
            touches: Vec::new(),
            is_touched: Vec::new(),
            has_fresh: false,
        }
    }

    /// The model of one process.
    pub fn alone(&self) -> &PairContact<D, M> {
        &self.alone
    }

    /// The same, to change it between steps.
    pub fn alone_mut(&mut self) -> &mut PairContact<D, M> {
        &mut self.alone
    }

    /// Checks a step and what is remembered before it.
    ///
    /// # Errors
    /// Those of [`PairContact::correct`] that show before anything is solved, on all ranks.
    pub fn begin(&mut self, step: &StepGeometry<'_, D>, twists: &[Twist<D>]) -> Result<(), ContactError> {
        let Self { alone, free, searched, .. } = self;
        validate(step, twists, &alone.domain)?;
        alone.check_memory(step)?;
        free.clear();
        free.extend(free_moves(step, twists));
        searched.displacements.clone_from(free);
        (searched.widening, self.wall_slack) = (1.0, 0.0);
        self.tolerance = alone.tolerance(step, free);
        self.contact.params = alone.params.clone();
        self.contact.domain = alone.domain.clone();
        Ok(())
    }

    /// The share of a rank.
    ///
    /// # Errors
    /// [`ContactError::TooFast`], on all ranks.
    pub fn share(&mut self, step: &StepGeometry<'_, D>, rank: RankOf) -> Result<RankShare, ContactError> {
        let Self { alone, searched, .. } = self;
        self.partitioner.partition(step, &alone.domain, searched, &alone.record.state.pairs, rank)
    }

    /// Has the next search find what the displacements of all particles, by index, close.
    pub fn widen(&mut self, displacements: impl IntoIterator<Item = (u32, Vector<D>)>) {
        self.searched.widening *= 2.0;
        for (index, displacement) in displacements {
            self.searched.displacements[index as usize] = displacement;
        }
        for wall in &self.alone.domain.walls {
            let along = self.searched.displacements.iter().map(|s| wall.normal.dot(s).abs());
            self.wall_slack = along.fold(self.wall_slack, f64::max);
        }
    }

    /// Takes over the contacts of all ranks, and the memory they leave.
    pub fn finish(&mut self, contacts: Vec<Contact>) {
        self.alone.record.replace(|list| *list = contacts);
    }

    /// Pairs and walls that the last search found for this rank, and what is remembered besides.
    pub fn candidates(&self) -> impl Iterator<Item = PairKey> {
        let neighbours = &self.contact.neighbours;
        neighbours.candidates.iter().map(|candidate| neighbours.key(candidate))
    }

    /// Solves for the contacts of a step.
    ///
    /// # Errors
    /// [`PartFailure`], on all ranks.
    pub fn solve(
        &mut self,
        step: &StepGeometry<'_, D>,
        share: &RankShare,
        partners: &dyn Partners<D>,
    ) -> Result<PartOutcome<D>, PartFailure> {
        let mut buffers = std::mem::take(&mut self.contact.buffers);
        let mut particles = std::mem::take(&mut self.particles);
        self.load(step, share, &mut particles);
        let mut ownership = std::mem::take(&mut particles.ownership);
        let part = StepGeometry {
            positions: &particles.positions,
            radii: &particles.radii,
            drift: &[],
            velocity_weight: step.velocity_weight,
            dt: step.dt,
        };
        let search = PartSearch {
            ownership: &mut ownership,
            free: &particles.free,
            reach: &particles.reach,
            wall_slack: self.wall_slack,
        };
        self.contact.neighbours.search_part(&part, &self.alone.domain, search);
        let outcome = self.solve_part(&part, share, partners, &mut buffers);
        self.particles = Particles { ownership, ..particles };
        self.contact.buffers = buffers;
        outcome
    }

    /// Takes over particles and memory.
    fn load(&mut self, step: &StepGeometry<'_, D>, share: &RankShare, particles: &mut Particles<D>) {
        let of = || share.particles.iter().map(|particle| particle.index as usize);
        let Particles { positions, free, radii, reach, ownership: Ownership { names, is_own } } = particles;
        replace(positions, of().map(|index| step.positions[index]));
        replace(free, of().map(|index| self.free[index]));
        replace(radii, of().map(|index| step.radii[index]));
        replace(reach, share.particles.iter().map(|particle| particle.reach));
        replace(names, share.particles.iter().map(|particle| particle.index));
        replace(is_own, share.particles.iter().map(|particle| particle.owner == share.rank));
        let mobility = &self.alone.mobility;
        replace(&mut self.contact.mobility.0, of().map(|index| mobility.own(index, step.radii[index])));
        self.contact.record.contacts.clear();
        replace(&mut self.contact.record.state.pairs, share.memory.iter().copied());
    }

    fn solve_part(
        &mut self,
        step: &StepGeometry<'_, D>,
        share: &RankShare,
        partners: &dyn Partners<D>,
        buffers: &mut Buffers<D>,
    ) -> Result<PartOutcome<D>, PartFailure> {
        let begun = self.contact.begin(step, buffers);
        agree(partners, begun)?;
        let mut report = ContactReport::default();
        let is_complete = loop {
            let solved = self.solve_own(step, partners, buffers, &mut report);
            agree(partners, solved)?;
            self.solve_shared(step, partners, buffers, &mut report)?;
            self.publish(step.velocity_weight, partners, buffers);
            for part in buffers.takes_part.iter_mut().filter(|part| **part == Participation::Fresh) {
                *part = Participation::Yes;
            }
            let (neighbours, domain) = (&self.contact.neighbours, &self.contact.domain);
            let complete = |sums: &mut [f64]| partners.complete(sums, &mut []);
            let is_sufficient =
                neighbours.is_sufficient_here(domain, step.dt, &buffers.displacements, complete);
            let admits = self.contact.admit(step, buffers);
            let mut any = [!is_sufficient, admits].map(|any| f64::from(u8::from(any)));
            partners.complete(&mut [], &mut any);
            if any[0] > 0.0 || any[1] == 0.0 {
                break any[0] == 0.0;
            }
        };
        if !is_complete {
            let moves = share.own().map(|(place, index)| (index, buffers.displacements[place]));
            return Ok(PartOutcome::Incomplete(moves.collect()));
        }
        agree(partners, self.contact.check_given_motions(step, self.tolerance, buffers))?;
        let report = self.contact.summary(report, buffers);
        self.contact.remember(step, self.tolerance, buffers);
        let changes = share.own().map(|(place, index)| (index, buffers.changes[place]));
        Ok(PartOutcome::Complete {
            report,
            shared_row_count: self.shared_rows.len(),
            changes: changes.filter(|(_, change)| change.amax() > 0.0).collect(),
            contacts: self.contact.record.contacts.clone(),
        })
    }

    /// Lists the rows, sets those in islands that reach across ranks apart, and solves the other islands.
    fn solve_own(
        &mut self,
        step: &StepGeometry<'_, D>,
        partners: &dyn Partners<D>,
        buffers: &mut Buffers<D>,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let listed = self.contact.list_rows(step, buffers);
        if listed.is_err() {
            buffers.rows.clear();
        }
        self.find_shared(partners, buffers);
        listed?;
        let tuning = self.contact.tuning(self.tolerance);
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
        step: &StepGeometry<'_, D>,
        partners: &dyn Partners<D>,
        buffers: &mut Buffers<D>,
        report: &mut ContactReport,
    ) -> Result<(), PartFailure> {
        let mut any = [f64::from(u8::from(self.has_fresh))];
        partners.complete(&mut [], &mut any);
        if any[0] == 0.0 {
            return Ok(());
        }
        let tuning = self.contact.tuning(self.tolerance);
        self.gather_shared(step, buffers);
        let place = |place: u32| Some(place).filter(|&place| self.is_shared(place));
        let places: Vec<_> = self.shared.slots.iter().skip(1).map(|slot| place(slot.place)).collect();
        partners.select(Some(&places));
        let name = |place: u32| self.contact.neighbours.name(place).unwrap_or(u32::MAX);
        let numbers: Vec<u32> = self.shared.slots.iter().map(|slot| name(slot.place)).collect();
        let Self { contact, shared, workspace, .. } = self;
        let context = SharedContext {
            params: &contact.params,
            tuning,
            velocity_weight: step.velocity_weight,
            partners,
            numbers: &numbers,
        };
        let outcome = workspace.solve_shared(shared, &context);
        partners.select(None);
        match outcome {
            Ok(effort) => report.count_effort(&effort),
            Err(failure) => return Err(self.explain_shared(&failure, self.tolerance)),
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
    fn gather_shared(&mut self, step: &StepGeometry<'_, D>, buffers: &Buffers<D>) {
        let rule = GammaRule::new(&self.contact.params, step.velocity_weight, step.dt);
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
        let scratch_count = self.contact.params.solver.method().scratch_count();
        self.workspace.prepare(&self.shared, scratch_count, |row| {
            let PairMemory { gamma, lambda } = buffers.memory[row.candidate as usize];
            (buffers.forces[row.candidate as usize], rule.floor(gamma, lambda))
        });
    }

    /// Brings the changes of velocities, each from the rank that found it, to all that hold the particle.
    fn publish(&mut self, velocity_weight: f64, partners: &dyn Partners<D>, buffers: &mut Buffers<D>) {
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
            *displacement = free + change * velocity_weight;
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

/// Replaces a list by another one.
fn replace<T>(list: &mut Vec<T>, by: impl Iterator<Item = T>) {
    list.clear();
    list.extend(by);
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
