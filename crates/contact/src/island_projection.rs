//! The projection, island by island.
//!
//! Rows are scaled to the same compliance, `A_kk = c (1/a_i + 1/a_j)`: with `s_k = sqrt(max A / A_kk)` the solvers see
//! `S A S`, gaps `s_k w_k` and forces `lambda_k / s_k`.

use gluey_geom::Vector;

use crate::islands::{Island, Islands, Slot};
use crate::rows::{GROUND, Row};
use crate::solver::{DelassusOperator, Factor, Projection, ProjectionSolver, SolveFailure, SolveReport};
use crate::{ContactParams, Mobility, StepGeometry};

/// What all islands of a step share.
pub(crate) struct Setting<'a, const D: usize, M> {
    pub step: &'a StepGeometry<'a, D>,
    pub params: &'a ContactParams,
    pub mobility: &'a M,
    pub solver: &'a dyn ProjectionSolver,
    /// Residual to reach; unit: length.
    pub tolerance: f64,
    /// Particle of each place.
    pub order: &'a [u32],
}

/// Vectors of all islands.
#[derive(Debug)]
pub(crate) struct Work<const D: usize> {
    /// Forces over `6 pi eta`, one a row.
    pub forces: Vec<f64>,
    /// Smallest forces, one a row.
    pub floors: Vec<f64>,
    /// Changes of velocity, one a slot.
    pub changes: Vec<Vector<D>>,
    pub outcomes: Vec<Outcome>,
    free_gaps: Vec<f64>,
    scales: Vec<f64>,
    arrows: Vec<Arrow<D>>,
    moved: Vec<Vector<D>>,
    scratch: Vec<f64>,
}

impl<const D: usize> Default for Work<D> {
    fn default() -> Self {
        Self {
            forces: Vec::new(),
            floors: Vec::new(),
            changes: Vec::new(),
            outcomes: Vec::new(),
            free_gaps: Vec::new(),
            scales: Vec::new(),
            arrows: Vec::new(),
            moved: Vec::new(),
            scratch: Vec::new(),
        }
    }
}

/// What became of an island.
pub(crate) type Outcome = Result<Effort, Failure>;

/// Effort and accuracy of an island.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Effort {
    pub iterations: usize,
    pub passes: usize,
    pub residual: f64,
}

/// Why an island could not be solved. Rows are counted over all islands.
#[derive(Clone, Debug)]
pub(crate) enum Failure {
    Solve(SolveFailure),
    Gap { row: usize, gap: f64, passes: usize },
}

/// A row as the operator sees it: its scaled normal and its two slots.
#[derive(Clone, Copy, Debug)]
struct Arrow<const D: usize> {
    normal: Vector<D>,
    tail: u32,
    head: u32,
}

impl<const D: usize> Work<D> {
    /// Makes room for `islands`, whose rows start with `forces` and are bounded by `floors`.
    pub(crate) fn prepare(
        &mut self,
        islands: &Islands<D>,
        solver: &dyn ProjectionSolver,
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
        self.arrows.resize(row_count, Arrow { normal: Vector::zeros(), tail: 0, head: 0 });
        self.changes.resize(islands.slots.len(), Vector::zeros());
        self.moved.resize(islands.slots.len(), Vector::zeros());
        self.scratch.resize(row_count * solver.scratch_count(), 0.0);
        self.outcomes.clear();
        self.outcomes.resize_with(islands.islands.len(), || Ok(Effort::default()));
    }

    /// Solves for the islands that are fresh.
    pub(crate) fn solve<M: Mobility<D>>(&mut self, islands: &Islands<D>, setting: &Setting<'_, D, M>) {
        let part = Part {
            islands: &islands.islands,
            rows: &islands.rows,
            ends: &islands.ends,
            slots: &islands.slots,
            weights: &islands.weights,
            forces: &mut self.forces,
            floors: &mut self.floors,
            free_gaps: &mut self.free_gaps,
            scales: &mut self.scales,
            arrows: &mut self.arrows,
            changes: &mut self.changes,
            moved: &mut self.moved,
            scratch: &mut self.scratch,
            outcomes: &mut self.outcomes,
            scratch_count: setting.solver.scratch_count(),
        };
        part.solve(setting);
    }
}

