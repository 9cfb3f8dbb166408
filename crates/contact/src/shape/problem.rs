//! The projection of one step, linearised until the gaps at its end are exact.
//!
//! Where bodies lie along each other the closest points jump from end to end as they turn. A pair therefore
//! keeps the points it has met in the step: those where it is closest now carry its memory, the others can
//! push.

mod linearised;

use gluey_geom::{Matrix, Twist, Vector};

use super::bodies::Bodies;
use super::closest::{closest, frame};
use super::points::PointRow;
use super::{Shape, displaced};
use crate::delassus::JacobianRow;
use crate::memory::GammaRule;
use crate::projection::{self, Effort, Tuning};
use crate::solver::defect;
use crate::{Contact, ContactError, ContactParams, ContactReport, ContactState, PairKey, PairState};

/// Points of contact nearer than this many summed roundings are the same, and follow the bodies; fewer in
/// every further pass. Points that go on jumping between rods nearly parallel are thus told apart, until they
/// enclose the right one.
const SAME_POINT: (f64, f64) = (0.5, 0.75);
/// Forces act along the normals of the beginning of the step, as in [`crate::PairContact`], in so many
/// passes. That converges where normals turn as the bodies do; between such rods they turn much faster, and
/// are then taken from the end of the step.
const FIRST_PASSES: usize = 10;

/// Two bodies that may touch.
#[derive(Clone, Debug)]
struct ShapePair<const D: usize> {
    bodies: [usize; 2],
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
    /// Number of its closest points.
    main: usize,
}

/// A point of contact of a pair.
#[derive(Clone, Debug)]
struct ContactPoint<const D: usize> {
    pair: usize,
    /// Points of the cores in the frames of their bodies.
    points: [Vector<D>; 2],
    /// The same in space, from the centres.
    arms: [Vector<D>; 2],
    /// Direction of the force.
    normal: Vector<D>,
    force: f64,
}

/// The projection of one step.
pub(super) struct ShapeProjection<'a, const D: usize, S> {
    bodies: &'a Bodies<'a, D, S>,
    params: &'a ContactParams,
    rule: GammaRule,
    tuning: Tuning,
    pairs: Vec<ShapePair<D>>,
    points: Vec<ContactPoint<D>>,
    /// Displacements, and the frames they turn the bodies to.
    pub moved: Vec<Twist<D>>,
    frames: Vec<Matrix<D>>,
    /// Changes of the twists.
    pub changes: Vec<Twist<D>>,
}

impl<const D: usize> ShapePair<D> {
    fn key(&self) -> PairKey {
        PairKey::new(self.bodies[0], self.bodies[1])
    }
}

impl<'a, const D: usize, S: Shape<D>> ShapeProjection<'a, D, S> {
    pub(super) fn new(
        bodies: &'a Bodies<'a, D, S>,
        params: &'a ContactParams,
        near: &[(u32, u32)],
        state: &ContactState,
    ) -> Result<Self, ContactError> {
        let (step, count) = (bodies.step, bodies.free.len());
        let mut problem = Self {
            bodies,
            params,
            rule: GammaRule::new(params, step.velocity_weight, step.dt),
            tuning: Tuning {
                solver: params.solver.method(),
                tolerance: bodies.tolerance(params),
                iteration_limit: params.iteration_limit,
            },
            pairs: Vec::new(),
            points: Vec::new(),
            moved: vec![Twist::default(); count],
            frames: step.poses.iter().map(|pose| frame(&pose.orientation)).collect(),
            changes: vec![Twist::default(); count],
        };
        for &(i, j) in near {
            let pair = problem.pair([i as usize, j as usize], state)?;
            // Two bodies that do not give way need no keeping apart.
            if pair.bodies.iter().any(|&body| bodies.weights[body][0] > 0.0) {
                problem.pairs.push(pair);
            }
        }
        Ok(problem)
    }

    fn pair(&self, bodies: [usize; 2], state: &ContactState) -> Result<ShapePair<D>, ContactError> {
        let key = PairKey::new(bodies[0], bodies[1]);
        let arms = self.closest(bodies).ok_or(ContactError::Entangled { pair: key })?;
        let separation = self.separation(bodies, &arms);
        let rest = bodies.iter().map(|&body| self.bodies.shapes[body].rounding()).sum();
        let PairState { gamma, lambda, .. } = state.get(key);
        Ok(ShapePair {
            bodies,
            normal: separation.normalize(),
            arms,
            rest,
            gamma,
            last: lambda,
            floor: self.rule.floor(gamma, lambda),
            takes_part: gamma < 0.0 || lambda != 0.0,
            gap: separation.norm() - rest,
            main: usize::MAX,
        })
    }

