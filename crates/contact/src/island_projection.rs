//! The projection of round particles, island by island and in parallel.

mod shared;

pub(crate) use shared::SharedContext;

use gluey_geom::Vector;

use crate::delassus::{JacobianRow, Response, ScaledDelassus, scale_rows};
use crate::islands::{Island, Islands, Slot};
use crate::parallel;
use crate::projection::{self, Effort, Failure, LinearProblem, Linearised, Tuning};
use crate::rows::{GROUND, NormalRow, Row};
use crate::solver::{Factor, SolveFailure, SolveReport, defect};
use crate::{ContactParams, Mobility};

/// Context of the solves of a step: what is the same for all islands.
pub(crate) struct SolveContext<'a, M> {
    pub params: &'a ContactParams,
    pub mobility: &'a M,
    pub tuning: Tuning,
    /// `c`.
    pub velocity_weight: f64,
    /// Radii of all particles.
    pub radii: &'a [f64],
    /// Particle of each place.
    pub order: &'a [u32],
}

/// Vectors of all islands.
#[derive(Debug, Default)]
pub(crate) struct IslandWorkspace<const D: usize> {
    /// Forces over `6 pi eta`, one per row.
    pub forces: Vec<f64>,
    /// Smallest forces, one per row.
    pub floors: Vec<f64>,
    /// Changes of velocity, one per slot.
    pub changes: Vec<Vector<D>>,
    pub outcomes: Vec<Outcome>,
    free_gaps: Vec<f64>,
    scales: Vec<f64>,
    scaled_rows: Vec<NormalRow<D>>,
    moved: Vec<Vector<D>>,
    scratch: Vec<f64>,
}

/// The outcome of an island.
pub(crate) type Outcome = Result<Effort, Failure>;

impl<const D: usize> IslandWorkspace<D> {
    /// Makes room for `islands`, whose rows start with the first and are bounded by the second number of
    /// `start`.
    pub(crate) fn prepare(
        &mut self,
        islands: &Islands<D>,
        scratch_count: usize,
        start: impl Fn(&Row<D>) -> (f64, f64),
    ) {
        self.forces.clear();
        self.floors.clear();
        for row in &islands.rows {
            let (force, floor) = start(row);
            self.forces.push(force);
            self.floors.push(floor);
        }
        let row_count = islands.rows.len();
        self.free_gaps.resize(row_count, 0.0);
        self.scales.resize(row_count, 1.0);
        self.scaled_rows.resize(row_count, NormalRow { normal: Vector::zeros(), tail: 0, head: 0 });
        self.changes.resize(islands.slots.len(), Vector::zeros());
        self.moved.resize(islands.slots.len(), Vector::zeros());
        self.scratch.resize(row_count * scratch_count, 0.0);
        self.outcomes.clear();
        self.outcomes.resize_with(islands.islands.len(), || Ok(Effort::default()));
    }

    /// Solves for the islands that are fresh.
    pub(crate) fn solve<M: Mobility<D>>(&mut self, islands: &Islands<D>, context: &SolveContext<'_, M>) {
        self.slice(islands, context.tuning.solver.scratch_count()).solve(context);
    }

    /// All islands with all vectors.
    fn slice<'a>(&'a mut self, islands: &'a Islands<D>, scratch_count: usize) -> IslandSlice<'a, D> {
        IslandSlice {
            islands: &islands.islands,
            rows: &islands.rows,
            ends: &islands.ends,
            slots: &islands.slots,
            weights: &islands.weights,
            forces: &mut self.forces,
            floors: &mut self.floors,
            free_gaps: &mut self.free_gaps,
            scales: &mut self.scales,
            scaled_rows: &mut self.scaled_rows,
            changes: &mut self.changes,
            moved: &mut self.moved,
            scratch: &mut self.scratch,
            outcomes: &mut self.outcomes,
            scratch_count,
        }
    }
}

/// An instant of the step.
#[derive(Clone, Copy)]
enum Instant {
    Beginning,
    End,
}

/// Some consecutive islands with their parts of all vectors.
struct IslandSlice<'a, const D: usize> {
    islands: &'a [Island],
    rows: &'a [Row<D>],
    ends: &'a [[u32; 2]],
    slots: &'a [Slot<D>],
    weights: &'a [f64],
    forces: &'a mut [f64],
    floors: &'a mut [f64],
    free_gaps: &'a mut [f64],
    scales: &'a mut [f64],
    scaled_rows: &'a mut [NormalRow<D>],
    changes: &'a mut [Vector<D>],
    moved: &'a mut [Vector<D>],
    scratch: &'a mut [f64],
    outcomes: &'a mut [Outcome],
    scratch_count: usize,
}

/// Slices with fewer rows are not worth another thread.
const ROWS_PER_TASK: usize = 512;

