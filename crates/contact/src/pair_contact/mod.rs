//! The contact step: find pairs, project, re-linearise, remember.

mod admission;
mod part;
mod velocity_correction;

use gluey_geom::{Twist, Vector};

use crate::island_projection::{IslandWorkspace, SolveContext};
use crate::islands::{Grouping, Island, Islands, SortedParticles};
use crate::memory::GammaRule;
use crate::model::validate;
use crate::neighbours::NeighbourList;
use crate::projection::{Failure, Tuning};
use crate::record::ContactRecord;
use crate::rows::Row;
use crate::{
    BodyStep, Contact, ContactError, ContactLaw, ContactModel, ContactParams, ContactReport, ContactState,
    Domain, MemoryError, Mobility, StepGeometry, StokesDrag,
};

pub use part::PartContact;

/// Contacts between discs or spheres, and with walls, by one of the [`ContactLaw`]s.
///
/// Results do not depend on the numbering of the particles nor on the number of threads, bit for bit.
#[derive(Debug)]
pub struct PairContact<const D: usize, M = StokesDrag> {
    params: ContactParams,
    mobility: M,
    domain: Domain<D>,
    record: ContactRecord,
    neighbours: NeighbourList<D>,
    islands: Islands<D>,
    workspace: IslandWorkspace<D>,
    buffers: Buffers<D>,
    centers: Centers<D>,
}

/// The motion of the centres in a step of bodies.
#[derive(Debug, Default)]
pub struct Centers<const D: usize> {
    positions: Vec<Vector<D>>,
    drift: Vec<Vector<D>>,
}

impl<const D: usize> Centers<D> {
    /// The step without its rotations.
    pub fn of<'a>(&'a mut self, step: &BodyStep<'a, D>) -> StepGeometry<'a, D> {
        self.positions.clear();
        self.positions.extend(step.poses.iter().map(|pose| pose.position));
        self.drift.clear();
        self.drift.extend(step.drift.iter().map(|drift| drift.velocity));
        let (radii, velocity_weight, dt) = (step.radii, step.velocity_weight, step.dt);
        StepGeometry { positions: &self.positions, radii, drift: &self.drift, velocity_weight, dt }
    }
}

/// Vectors of a step, kept from step to step.
#[derive(Debug, Default)]
struct Buffers<const D: usize> {
    /// Displacements without contact, by particle.
    free: Vec<Vector<D>>,
    /// Rows of this step in the order of space.
    rows: Vec<Row<D>>,
    /// One entry per candidate: whether it takes part, its memory, its force.
    takes_part: Vec<Participation>,
    memory: Vec<PairMemory>,
    forces: Vec<f64>,
    /// One entry per place.
    weights: Vec<f64>,
    changes: Vec<Vector<D>>,
    displacements: Vec<Vector<D>>,
}

/// Participation of a candidate in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Participation {
    No,
    /// Not yet solved for.
    Fresh,
    Yes,
}

/// Memory of a candidate before the step.
#[derive(Clone, Copy, Debug, Default)]
struct PairMemory {
    gamma: f64,
    lambda: f64,
}

impl<const D: usize> PairContact<D> {
    /// The model with `M = diag(a_i)`.
    pub fn new(params: ContactParams) -> Self {
        Self::with_mobility(params, StokesDrag)
    }
}

impl<const D: usize, M: Mobility<D>> PairContact<D, M> {
    /// The model with another metric of the projection.
    pub fn with_mobility(params: ContactParams, mobility: M) -> Self {
        Self {
            params,
            mobility,
            domain: Domain::default(),
            record: ContactRecord::default(),
            neighbours: NeighbourList::default(),
            islands: Islands::default(),
            workspace: IslandWorkspace::default(),
            buffers: Buffers::default(),
            centers: Centers::default(),
        }
    }

    /// The same within walls and periodic directions.
    pub fn within(mut self, domain: Domain<D>) -> Self {
        self.set_domain(domain);
        self
    }

    /// Changes the walls or periods, as for walls that move.
    pub fn set_domain(&mut self, domain: Domain<D>) {
        if domain.lattice.periods() != self.domain.lattice.periods() {
            self.neighbours = NeighbourList::default();
        }
        self.domain = domain;
    }

    /// The walls and periods.
    pub fn domain(&self) -> &Domain<D> {
        &self.domain
    }

    /// The parameters.
    pub fn params(&self) -> &ContactParams {
        &self.params
    }
}

impl<const D: usize, M: Mobility<D>> PairContact<D, M> {
    /// Corrects `twists`; on an error they and the memory are as before. [`ContactModel::correct_bodies`]
    /// does the same for a step that is given with orientations.
    pub fn correct(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
    ) -> Result<ContactReport, ContactError> {
        validate(step, twists, &self.domain)?;
        if self.params.law == ContactLaw::None {
            return Ok(ContactReport::default());
        }
        let mut buffers = std::mem::take(&mut self.buffers);
        let outcome = self.step(step, twists, &mut buffers);
        self.buffers = buffers;
        outcome
    }
}