    /// Projects on the pairs that take part, until no other closes.
    pub(super) fn solve(&mut self) -> Result<ContactReport, ContactError> {
        let (params, mut effort) = (self.params, Effort::default());
        self.moved.copy_from_slice(self.bodies.free);
        while self.admit() {
            projection::solve(self, params, &mut effort).map_err(|failure| {
                let pair = |k: usize| self.pairs[k].key();
                let row = |k: usize| pair(self.points[k].pair);
                ContactError::of_projection(&failure, self.tuning.tolerance, pair, row)
            })?;
        }
        Ok(self.summary(&effort))
    }

    /// Lets pairs that close take part; whether there are any new ones.
    fn admit(&mut self) -> bool {
        self.turn_frames();
        // Those that remember take part from the beginning.
        let mut changed = self.points.is_empty() && self.pairs.iter().any(|pair| pair.takes_part);
        for k in 0..self.pairs.len() {
            let pair = &self.pairs[k];
            if !pair.takes_part && self.closes(pair) {
                self.pairs[k].takes_part = true;
                changed = true;
            }
        }
        changed
    }

    fn closes(&self, pair: &ShapePair<D>) -> bool {
        let ShapePair { normal, arms, bodies, .. } = *pair;
        let linear = pair.gap + PointRow { normal, arms, bodies }.opening(&self.moved);
        linear < 0.0 || self.params.exact_gap && self.gap_now(pair, &pair.arms).0 < -self.tuning.tolerance
    }

    /// From `c` times the changes of the twists.
    fn move_to_end(&mut self) {
        for change in &mut self.changes {
            *change = *change * (1.0 / self.bodies.step.velocity_weight);
        }
        for (moved, (free, change)) in self.moved.iter_mut().zip(self.bodies.free.iter().zip(&self.changes)) {
            *moved = *free + *change * self.bodies.step.velocity_weight;
        }
        self.turn_frames();
    }

    fn turn_frames(&mut self) {
        for (matrix, (pose, by)) in self.frames.iter_mut().zip(self.bodies.step.poses.iter().zip(&self.moved))
        {
            *matrix = frame(&displaced(pose, by).orientation);
        }
    }

    /// Closest points of two cores where the bodies are now, from their centres.
    fn closest(&self, bodies: [usize; 2]) -> Option<[Vector<D>; 2]> {
        let shapes = bodies.map(|body| &self.bodies.shapes[body]);
        let frames = bodies.map(|body| &self.frames[body]);
        closest(shapes, frames, &self.separation(bodies, &[Vector::zeros(); 2]))
    }

    /// Vector between two points of two bodies where they are now.
    fn separation(&self, [i, j]: [usize; 2], arms: &[Vector<D>; 2]) -> Vector<D> {
        let at = |body: usize| self.bodies.step.poses[body].position + self.moved[body].velocity;
        at(j) + arms[1] - (at(i) + arms[0])
    }

    /// Gap of a pair where the bodies are now, and the closest points from the centres. Where the cores have
    /// passed each other the gap is that along the normal, between points known before.
    fn gap_now(&self, pair: &ShapePair<D>, known: &[Vector<D>; 2]) -> (f64, [Vector<D>; 2]) {
        let is_ahead = |arms: &[Vector<D>; 2]| self.separation(pair.bodies, arms).dot(&pair.normal) > 0.0;
        match self.closest(pair.bodies).filter(is_ahead) {
            Some(arms) => (self.separation(pair.bodies, &arms).norm() - pair.rest, arms),
            None => (self.separation(pair.bodies, known).dot(&pair.normal) - pair.rest, *known),
        }
    }

    /// Moves the known points of contact with their bodies.
    fn carry_points(&mut self) {
        for k in 0..self.points.len() {
            let ContactPoint { pair, points, .. } = &self.points[k];
            let bodies = self.pairs[*pair].bodies;
            self.points[k].arms = [0, 1].map(|side| self.frames[bodies[side]] * points[side]);
        }
    }

    /// How far a pair whose gap is `gap` is from what it should be.
    fn defect(&self, pair: &ShapePair<D>, gap: f64) -> f64 {
        let slack = |point: &ContactPoint<D>| {
            let compliance = self.row(point).compliance(&self.bodies.weights);
            compliance * (point.force - pair.floor)
        };
        defect(gap, self.points.get(pair.main).map_or(f64::INFINITY, slack))
    }

