//! The projection of one step, linearised until the gaps at its end are exact.
//!
//! Where bodies lie along each other the closest points jump from end to end as they turn. A pair therefore keeps the points
//! it has met in the step: those where it is closest now carry its memory, the others can push.

use gluey_geom::{Dim, Matrix, Space, Twist, Vector};

use super::closest::{closest, frame};
use super::{Shape, ShapeStep, displaced};
use crate::solver::{DelassusOperator, Projection};
use crate::{
    Contact, ContactError, ContactParams, ContactReport, ContactState, Mobility, PairKey, StepGeometry,
    WorstPair,
};

/// Points of contact nearer than this many summed roundings are the same, and follow the bodies; fewer in every further pass. Points that go on jumping between rods nearly parallel are thus told apart, until they enclose the right one.
const SAME_POINT: (f64, f64) = (0.5, 0.75);
/// Forces act along the normals of the beginning of the step, as in [`crate::PairContact`], in so many passes. That converges
/// where normals turn as the bodies do; between such rods they turn much faster, and are then taken from the end of the step.
const FIRST_PASSES: usize = 10;

/// Two bodies that may touch.
#[derive(Clone, Debug)]
struct Pair<const D: usize> {
    ends: [usize; 2],
    /// From the first to the second at the beginning of the step.
    normal: Vector<D>,
    /// Points of the cores that are closest at the beginning, from the centres.
    arms: [Vector<D>; 2],
    /// Sum of the roundings.
    rest: f64,
    gamma: f64,
    last: f64,
    /// Smallest force of the closest point.
    floor: f64,
    takes_part: bool,
    /// Gap where the bodies were last moved to.
    gap: f64,
    /// Row of the closest points.
    main: usize,
}

/// A point of contact.
#[derive(Clone, Debug)]
struct Row<const D: usize> {
    pair: usize,
    /// Points of the cores in the frames of their bodies.
    points: [Vector<D>; 2],
    /// The same in space, from the centres.
    arms: [Vector<D>; 2],
    /// Direction of the force.
    normal: Vector<D>,
    force: f64,
}

/// What is solved for in a step.
pub(super) struct Problem<'a, const D: usize, S>
where
    Dim<D>: Space<D>,
{
    step: &'a ShapeStep<'a, D, S>,
    /// The step as the laws of memory see it.
    law: StepGeometry<'a, D>,
    params: &'a ContactParams,
    tolerance: f64,
    free: &'a [Twist<D>],
    /// `c` times the mobility of each body, for translation and rotation.
    weights: Vec<[f64; 2]>,
    pairs: Vec<Pair<D>>,
    rows: Vec<Row<D>>,
    /// Displacements, and the frames they turn the bodies to.
    pub moved: Vec<Twist<D>>,
    frames: Vec<Matrix<D>>,
    /// Changes of the twists.
    pub changes: Vec<Twist<D>>,
}