impl<const D: usize, M: Mobility<D>> ContactModel<D> for PairContact<D, M> {
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
        &self.record.contacts
    }

    fn checkpoint(&self) -> ContactState {
        self.record.state.clone()
    }

    fn resume(&mut self, state: ContactState) -> Result<(), MemoryError> {
        self.record.resume(state)
    }

    fn reverse(&mut self) {
        self.record.reverse();
    }

    fn set_sliding(&mut self, tilt: f64, tilt_step: f64) {
        self.domain.set_sliding(tilt, tilt_step);
    }
}

/// Reach of the search: whether it went far enough.
enum Coverage {
    Complete,
    Incomplete,
}

impl<const D: usize, M: Mobility<D>> PairContact<D, M> {
    fn step(
        &mut self,
        step: &StepGeometry<'_, D>,
        twists: &mut [Twist<D>],
        buffers: &mut Buffers<D>,
    ) -> Result<ContactReport, ContactError> {
        buffers.free.clear();
        buffers.free.extend(free_moves(step, twists));
        let tolerance = self.tolerance(step, &buffers.free);
        self.neighbours.margin = 0.5 * self.margin();
        self.neighbours.begin(step, &self.domain, &buffers.free)?;
        let report = loop {
            self.begin(step, buffers)?;
            let (reach, report) = match self.params.law {
                ContactLaw::VelocityCorrection => self.push(step, tolerance, buffers)?,
                _ => self.project(step, tolerance, buffers)?,
            };
            if let Coverage::Complete = reach {
                break report;
            }
            let mut needed = buffers.free.clone();
            for (place, &particle) in self.neighbours.order.iter().enumerate() {
                needed[particle as usize] = buffers.displacements[place];
            }
            self.neighbours.extend(step, &self.domain, &buffers.free, &needed)?;
        };
        self.check_given_motions(step, tolerance, buffers)?;
        let report = self.summary(report, buffers);
        self.remember(step, tolerance, buffers);
        for (change, &particle) in buffers.changes.iter().zip(&self.neighbours.order) {
            twists[particle as usize].velocity += change;
        }
        Ok(report)
    }

    /// The residual that is asked for.
    fn tolerance(&self, step: &StepGeometry<'_, D>, free: &[Vector<D>]) -> f64 {
        let radius = step.radii.iter().copied().fold(f64::INFINITY, f64::min);
        let farthest = free.iter().map(|s| s.norm()).fold(0.0, f64::max);
        let extent = step.positions.iter().map(|x| x.amax()).fold(0.0, f64::max);
        // Images across the border in y are that far away along x.
        let height = step.positions.iter().map(|x| x[1].abs()).fold(0.0, f64::max);
        let tilted = 2.0 * (self.domain.lattice.shear() * height).abs() + self.domain.lattice.tilt().abs();
        self.params.residual(radius, farthest, extent + tilted)
    }

    /// Gap below which pairs are pushed apart, relative to the mean radius.
    fn margin(&self) -> f64 {
        if self.params.law == ContactLaw::VelocityCorrection { self.params.threshold.max(0.0) } else { 0.0 }
    }

    /// The projection on the pairs that are admitted, until no other closes.
    fn project(
        &mut self,
        step: &StepGeometry<'_, D>,
        tolerance: f64,
        buffers: &mut Buffers<D>,
    ) -> Result<(Coverage, ContactReport), ContactError> {
        let mut report = ContactReport::default();
        loop {
            self.list_rows(step, buffers)?;
            self.solve_islands(step, tolerance, buffers, &mut report)?;
            buffers
                .takes_part
                .iter_mut()
                .filter(|part| **part == Participation::Fresh)
                .for_each(|part| *part = Participation::Yes);
            if !self.neighbours.is_sufficient(&self.domain, step, &buffers.displacements) {
                return Ok((Coverage::Incomplete, report));
            }
            if !self.admit(step, buffers) {
                return Ok((Coverage::Complete, report));
            }
        }
    }

    fn solve_islands(
        &mut self,
        step: &StepGeometry<'_, D>,
        tolerance: f64,
        buffers: &mut Buffers<D>,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let tuning = self.tuning(tolerance);
        self.part_islands(step, &tuning, buffers);
        self.solve_parted(step, tuning, buffers, report)
    }

    fn tuning(&self, tolerance: f64) -> Tuning {
        Tuning {
            solver: self.params.solver.method(),
            tolerance,
            iteration_limit: self.params.iteration_limit,
        }
    }

