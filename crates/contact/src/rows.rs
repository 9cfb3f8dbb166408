//! Contacts as rows of the constraints: gap, normal, and which two bodies they join.

use gluey_geom::Vector;

use crate::graph::{Graph, Link};
use crate::{ContactError, Domain, StepGeometry};

/// Stands for the tail of a contact with a wall.
pub(crate) const GROUND: u32 = u32::MAX;

/// A contact that takes part in a step. The normal points from `tail` to `head`, which are in the order of
/// space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<const D: usize> {
    pub link: u32,
    /// Place of the tail, or [`GROUND`].
    pub tail: u32,
    /// Place of the head.
    pub head: u32,
    /// Displacement of the head's image.
    pub shift: Vector<D>,
    pub normal: Vector<D>,
    /// What to subtract from the distance: the sum of the radii; for a wall, its offset at the end of the
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
    /// The row of a link.
    pub(crate) fn new(
        link: usize,
        graph: &Graph<D>,
        domain: &Domain<D>,
        step: &StepGeometry<'_, D>,
    ) -> Result<Self, ContactError> {
        let Link { tail, head, image } = graph.links[link];
        if let Some(number) = graph.wall(&graph.links[link]) {
            let wall = &domain.walls[number];
            let rest = wall.offset + wall.speed * step.dt + graph.radii[head as usize];
            let row = Self {
                link: link as u32,
                tail: GROUND,
                head,
                shift: Vector::zeros(),
                normal: wall.normal,
                rest,
                is_flat: true,
                rank: (tail, graph.ranks[head as usize], [0; 3]),
            };
            return Ok(row);
        }
        let ranks = [tail, head].map(|place| graph.ranks[place as usize]);
        let (tail, head, image) =
            if ranks[0] < ranks[1] { (tail, head, image) } else { (head, tail, image.map(|n| -n)) };
        let shift = domain.shift(&image);
        let separation = graph.positions[head as usize] + shift - graph.positions[tail as usize];
        let (distance, rest) = (separation.norm(), graph.radii[tail as usize] + graph.radii[head as usize]);
        if distance <= COINCIDENT * rest {
            return Err(ContactError::Coincident { pair: graph.key(&graph.links[link]) });
        }
        Ok(Self {
            link: link as u32,
            tail,
            head,
            shift,
            normal: separation / distance,
            rest,
            is_flat: false,
            rank: (ranks[0].min(ranks[1]), ranks[0].max(ranks[1]), image),
        })
    }

    /// Vector between the centres (from the origin, for a wall) when places have moved by `displacements`.
    pub(crate) fn separation(&self, positions: &[Vector<D>], displacements: &[Vector<D>]) -> Vector<D> {
        // As the integrator does it: first each end position, rounded, then their difference.
        let end = |place: u32| positions[place as usize] + displacements[place as usize];
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

/// Whether a link's linearised gap after `displacements` (by place) is below `margin` times its summed radii,
/// or has no direction.
pub(crate) fn closes<const D: usize>(
    link: &Link,
    graph: &Graph<D>,
    domain: &Domain<D>,
    dt: f64,
    displacements: &[Vector<D>],
    margin: f64,
) -> bool {
    let head = link.head as usize;
    if let Some(number) = graph.wall(link) {
        let wall = &domain.walls[number];
        let end = graph.positions[head] + displacements[head];
        return wall.distance(&end) - wall.speed * dt < (1.0 + margin) * graph.radii[head];
    }
    let tail = link.tail as usize;
    let separation = graph.positions[head] + domain.shift(&link.image) - graph.positions[tail];
    let approach = displacements[head] - displacements[tail];
    let (square, rest) = (separation.norm_squared(), graph.radii[tail] + graph.radii[head]);
    if square <= (COINCIDENT * rest).powi(2) {
        return true;
    }
    // |x| - rest + x.s/|x| < margin rest, without the division.
    square + separation.dot(&approach) < (1.0 + margin) * rest * square.sqrt()
}