impl<const D: usize> IslandSlice<'_, D> {
    fn solve<M: Mobility<D>>(mut self, context: &SolveContext<'_, M>) {
        match self.take_half() {
            Some(half) => parallel::join(|| half.solve(context), || self.solve(context)),
            None => self.solve_in_turn(context),
        }
    }

    fn solve_in_turn<M: Mobility<D>>(mut self, context: &SolveContext<'_, M>) {
        while let Some(mut first) = self.take(1) {
            if first.islands[0].is_fresh {
                first.outcomes[0] = first.solve_one(context);
            }
        }
    }

    /// The first islands, with about half of the rows, if these are worth another thread.
    fn take_half(&mut self) -> Option<Self> {
        if self.islands.len() < 2 || self.rows.len() <= ROWS_PER_TASK {
            return None;
        }
        let middle = self.islands[0].rows.start + self.rows.len() / 2;
        let count = self.islands.partition_point(|island| island.rows.end <= middle);
        let most = self.islands.len() - 1;
        self.take(count.clamp(1, most))
    }

    /// The first `count` islands, if there are so many; at least one.
    fn take(&mut self, count: usize) -> Option<Self> {
        let islands = self.islands.split_off(..count)?;
        let (first, last) = (&islands[0], &islands[count - 1]);
        let (row_count, slot_count) = (last.rows.end - first.rows.start, last.slots.end - first.slots.start);
        Some(Self {
            islands,
            rows: self.rows.split_off(..row_count)?,
            ends: self.ends.split_off(..row_count)?,
            slots: self.slots.split_off(..slot_count)?,
            weights: self.weights.split_off(..slot_count)?,
            forces: self.forces.split_off_mut(..row_count)?,
            floors: self.floors.split_off_mut(..row_count)?,
            free_gaps: self.free_gaps.split_off_mut(..row_count)?,
            scales: self.scales.split_off_mut(..row_count)?,
            scaled_rows: self.scaled_rows.split_off_mut(..row_count)?,
            changes: self.changes.split_off_mut(..slot_count)?,
            moved: self.moved.split_off_mut(..slot_count)?,
            scratch: self.scratch.split_off_mut(..row_count * self.scratch_count)?,
            outcomes: self.outcomes.split_off_mut(..count)?,
            scratch_count: self.scratch_count,
        })
    }

    /// Solves the only island of the slice.
    fn solve_one<M: Mobility<D>>(&mut self, context: &SolveContext<'_, M>) -> Outcome {
        self.scale(|_| {});
        let mut effort = Effort::default();
        projection::solve(&mut IslandProblem { island: self, context }, context.params, &mut effort)?;
        self.unscale();
        Ok(effort)
    }

    /// Forces as they are, in place of scaled ones.
    fn unscale(&mut self) {
        for (force, scale) in self.forces.iter_mut().zip(&*self.scales) {
            *force *= scale;
        }
    }

    /// Scales rows, forces and floors; `complete` is that of [`scale_rows`].
    fn scale(&mut self, complete: impl FnOnce(&mut [f64; 1])) {
        for (scaled, (row, [tail, head])) in self.scaled_rows.iter_mut().zip(self.rows.iter().zip(self.ends))
        {
            *scaled = NormalRow { normal: row.normal, tail: *tail, head: *head };
        }
        scale_rows(self.weights, self.scaled_rows, self.scales, complete);
        for (k, scale) in self.scales.iter().enumerate() {
            self.forces[k] /= scale;
            self.floors[k] /= scale;
        }
    }

    fn difference(&self, row: usize, value: impl Fn(usize) -> Vector<D>) -> Vector<D> {
        let [tail, head] = self.ends[row];
        value(head as usize) - value(tail as usize)
    }

    /// Gap of a row when slots have moved by `moved` and its image is this far behind where it ends.
    fn gap(&self, row: usize, behind: &Vector<D>) -> f64 {
        let [tail, head] = self.ends[row].map(|slot| slot as usize);
        let end = |slot: usize| self.slots[slot].position + self.moved[slot];
        let separation = match self.rows[row].tail {
            GROUND => end(head),
            _ => end(head) + (self.rows[row].shift - behind) - end(tail),
        };
        self.rows[row].gap_at(&separation)
    }

    /// Writes the gaps at the end of the step as linear functions of the velocities, about the displacements
    /// `moved`, with images where they are at this instant.
    ///
    /// The gaps are exact at `moved`, the normals those of the beginning of the step throughout: contact
    /// forces belong to `u^n`, which multi-step schemes extrapolate. Normals of the end of the step converge
    /// faster (by `phi^2/2` per pass here, `phi` the rotation of the pair in the step), but make the
    /// encounter of two spheres first order in dt.
    fn set_free_gaps(&mut self, instant: Instant) {
        for k in 0..self.rows.len() {
            let behind = match instant {
                Instant::Beginning => self.rows[k].slide,
                Instant::End => Vector::zeros(),
            };
            let beyond = self.difference(k, |slot| self.slots[slot].free - self.moved[slot]) + behind;
            let gap = self.gap(k, &behind) + self.rows[k].normal.dot(&beyond);
            self.free_gaps[k] = self.scales[k] * gap;
        }
    }

    /// The row whose gap at the end of the step is farthest from what it should be, beyond the tolerance,
    /// that gap, and how far it is off: infinitely far if it is not a number.
    fn farthest_off(&self, tolerance: f64) -> Option<(usize, f64, f64)> {
        let mut farthest = None;
        let mut largest = 2.0 * tolerance;
        for k in 0..self.rows.len() {
            let gap = self.gap(k, &Vector::zeros());
            let compliance = self.scaled_rows[k].compliance(self.weights);
            let slack = compliance * self.scales[k] * (self.forces[k] - self.floors[k]);
            let off = defect(gap, slack);
            if off > largest {
                (farthest, largest) = (Some((k, gap, off)), off);
            }
        }
        farthest
    }

    /// Solves the linear problem, and moves the slots to the end of the step.
    fn project(
        &mut self,
        response: impl Response<NormalRow<D>>,
        tuning: &Tuning,
        c: f64,
    ) -> Result<SolveReport, SolveFailure> {
        let mut problem = LinearProblem {
            operator: ScaledDelassus { rows: self.scaled_rows, response, motions: self.changes },
            weights: self.weights,
            free_gaps: self.free_gaps,
            floors: self.floors,
            forces: self.forces,
            scratch: self.scratch,
        };
        let report = problem.solve(tuning)?;
        self.changes.iter_mut().for_each(|change| *change /= c);
        for (moved, (slot, change)) in self.moved.iter_mut().zip(self.slots.iter().zip(&*self.changes)) {
            *moved = slot.free + change * c;
        }
        Ok(report)
    }
}