    /// Solves the fresh islands.
    fn solve_parted(
        &mut self,
        step: &StepGeometry<'_, D>,
        tuning: Tuning,
        buffers: &mut Buffers<D>,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let context = SolveContext {
            params: &self.params,
            mobility: &self.mobility,
            tuning,
            velocity_weight: step.velocity_weight,
            radii: step.radii,
            order: &self.neighbours.order,
        };
        self.workspace.solve(&self.islands, &context);
        let islands = self.islands.islands.iter().zip(&self.workspace.outcomes);
        for (island, outcome) in islands.filter(|(island, _)| island.is_fresh) {
            let effort = outcome
                .as_ref()
                .map_err(|failure| self.explain(failure, island.rows.start, tuning.tolerance))?;
            report.count_effort(effort);
            self.take_over(island, step.velocity_weight, buffers);
        }
        Ok(())
    }

    /// Parts the rows into islands, with the forces they start from.
    fn part_islands(&mut self, step: &StepGeometry<'_, D>, tuning: &Tuning, buffers: &Buffers<D>) {
        let rule = GammaRule::new(&self.params, step.velocity_weight, step.dt);
        let Buffers { rows, takes_part, memory, forces, weights, .. } = buffers;
        let places =
            SortedParticles { positions: &self.neighbours.positions, free: &self.neighbours.free, weights };
        let is_fresh = |row: &Row<D>| takes_part[row.candidate as usize] == Participation::Fresh;
        // Where particles are coupled all belong together.
        let all: Vec<u32> = if M::COUPLED { (0..weights.len() as u32).collect() } else { Vec::new() };
        let grouping = if M::COUPLED { Grouping::Whole(&all) } else { Grouping::Components };
        self.islands.part(rows, &places, grouping, is_fresh);
        self.workspace.prepare(&self.islands, tuning.solver.scratch_count(), |row| {
            let PairMemory { gamma, lambda } = memory[row.candidate as usize];
            (forces[row.candidate as usize], rule.floor(gamma, lambda))
        });
    }

    /// Takes over the forces and motions of an island that was solved.
    fn take_over(&self, island: &Island, velocity_weight: f64, buffers: &mut Buffers<D>) {
        for k in island.rows.clone() {
            buffers.forces[self.islands.rows[k].candidate as usize] = self.workspace.forces[k];
        }
        for k in island.slots.clone().skip(1) {
            let (slot, place) = (&self.islands.slots[k], self.islands.slots[k].place as usize);
            buffers.changes[place] = self.workspace.changes[k];
            buffers.displacements[place] = slot.free + buffers.changes[place] * velocity_weight;
        }
    }

    /// The error that the failure of an island means; its first row is `start`.
    fn explain(&self, failure: &Failure, start: usize, tolerance: f64) -> ContactError {
        let key = |row: usize| {
            self.neighbours
                .key(&self.neighbours.candidates[self.islands.rows[start + row].candidate as usize])
        };
        ContactError::of_projection(failure, tolerance, key, key)
    }

    fn summary(&self, mut report: ContactReport, buffers: &Buffers<D>) -> ContactReport {
        for row in &buffers.rows {
            let gap = row.gap_after(&self.neighbours.positions, &buffers.displacements);
            let force = buffers.forces[row.candidate as usize];
            report.count_pair(gap, force, || {
                self.neighbours.key(&self.neighbours.candidates[row.candidate as usize])
            });
        }
        report
    }

    /// Updates gamma and lists the contacts.
    fn remember(&mut self, step: &StepGeometry<'_, D>, tolerance: f64, buffers: &Buffers<D>) {
        let (neighbours, rule) =
            (&self.neighbours, GammaRule::new(&self.params, step.velocity_weight, step.dt));
        let contact = |row: &Row<D>| {
            let candidate = row.candidate as usize;
            let (PairMemory { gamma, lambda: last }, lambda) =
                (buffers.memory[candidate], buffers.forces[candidate]);
            let gamma = rule.update(gamma, last, lambda);
            // A force that moves the pair by less than the tolerance is rounding noise.
            let moved = [row.head, row.tail]
                .map(|place| buffers.weights.get(place as usize).unwrap_or(&0.0) * lambda);
            let is_contact = gamma < 0.0 || moved[0].abs() + moved[1].abs() > tolerance;
            is_contact.then(|| {
                let gap = row.gap_after(&neighbours.positions, &buffers.displacements);
                Contact { pair: neighbours.key(&neighbours.candidates[candidate]), lambda, gamma, gap }
            })
        };
        self.record.replace(|contacts| contacts.extend(buffers.rows.iter().filter_map(contact)));
    }
}

/// Displacements of particles in a step without contact.
fn free_moves<'a, const D: usize>(
    step: &'a StepGeometry<'_, D>,
    twists: &'a [Twist<D>],
) -> impl Iterator<Item = Vector<D>> + 'a {
    twists.iter().zip(step.drift).map(|(twist, drift)| twist.velocity * step.velocity_weight + drift)
}