/// Some consecutive islands and what belongs to them.
struct Part<'a, const D: usize> {
    islands: &'a [Island],
    rows: &'a [Row<D>],
    ends: &'a [[u32; 2]],
    slots: &'a [Slot<D>],
    weights: &'a [f64],
    forces: &'a mut [f64],
    floors: &'a mut [f64],
    free_gaps: &'a mut [f64],
    scales: &'a mut [f64],
    arrows: &'a mut [Arrow<D>],
    changes: &'a mut [Vector<D>],
    moved: &'a mut [Vector<D>],
    scratch: &'a mut [f64],
    outcomes: &'a mut [Outcome],
    scratch_count: usize,
}

/// Parts with fewer rows are not worth another thread.
const ROWS_PER_TASK: usize = 512;

impl<'a, const D: usize> Part<'a, D> {
    fn solve<M: Mobility<D>>(self, setting: &Setting<'_, D, M>) {
        if self.islands.len() > 1 && self.rows.len() > ROWS_PER_TASK {
            let (left, right) = self.halve();
            rayon::join(|| left.solve(setting), || right.solve(setting));
        } else {
            self.solve_in_turn(setting);
        }
    }

    fn solve_in_turn<M: Mobility<D>>(mut self, setting: &Setting<'_, D, M>) {
        while !self.islands.is_empty() {
            let (mut first, rest) = self.split(1);
            if first.islands[0].is_fresh {
                first.outcomes[0] = first.solve_one(setting);
            }
            self = rest;
        }
    }

    /// Two parts with about as many rows each.
    fn halve(self) -> (Self, Self) {
        let base = self.islands[0].rows.start;
        let middle = base + self.rows.len() / 2;
        let count = self.islands.partition_point(|island| island.rows.end <= middle);
        let most = self.islands.len() - 1;
        self.split(count.clamp(1, most))
    }

    /// The first `count` islands, and the others.
    fn split(self, count: usize) -> (Self, Self) {
        let (row_start, slot_start) = (self.islands[0].rows.start, self.islands[0].slots.start);
        let last = &self.islands[count - 1];
        let (row_count, slot_count) = (last.rows.end - row_start, last.slots.end - slot_start);
        let islands = self.islands.split_at(count);
        let outcomes = self.outcomes.split_at_mut(count);
        let rows = self.rows.split_at(row_count);
        let ends = self.ends.split_at(row_count);
        let forces = self.forces.split_at_mut(row_count);
        let floors = self.floors.split_at_mut(row_count);
        let free_gaps = self.free_gaps.split_at_mut(row_count);
        let scales = self.scales.split_at_mut(row_count);
        let arrows = self.arrows.split_at_mut(row_count);
        let scratch = self.scratch.split_at_mut(row_count * self.scratch_count);
        let slots = self.slots.split_at(slot_count);
        let weights = self.weights.split_at(slot_count);
        let changes = self.changes.split_at_mut(slot_count);
        let moved = self.moved.split_at_mut(slot_count);
        macro_rules! side {
            ($place:tt) => {
                Part {
                    islands: islands.$place,
                    rows: rows.$place,
                    ends: ends.$place,
                    slots: slots.$place,
                    weights: weights.$place,
                    forces: forces.$place,
                    floors: floors.$place,
                    free_gaps: free_gaps.$place,
                    scales: scales.$place,
                    arrows: arrows.$place,
                    changes: changes.$place,
                    moved: moved.$place,
                    scratch: scratch.$place,
                    outcomes: outcomes.$place,
                    scratch_count: self.scratch_count,
                }
            };
        }
        (side!(0), side!(1))
    }