/// The only island of a slice, as a projection.
struct IslandProblem<'a, 'b, const D: usize, M> {
    island: &'a mut IslandSlice<'b, D>,
    context: &'a SolveContext<'a, M>,
}

impl<const D: usize, M: Mobility<D>> Linearised for IslandProblem<'_, '_, D, M> {
    fn begin(&mut self) {
        self.island.moved.fill(Vector::zeros());
        self.island.set_free_gaps(Instant::Beginning);
    }

    fn project(&mut self) -> Result<SolveReport, SolveFailure> {
        let (weights, slots, context) = (self.island.weights, self.island.slots, self.context);
        let response = IslandMobility { weights, slots, context };
        self.island.project(response, &context.tuning, context.velocity_weight)
    }

    fn linearise(&mut self, _pass: usize) -> Option<(usize, f64)> {
        let (row, gap, _) = self.island.farthest_off(self.context.tuning.tolerance)?;
        self.island.set_free_gaps(Instant::End);
        Some((row, gap))
    }
}

/// The mobility of an island's slots.
struct IslandMobility<'a, const D: usize, M> {
    /// `c` times the mobility of each slot.
    weights: &'a [f64],
    slots: &'a [Slot<D>],
    context: &'a SolveContext<'a, M>,
}

impl<const D: usize, M: Mobility<D>> IslandMobility<'_, D, M> {
    /// By the mobility of all particles.
    fn couple(&self, motions: &mut [Vector<D>]) {
        let SolveContext { mobility, order, radii, velocity_weight, .. } = self.context;
        let mut forces = vec![Vector::zeros(); order.len()];
        let mut velocities = forces.clone();
        let particle = |slot: &Slot<D>| order[slot.place as usize] as usize;
        for (slot, force) in self.slots.iter().zip(&*motions).skip(1) {
            forces[particle(slot)] = *force;
        }
        mobility.apply(radii, &forces, &mut velocities);
        for (slot, motion) in self.slots.iter().zip(&mut *motions).skip(1) {
            *motion = velocities[particle(slot)] * *velocity_weight;
        }
        motions[0] = Vector::zeros();
    }
}

impl<const D: usize, M: Mobility<D>> Response<NormalRow<D>> for IslandMobility<'_, D, M> {
    const IS_COUPLED: bool = M::COUPLED;

    fn respond(&self, motions: &mut [Vector<D>]) {
        if M::COUPLED {
            self.couple(motions);
        } else {
            motions.iter_mut().zip(self.weights).for_each(|(motion, weight)| *motion *= *weight);
        }
    }

    /// With the roots of the weights, which are squared in `A`; none for a mobility that couples particles.
    fn factor(&self, rows: &[NormalRow<D>]) -> Option<Factor> {
        if M::COUPLED {
            return None;
        }
        let factor = Factor::new(D * self.slots.len());
        Some(with_rows(factor, rows, self.weights, |slot| slot as usize))
    }
}

/// The rows of a factor, with the roots of the weights; particles of slots have these numbers.
fn with_rows<const D: usize>(
    mut factor: Factor,
    rows: &[NormalRow<D>],
    weights: &[f64],
    number: impl Fn(u32) -> usize,
) -> Factor {
    for row in rows {
        // What does not move has no degrees of freedom.
        let end = |slot: u32, sign: f64| {
            let (root, first) = (sign * weights[slot as usize].sqrt(), D * number(slot));
            let entries = (0..D).map(move |d| (first + d, root * row.normal[d]));
            entries.filter(|(_, value)| *value != 0.0)
        };
        factor.push(end(row.tail, -1.0).chain(end(row.head, 1.0)));
    }
    factor
}