impl<'a, const D: usize, S: Shape<D>> Problem<'a, D, S>
where
    Dim<D>: Space<D>,
{
    pub(super) fn new<M: Mobility<D>>(
        step: &'a ShapeStep<'a, D, S>,
        params: &'a ContactParams,
        mobility: &M,
        free: &'a [Twist<D>],
        near: &[(u32, u32)],
        state: &ContactState,
    ) -> Result<Self, ContactError> {
        let weight = |(body, shape): (usize, &S)| {
            let a = shape.drag_radius();
            let translation = step.velocity_weight * mobility.own(body, a);
            // 8 pi eta a^3 beside 6 pi eta a.
            [translation, translation * 3.0 / (4.0 * a * a)]
        };
        let law = StepGeometry {
            positions: &[],
            radii: &[],
            drift: &[],
            velocity_weight: step.velocity_weight,
            dt: step.dt,
        };
        let mut problem = Self {
            law,
            params,
            tolerance: tolerance(step, params, free),
            free,
            weights: step.shapes.iter().enumerate().map(weight).collect(),
            pairs: Vec::new(),
            rows: Vec::new(),
            moved: vec![Twist::default(); free.len()],
            frames: step.poses.iter().map(|pose| frame(&pose.orientation)).collect(),
            changes: vec![Twist::default(); free.len()],
            step,
        };
        for &(i, j) in near {
            let pair = problem.pair([i as usize, j as usize], state)?;
            // Two bodies that do not give way need no keeping apart.
            if pair.ends.iter().any(|&body| problem.weights[body][0] > 0.0) {
                problem.pairs.push(pair);
            }
        }
        Ok(problem)
    }

    fn pair(&self, ends: [usize; 2], state: &ContactState) -> Result<Pair<D>, ContactError> {
        let pair = PairKey::new(ends[0], ends[1]);
        let arms = self.closest(ends).ok_or(ContactError::Entangled { pair })?;
        let separation = self.separation(ends, &arms);
        let rest = ends.iter().map(|&body| self.step.shapes[body].rounding()).sum();
        let memory = state.get(pair);
        Ok(Pair {
            ends,
            normal: separation.normalize(),
            arms,
            rest,
            gamma: memory.gamma,
            last: memory.lambda,
            floor: self.params.floor(memory.gamma, memory.lambda, &self.law),
            takes_part: memory.gamma < 0.0 || memory.lambda != 0.0,
            gap: separation.norm() - rest,
            main: usize::MAX,
        })
    }

    /// Projects on the pairs that take part, until no other closes.
    pub(super) fn solve(&mut self) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        self.moved.copy_from_slice(self.free);
        while self.admit() {
            self.move_to_start();
            // The first linearisation is about the bodies where they are.
            self.refresh(1);
            loop {
                report.passes += 1;
                self.project(&mut report)?;
                self.move_to_end();
                let off = if self.params.exact_gap { self.refresh(report.passes) } else { None };
                let Some((pair, gap)) = off else { break };
                if report.passes >= self.params.pass_limit {
                    return Err(ContactError::GapNotClosed { pair, gap, passes: report.passes });
                }
            }
        }
        self.summarise(&mut report);
        Ok(report)
    }

    /// Lets pairs that close take part; whether there are any new ones.
    fn admit(&mut self) -> bool {
        self.turn_frames();
        // Those that remember take part from the beginning.
        let mut changed = self.rows.is_empty() && self.pairs.iter().any(|pair| pair.takes_part);
        for k in 0..self.pairs.len() {
            let pair = &self.pairs[k];
            if !pair.takes_part && self.closes(pair) {
                self.pairs[k].takes_part = true;
                changed = true;
            }
        }
        changed
    }

    fn closes(&self, pair: &Pair<D>) -> bool {
        let linear = pair.gap + rate(&pair.normal, &pair.arms, pair.ends, &self.moved);
        linear < 0.0 || self.params.exact_gap && self.gap_now(pair, &pair.arms).0 < -self.tolerance
    }

    fn move_to_start(&mut self) {
        self.moved.fill(Twist::default());
        self.turn_frames();
    }

    fn move_to_end(&mut self) {
        for (moved, (free, change)) in self.moved.iter_mut().zip(self.free.iter().zip(&self.changes)) {
            *moved = *free + *change * self.step.velocity_weight;
        }
        self.turn_frames();
    }

    fn turn_frames(&mut self) {
        for (matrix, (pose, by)) in self.frames.iter_mut().zip(self.step.poses.iter().zip(&self.moved)) {
            *matrix = frame(&displaced(pose, by).orientation);
        }
    }

    /// Closest points of two cores where the bodies are now, from their centres.
    fn closest(&self, ends: [usize; 2]) -> Option<[Vector<D>; 2]> {
        let shapes = ends.map(|body| &self.step.shapes[body]);
        let frames = ends.map(|body| &self.frames[body]);
        closest(shapes, frames, &self.separation(ends, &[Vector::zeros(); 2]))
    }

    /// Vector between two points of two bodies where they are now.
    fn separation(&self, [i, j]: [usize; 2], arms: &[Vector<D>; 2]) -> Vector<D> {
        let at = |body: usize| self.step.poses[body].position + self.moved[body].velocity;
        at(j) + arms[1] - (at(i) + arms[0])
    }

    /// Gap of a pair where the bodies are now, and the closest points from the centres. Where the cores have passed each other
    /// the gap is that along the normal, between points known before.
    fn gap_now(&self, pair: &Pair<D>, known: &[Vector<D>; 2]) -> (f64, [Vector<D>; 2]) {
        let is_ahead = |arms: &[Vector<D>; 2]| self.separation(pair.ends, arms).dot(&pair.normal) > 0.0;
        match self.closest(pair.ends).filter(is_ahead) {
            Some(arms) => (self.separation(pair.ends, &arms).norm() - pair.rest, arms),
            None => (self.separation(pair.ends, known).dot(&pair.normal) - pair.rest, *known),
        }
    }

    /// Finds the gaps and closest points where the bodies are now. Returns the pair whose gap is farthest from what it should be,
    /// beyond the tolerance.
    fn refresh(&mut self, pass: usize) -> Option<(PairKey, f64)> {
        let (mut farthest, mut largest) = (None, 2.0 * self.tolerance);
        for k in 0..self.rows.len() {
            let Row { pair, points, .. } = &self.rows[k];
            let ends = self.pairs[*pair].ends;
            self.rows[k].arms = [0, 1].map(|side| self.frames[ends[side]] * points[side]);
        }
        for k in (0..self.pairs.len()).filter(|&k| self.pairs[k].takes_part).collect::<Vec<_>>() {
            let pair = &self.pairs[k];
            let known = self.rows.get(pair.main).map_or(pair.arms, |row| row.arms);
            let (gap, arms) = self.gap_now(pair, &known);
            let slack = self
                .rows
                .get(pair.main)
                .map_or(f64::INFINITY, |row| self.compliance(row) * (row.force - pair.floor));
            let off = gap.min(slack).abs();
            if off > largest {
                (farthest, largest) = (Some((PairKey::new(pair.ends[0], pair.ends[1]), gap)), off);
            }
            self.pairs[k].gap = gap;
            self.pairs[k].main = self.row_at(k, arms, pass);
        }
        if pass > FIRST_PASSES {
            self.turn_normals();
        }
        farthest
    }

    /// Takes the normals of where the bodies are now; those between round bodies stay, as in [`crate::PairContact`].
    fn turn_normals(&mut self) {
        for k in 0..self.rows.len() {
            let Row { pair, arms, .. } = &self.rows[k];
            if arms.iter().any(|arm| arm.norm() > 0.0) {
                self.rows[k].normal = self.separation(self.pairs[*pair].ends, arms).normalize();
            }
        }
    }

    /// The row of a pair at these points of contact, moved there from nearby or new.
    fn row_at(&mut self, pair: usize, arms: [Vector<D>; 2], pass: usize) -> usize {
        let Pair { ends, rest, last, main, normal, .. } = self.pairs[pair];
        let points = [0, 1].map(|side| self.frames[ends[side]].tr_mul(&arms[side]));
        let same = SAME_POINT.0 * SAME_POINT.1.powi(pass as i32 - 1);
        let is_near = |row: &Row<D>| {
            let apart = (row.points[0] - points[0]).norm() + (row.points[1] - points[1]).norm();
            row.pair == pair && apart <= same * rest
        };
        let at = self.rows.iter().position(is_near).unwrap_or(self.rows.len());
        if let Some(row) = self.rows.get_mut(at) {
            (row.points, row.arms) = (points, arms);
            return at;
        }
        // The first row starts with the last force.
        let force = if main == usize::MAX { last } else { 0.0 };
        self.rows.push(Row { pair, points, arms, normal, force });
        at
    }

    /// Displacement of the gap that a unit force makes, `c G M^-1 G^T`.
    fn compliance(&self, row: &Row<D>) -> f64 {
        let pair = &self.pairs[row.pair];
        let part = |side: usize| {
            let [translation, rotation] = self.weights[pair.ends[side]];
            let torque = Dim::<D>::moment(&row.arms[side], &row.normal);
            translation + rotation * Dim::<D>::spin_slice(&torque).iter().map(|x| x * x).sum::<f64>()
        };
        part(0) + part(1)
    }

    /// Solves the problem that is linear about where the bodies are now.
    fn project(&mut self, report: &mut ContactReport) -> Result<(), ContactError> {
        // Rows are scaled to the same compliance.
        let compliances: Vec<f64> = self.rows.iter().map(|row| self.compliance(row)).collect();
        let largest = compliances.iter().copied().fold(0.0, f64::max);
        let scales: Vec<f64> = compliances.iter().map(|own| (largest / own).sqrt()).collect();
        let (mut free_gaps, mut floors, mut forces, mut arrows) = (vec![], vec![], vec![], vec![]);
        for (k, (row, scale)) in self.rows.iter().zip(&scales).enumerate() {
            let pair = &self.pairs[row.pair];
            let is_main = pair.main == k;
            // Elsewhere than where they are closest, points that touched in an earlier pass keep their distance.
            let gap =
                if is_main { pair.gap } else { self.separation(pair.ends, &row.arms).norm() - pair.rest };
            let beyond: f64 = rate(&row.normal, &row.arms, pair.ends, self.free)
                - rate(&row.normal, &row.arms, pair.ends, &self.moved);
            free_gaps.push(scale * (gap + beyond));
            floors.push(if is_main { pair.floor / scale } else { 0.0 });
            forces.push(row.force / scale);
            arrows.push(Arrow { normal: row.normal * *scale, arms: row.arms, ends: pair.ends });
        }
        let mut operator = Operator { arrows: &arrows, weights: &self.weights, twists: &mut self.changes };
        let solver = self.params.solver.method();
        let mut scratch = vec![0.0; solver.scratch_count() * forces.len()];
        let mut problem = Projection {
            operator: &mut operator,
            free_gaps: &free_gaps,
            floors: &floors,
            tolerance: self.tolerance,
            iteration_limit: self.params.iteration_limit,
        };
        let solved = solver.solve(&mut problem, &mut forces, &mut scratch);
        let key = |row: usize| PairKey::new(arrows[row].ends[0], arrows[row].ends[1]);
        let solved = solved.map_err(|failure| ContactError::of_solve(&failure, self.tolerance, key))?;
        operator.spread(&forces);
        report.iterations += solved.iterations;
        report.residual = solved.residual;
        for change in &mut self.changes {
            *change = *change * (1.0 / self.step.velocity_weight);
        }
        for ((row, force), scale) in self.rows.iter_mut().zip(forces).zip(scales) {
            row.force = force * scale;
        }
        self.drop_idle();
        Ok(())
    }

    /// Forgets the points that push no longer, but for the closest ones: near the others they only make the problem worse.
    fn drop_idle(&mut self) {
        for (k, row) in std::mem::take(&mut self.rows).into_iter().enumerate() {
            let is_main = self.pairs[row.pair].main == k;
            if is_main {
                self.pairs[row.pair].main = self.rows.len();
            }
            if is_main || row.force > 0.0 {
                self.rows.push(row);
            }
        }
    }

    fn summarise(&mut self, report: &mut ContactReport) {
        let taking_part: Vec<usize> = (0..self.pairs.len()).filter(|&k| self.pairs[k].takes_part).collect();
        for &k in &taking_part {
            let pair = &self.pairs[k];
            (self.pairs[k].gap, _) = self.gap_now(pair, &pair.arms);
        }
        report.pair_count = taking_part.len();
        report.active_count = taking_part.iter().filter(|&&k| self.force(k) != 0.0).count();
        let worst = taking_part.iter().map(|&k| &self.pairs[k]).min_by(|a, b| a.gap.total_cmp(&b.gap));
        report.worst =
            worst.map(|pair| WorstPair { pair: PairKey::new(pair.ends[0], pair.ends[1]), gap: pair.gap });
    }

    /// Force of a pair, over all its points of contact.
    fn force(&self, pair: usize) -> f64 {
        self.rows.iter().filter(|row| row.pair == pair).map(|row| row.force).sum()
    }

    /// The contacts after the step.
    pub(super) fn contacts(&self) -> Vec<Contact> {
        let mut contacts = Vec::new();
        for (k, pair) in self.pairs.iter().enumerate().filter(|(_, pair)| pair.takes_part) {
            let lambda = self.force(k);
            let gamma = self.params.update(pair.gamma, pair.last, lambda, &self.law);
            // A force that moves the pair by less than the tolerance is rounding noise.
            let moved = pair.ends.iter().map(|&body| self.weights[body][0]).sum::<f64>() * lambda;
            if gamma < 0.0 || moved.abs() > self.tolerance {
                let key = PairKey::new(pair.ends[0], pair.ends[1]);
                contacts.push(Contact { pair: key, lambda, gamma, gap: pair.gap });
            }
        }
        contacts
    }
}