    /// Solves the one island there is, with as many linearisations as its gaps need.
    fn solve_one<M: Mobility<D>>(&mut self, setting: &Setting<'_, D, M>) -> Outcome {
        self.scale();
        let mut effort = Effort::default();
        // The first linearisation is the paper's: about the particles where they are.
        self.moved.fill(Vector::zeros());
        loop {
            effort.passes += 1;
            self.linearise();
            self.project(setting, &mut effort)?;
            for (moved, (slot, change)) in self.moved.iter_mut().zip(self.slots.iter().zip(&*self.changes)) {
                *moved = slot.free + change * setting.step.velocity_weight;
            }
            let off = if setting.params.exact_gap { self.farthest_off(setting) } else { None };
            let Some((row, gap)) = off else { break };
            if effort.passes >= setting.params.pass_limit {
                let row = self.islands[0].rows.start + row;
                return Err(Failure::Gap { row, gap, passes: effort.passes });
            }
        }
        for (force, scale) in self.forces.iter_mut().zip(&*self.scales) {
            *force *= scale;
        }
        Ok(effort)
    }

    /// Compliance of a row to its own force, `A_kk`.
    fn compliance(&self, row: usize) -> f64 {
        let [tail, head] = self.ends[row].map(|slot| self.weights[slot as usize]);
        tail + head
    }

    fn scale(&mut self) {
        let largest = (0..self.rows.len()).map(|k| self.compliance(k)).fold(0.0, f64::max);
        for k in 0..self.rows.len() {
            let scale = (largest / self.compliance(k)).sqrt();
            let [tail, head] = self.ends[k];
            self.arrows[k] = Arrow { normal: self.rows[k].normal * scale, tail, head };
            self.scales[k] = scale;
            self.forces[k] /= scale;
            self.floors[k] /= scale;
        }
    }

    fn difference(&self, row: usize, value: impl Fn(usize) -> Vector<D>) -> Vector<D> {
        let [tail, head] = self.ends[row];
        value(head as usize) - value(tail as usize)
    }

    /// Gap of a row when slots have moved by `moved`.
    fn gap(&self, row: usize) -> f64 {
        let [tail, head] = self.ends[row].map(|slot| slot as usize);
        let end = |slot: usize| self.slots[slot].position + self.moved[slot];
        let separation = match self.rows[row].tail {
            GROUND => end(head),
            _ => end(head) + self.rows[row].shift - end(tail),
        };
        self.rows[row].gap_at(&separation)
    }

    /// Writes the gaps at the end of the step as linear functions of the velocities, about the displacements `moved`.
    ///
    /// The gaps are exact at `moved`, the normals those of the beginning of the step throughout: contact forces belong to
    /// `u^n`, which multi-step schemes extrapolate. Normals of the end of the step converge faster (by `phi^2/2` a pass
    /// here, `phi` the rotation of the pair in the step), but make the encounter of two spheres first order in dt.
    fn linearise(&mut self) {
        for k in 0..self.rows.len() {
            let beyond = self.difference(k, |slot| self.slots[slot].free - self.moved[slot]);
            let gap = self.gap(k) + self.rows[k].normal.dot(&beyond);
            self.free_gaps[k] = self.scales[k] * gap;
        }
    }

    fn project<M: Mobility<D>>(
        &mut self,
        setting: &Setting<'_, D, M>,
        effort: &mut Effort,
    ) -> Result<(), Failure> {
        let compliance = self.compliance(0);
        let mut operator = Operator {
            arrows: self.arrows,
            weights: self.weights,
            slots: self.slots,
            velocities: self.changes,
            setting,
        };
        let mut problem = Projection {
            operator: &mut operator,
            free_gaps: self.free_gaps,
            floors: self.floors,
            tolerance: setting.tolerance,
            iteration_limit: setting.params.iteration_limit,
        };
        let report = if self.rows.len() == 1 && !M::COUPLED {
            // One contact has a closed form.
            self.forces[0] = (-self.free_gaps[0] / compliance).max(self.floors[0]);
            SolveReport { iterations: 1, residual: 0.0 }
        } else {
            setting.solver.solve(&mut problem, self.forces, self.scratch).map_err(Failure::Solve)?
        };
        effort.iterations += report.iterations;
        effort.residual = report.residual;
        operator.spread(self.forces);
        let rate = setting.step.velocity_weight;
        self.changes.iter_mut().for_each(|change| *change /= rate);
        Ok(())
    }