    /// Takes the normals of where the bodies are now; those between round bodies stay, as in
    /// [`crate::PairContact`].
    fn turn_normals(&mut self) {
        for k in 0..self.points.len() {
            let ContactPoint { pair, arms, .. } = &self.points[k];
            if arms.iter().any(|arm| arm.norm() > 0.0) {
                self.points[k].normal = self.separation(self.pairs[*pair].bodies, arms).normalize();
            }
        }
    }

    /// The point of contact of a pair at these arms, moved there from nearby or new.
    fn point_at(&mut self, pair: usize, arms: [Vector<D>; 2], pass: usize) -> usize {
        let ShapePair { bodies, rest, last, main, normal, .. } = self.pairs[pair];
        let points = [0, 1].map(|side| self.frames[bodies[side]].tr_mul(&arms[side]));
        let same = SAME_POINT.0 * SAME_POINT.1.powi(pass as i32 - 1);
        let is_near = |point: &ContactPoint<D>| {
            let distance = (point.points[0] - points[0]).norm() + (point.points[1] - points[1]).norm();
            point.pair == pair && distance <= same * rest
        };
        let at = self.points.iter().position(is_near).unwrap_or(self.points.len());
        if let Some(point) = self.points.get_mut(at) {
            (point.points, point.arms) = (points, arms);
            return at;
        }
        // The first point starts with the last force.
        let force = if main == usize::MAX { last } else { 0.0 };
        self.points.push(ContactPoint { pair, points, arms, normal, force });
        at
    }

    fn row(&self, point: &ContactPoint<D>) -> PointRow<D> {
        PointRow { normal: point.normal, arms: point.arms, bodies: self.pairs[point.pair].bodies }
    }

    /// Gap of a point at the end of the step without contact, linear about where the bodies are now.
    fn free_gap(&self, k: usize) -> f64 {
        let point = &self.points[k];
        let (pair, row) = (&self.pairs[point.pair], self.row(point));
        // Elsewhere than where they are closest, points that touched in an earlier pass keep their distance.
        let gap = match pair.main == k {
            true => pair.gap,
            false => self.separation(pair.bodies, &point.arms).norm() - pair.rest,
        };
        gap + (row.opening(self.bodies.free) - row.opening(&self.moved))
    }

    /// Smallest force of a point.
    fn floor(&self, k: usize) -> f64 {
        let pair = &self.pairs[self.points[k].pair];
        if pair.main == k { pair.floor } else { 0.0 }
    }

    /// Forgets the points that push no longer, but for the closest ones: near the others they only make the
    /// problem worse.
    fn drop_idle(&mut self) {
        for (k, point) in std::mem::take(&mut self.points).into_iter().enumerate() {
            let is_main = self.pairs[point.pair].main == k;
            if is_main {
                self.pairs[point.pair].main = self.points.len();
            }
            if is_main || point.force > 0.0 {
                self.points.push(point);
            }
        }
    }

    fn summary(&mut self, effort: &Effort) -> ContactReport {
        let Effort { iterations, passes, residual } = *effort;
        let mut report = ContactReport { iterations, passes, residual, ..ContactReport::default() };
        for k in (0..self.pairs.len()).filter(|&k| self.pairs[k].takes_part).collect::<Vec<_>>() {
            let pair = &self.pairs[k];
            let (gap, _) = self.gap_now(pair, &pair.arms);
            report.count_pair(gap, self.force(k), || pair.key());
            self.pairs[k].gap = gap;
        }
        report
    }

    /// Force of a pair, over all its points of contact.
    fn force(&self, pair: usize) -> f64 {
        self.points.iter().filter(|point| point.pair == pair).map(|point| point.force).sum()
    }

    /// The contacts after the step.
    pub(super) fn contacts(&self) -> impl Iterator<Item = Contact> {
        let taking_part = self.pairs.iter().enumerate().filter(|(_, pair)| pair.takes_part);
        taking_part.filter_map(|(k, pair)| {
            let lambda = self.force(k);
            let gamma = self.rule.update(pair.gamma, pair.last, lambda);
            // A force that moves the pair by less than the tolerance is rounding noise.
            let moved = pair.bodies.iter().map(|&body| self.bodies.weights[body][0]).sum::<f64>() * lambda;
            let is_contact = gamma < 0.0 || moved.abs() > self.tuning.tolerance;
            is_contact.then(|| Contact { pair: pair.key(), lambda, gamma, gap: pair.gap })
        })
    }
}