/// [`ContactParams::residual`] of bodies that reach beyond their centres.
fn tolerance<const D: usize, S: Shape<D>>(
    step: &ShapeStep<'_, D, S>,
    params: &ContactParams,
    free: &[Twist<D>],
) -> f64
where
    Dim<D>: Space<D>,
{
    let radius = step.shapes.iter().map(Shape::rounding).fold(f64::INFINITY, f64::min);
    let reach = step.shapes.iter().map(Shape::reach).fold(0.0, f64::max);
    let farthest = free.iter().map(|by| by.velocity.norm()).fold(0.0, f64::max);
    let extent = step.poses.iter().map(|pose| pose.position.amax()).fold(0.0, f64::max);
    params.residual(radius, farthest, extent + reach)
}

/// `G V` for the twists of all bodies.
fn rate<const D: usize>(
    normal: &Vector<D>,
    arms: &[Vector<D>; 2],
    [i, j]: [usize; 2],
    twists: &[Twist<D>],
) -> f64
where
    Dim<D>: Space<D>,
{
    normal.dot(&(twists[j].velocity_at(&arms[1]) - twists[i].velocity_at(&arms[0])))
}

/// A row as the operator sees it: its scaled normal, arms and bodies.
struct Arrow<const D: usize> {
    normal: Vector<D>,
    arms: [Vector<D>; 2],
    ends: [usize; 2],
}

