//! Contacts as rows of the constraints: gap, normal, and which two bodies they join.

use gluey_geom::Vector;

use crate::delassus::JacobianRow;
use crate::neighbours::{Candidate, NeighbourList};
use crate::{ContactError, Domain, StepGeometry, Wall};

/// Stands for the tail of a contact with a wall.
pub(crate) const GROUND: u32 = u32::MAX;

/// A contact that takes part in a step. The normal points from `tail` to `head`, which are in the order of
/// space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<const D: usize> {
    pub candidate: u32,
    /// Place of the tail, or [`GROUND`].
    pub tail: u32,
    /// Place of the head.
    pub head: u32,
    /// Displacement of the head's image at the end of the step.
    pub shift: Vector<D>,
    /// How far the image slides in the step.
    pub slide: Vector<D>,
    pub normal: Vector<D>,
    /// Distance at contact: the sum of the radii; for a wall, its offset at the end of the
    /// step and a radius.
    pub rest: f64,
    /// Whether the distance is measured along the normal (a wall) or is that of the centres.
    pub is_flat: bool,
    /// Ranks of tail and head in the order of space, and the image of the head: the rows' own order.
    pub rank: (u32, u32, [i32; 3]),
}

/// Distances below this part of the summed radii have no direction but rounding noise.
const COINCIDENT: f64 = 1e-12;

impl<const D: usize> Row<D> {
    /// The row of a candidate.
    pub(crate) fn new(
        candidate: usize,
        neighbours: &NeighbourList<D>,
        domain: &Domain<D>,
        step: &StepGeometry<'_, D>,
    ) -> Result<Self, ContactError> {
        let Candidate { tail, head, image } = neighbours.candidates[candidate];
        if let Some(wall) = neighbours.wall(&neighbours.candidates[candidate]) {
            return Ok(Self::with_wall(candidate, neighbours, &domain.walls[wall], step.dt));
        }
        let ranks = [tail, head].map(|place| neighbours.ranks[place as usize]);
        let (tail, head, image) =
            if ranks[0] < ranks[1] { (tail, head, image) } else { (head, tail, image.map(|n| -n)) };
        let (start, shift) = (domain.shift(&image), domain.end_shift(&image));
        let separation = neighbours.positions[head as usize] + start - neighbours.positions[tail as usize];
        let (distance, rest) =
            (separation.norm(), neighbours.radii[tail as usize] + neighbours.radii[head as usize]);
        if distance <= COINCIDENT * rest {
            return Err(ContactError::Coincident { pair: neighbours.key(&neighbours.candidates[candidate]) });
        }
        Ok(Self {
            candidate: candidate as u32,
            tail,
            head,
            shift,
            slide: shift - start,
            normal: separation / distance,
            rest,
            is_flat: false,
            rank: (ranks[0].min(ranks[1]), ranks[0].max(ranks[1]), image),
        })
    }

    fn with_wall(candidate: usize, neighbours: &NeighbourList<D>, wall: &Wall<D>, dt: f64) -> Self {
        let Candidate { tail, head, .. } = neighbours.candidates[candidate];
        Self {
            candidate: candidate as u32,
            tail: GROUND,
            head,
            shift: Vector::zeros(),
            slide: Vector::zeros(),
            normal: wall.normal,
            rest: wall.offset + wall.speed * dt + neighbours.radii[head as usize],
            is_flat: true,
            rank: (tail, neighbours.ranks[head as usize], [0; 3]),
        }
    }

    /// Vector between the centres (from the origin, for a wall) when places have moved by `displacements`.
    pub(crate) fn separation(&self, positions: &[Vector<D>], displacements: &[Vector<D>]) -> Vector<D> {
        // As the integrator does it: first each end position, rounded, then their difference.
        self.between(|place| positions[place as usize] + displacements[place as usize])
    }

    /// The same for places whose ends are given.
    pub(crate) fn between(&self, end: impl Fn(u32) -> Vector<D>) -> Vector<D> {
        if self.tail == GROUND { end(self.head) } else { end(self.head) + self.shift - end(self.tail) }
    }

    /// Gap for such a vector.
    pub(crate) fn gap_at(&self, separation: &Vector<D>) -> f64 {
        let distance = if self.is_flat { self.normal.dot(separation) } else { separation.norm() };
        distance - self.rest
    }

    /// Gap when places have moved by `displacements`.
    pub(crate) fn gap_after(&self, positions: &[Vector<D>], displacements: &[Vector<D>]) -> f64 {
        self.gap_at(&self.separation(positions, displacements))
    }
}

/// The row `(-e, e)` of a contact between two slots.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NormalRow<const D: usize> {
    pub normal: Vector<D>,
    pub tail: u32,
    pub head: u32,
}

impl<const D: usize> JacobianRow for NormalRow<D> {
    type Motion = Vector<D>;
    type Weight = f64;

    fn zero() -> Vector<D> {
        Vector::zeros()
    }

    fn scaled(&self, factor: f64) -> Self {
        Self { normal: self.normal * factor, ..*self }
    }

    /// That of a unit normal, whatever the scale.
    fn compliance(&self, weights: &[f64]) -> f64 {
        weights[self.tail as usize] + weights[self.head as usize]
    }

    fn add_force(&self, force: f64, loads: &mut [Vector<D>]) {
        let push = self.normal * force;
        loads[self.head as usize] += push;
        loads[self.tail as usize] -= push;
    }

    fn opening(&self, motions: &[Vector<D>]) -> f64 {
        self.normal.dot(&(motions[self.head as usize] - motions[self.tail as usize]))
    }
}

/// Whether a candidate's linearised gap after `displacements` (by place) is below `margin` times its summed
/// radii, or has no direction.
pub(crate) fn closes<const D: usize>(
    candidate: &Candidate,
    neighbours: &NeighbourList<D>,
    domain: &Domain<D>,
    dt: f64,
    displacements: &[Vector<D>],
    margin: f64,
) -> bool {
    let head = candidate.head as usize;
    if let Some(number) = neighbours.wall(candidate) {
        let wall = &domain.walls[number];
        let end = neighbours.positions[head] + displacements[head];
        return wall.distance(&end) - wall.speed * dt < (1.0 + margin) * neighbours.radii[head];
    }
    let tail = candidate.tail as usize;
    let separation = neighbours.positions[head] + domain.shift(&candidate.image) - neighbours.positions[tail];
    let approach = displacements[head] + domain.slide(&candidate.image) - displacements[tail];
    let (square, rest) = (separation.norm_squared(), neighbours.radii[tail] + neighbours.radii[head]);
    if square <= (COINCIDENT * rest).powi(2) {
        return true;
    }
    // |x| - rest + x.s/|x| < margin rest, without the division.
    square + separation.dot(&approach) < (1.0 + margin) * rest * square.sqrt()
}