    /// The row whose gap at the end of the step is farthest from what it should be, beyond the tolerance.
    fn farthest_off<M>(&self, setting: &Setting<'_, D, M>) -> Option<(usize, f64)> {
        let mut farthest = None;
        let mut largest = 2.0 * setting.tolerance;
        for k in 0..self.rows.len() {
            let gap = self.gap(k);
            let slack = self.compliance(k) * self.scales[k] * (self.forces[k] - self.floors[k]);
            let off = gap.min(slack).abs();
            if off > largest {
                (farthest, largest) = (Some((k, gap)), off);
            }
        }
        farthest
    }
}

/// `S A S`, `A = c B M^-1 B^T`.
struct Operator<'a, const D: usize, M> {
    arrows: &'a [Arrow<D>],
    weights: &'a [f64],
    slots: &'a [Slot<D>],
    velocities: &'a mut [Vector<D>],
    setting: &'a Setting<'a, D, M>,
}

impl<const D: usize, M: Mobility<D>> Operator<'_, D, M> {
    /// `c M^-1 B^T S forces`: forces are added up per particle in the order of the rows.
    fn spread(&mut self, forces: &[f64]) {
        self.velocities.fill(Vector::zeros());
        for (arrow, force) in self.arrows.iter().zip(forces) {
            let push = arrow.normal * *force;
            self.velocities[arrow.head as usize] += push;
            self.velocities[arrow.tail as usize] -= push;
        }
        if M::COUPLED {
            self.couple();
        } else {
            for (velocity, weight) in self.velocities.iter_mut().zip(self.weights) {
                *velocity *= *weight;
            }
        }
    }

    /// Forces of slots into velocities times `c`, by the mobility of all particles.
    fn couple(&mut self) {
        let Setting { step, mobility, order, .. } = self.setting;
        let mut forces = vec![Vector::zeros(); order.len()];
        let mut velocities = forces.clone();
        let particle = |slot: &Slot<D>| order[slot.place as usize] as usize;
        for (slot, force) in self.slots.iter().zip(&*self.velocities).skip(1) {
            forces[particle(slot)] = *force;
        }
        mobility.apply(step.radii, &forces, &mut velocities);
        for (slot, velocity) in self.slots.iter().zip(&mut *self.velocities).skip(1) {
            *velocity = velocities[particle(slot)] * step.velocity_weight;
        }
        self.velocities[0] = Vector::zeros();
    }
}

impl<const D: usize, M: Mobility<D>> DelassusOperator for Operator<'_, D, M> {
    fn apply(&mut self, forces: &[f64], gaps: &mut [f64]) {
        self.spread(forces);
        for (gap, arrow) in gaps.iter_mut().zip(self.arrows) {
            let apart = self.velocities[arrow.head as usize] - self.velocities[arrow.tail as usize];
            *gap = arrow.normal.dot(&apart);
        }
    }

    /// With the roots of the weights, which are squared in `A`; none for a mobility that joins all particles.
    fn factor(&self) -> Option<Factor> {
        if M::COUPLED {
            return None;
        }
        let mut factor = Factor::new(D * self.slots.len());
        for arrow in self.arrows {
            // What does not move has no degrees of freedom.
            let end = |slot: u32, sign: f64| {
                let root = sign * self.weights[slot as usize].sqrt();
                let entries = (0..D).map(move |d| (D * slot as usize + d, root * arrow.normal[d]));
                entries.filter(|(_, value)| *value != 0.0)
            };
            factor.push(end(arrow.tail, -1.0).chain(end(arrow.head, 1.0)));
        }
        Some(factor)
    }
}