/// `S A S`, `A = c G M^-1 G^T`.
struct Operator<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    arrows: &'a [Arrow<D>],
    weights: &'a [[f64; 2]],
    twists: &'a mut [Twist<D>],
}

impl<const D: usize> Operator<'_, D>
where
    Dim<D>: Space<D>,
{
    /// `c M^-1 G^T S forces`.
    fn spread(&mut self, forces: &[f64]) {
        self.twists.fill(Twist::default());
        for (Arrow { normal, arms, ends }, force) in self.arrows.iter().zip(forces) {
            for ((body, arm), sign) in ends.iter().zip(arms).zip([-1.0, 1.0]) {
                let push = normal * (sign * force);
                let twist = &mut self.twists[*body];
                twist.velocity += push;
                twist.spin += Dim::<D>::moment(arm, &push);
            }
        }
        for (twist, [translation, rotation]) in self.twists.iter_mut().zip(self.weights) {
            twist.velocity *= *translation;
            twist.spin = twist.spin * *rotation;
        }
    }
}

impl<const D: usize> DelassusOperator for Operator<'_, D>
where
    Dim<D>: Space<D>,
{
    fn apply(&mut self, forces: &[f64], gaps: &mut [f64]) {
        self.spread(forces);
        for (gap, Arrow { normal, arms, ends }) in gaps.iter_mut().zip(self.arrows) {
            *gap = rate(normal, arms, *ends, self.twists);
        }
    }
}
