//! The vectors that a sweep reads and writes, cut into the parts of chunks.

use std::ops::Range;

use gluey_linalg::Scalar;

use super::CellOperator;
use super::partition::NodePartition;
use super::scalar::CellScalar;

/// The fields that an operator is applied to.
#[derive(Clone, Copy)]
pub(super) struct Input<'a, X> {
    /// Velocities and twists; empty for none.
    pub(super) x: &'a [X],
    /// Nodal pressures; empty for none.
    pub(super) p: &'a [X],
    /// Whether rigid and hanging nodes are to be set first.
    pub(super) expand: bool,
}

/// Results of some chunks: of the nodes they own, of their ghosts, and of the bodies they touch.
pub(super) struct Output<'a, X> {
    pub(super) chunks: Range<usize>,
    pub(super) y: &'a mut [X],
    pub(super) q: &'a mut [X],
    pub(super) ghost_y: &'a mut [X],
    pub(super) ghost_q: &'a mut [X],
    pub(super) twists: &'a mut [X],
}

impl<'a, X> Output<'a, X> {
    /// The chunks before `chunk` and those from it on.
    pub(super) fn split_at<T: CellScalar, const D: usize>(
        mut self,
        operator: &CellOperator<T, D>,
        chunk: usize,
    ) -> (Self, Self) {
        (self.take_until(operator, chunk), self)
    }

    /// Cuts off the first chunk.
    pub(super) fn take_first<T: CellScalar, const D: usize>(
        &mut self,
        operator: &CellOperator<T, D>,
    ) -> Self {
        self.take_until(operator, self.chunks.start + 1)
    }

    /// Cuts off the chunks before `chunk`.
    fn take_until<T: CellScalar, const D: usize>(
        &mut self,
        operator: &CellOperator<T, D>,
        chunk: usize,
    ) -> Self {
        let start = std::mem::replace(&mut self.chunks.start, chunk);
        let (velocity, pressure) = (&operator.chunks.velocity, &operator.chunks.pressure);
        let nodes = |partition: &NodePartition| partition.first_of(chunk) - partition.first_of(start);
        let starts = |lists: &[u32]| (lists[chunk] - lists[start]) as usize;
        Self {
            chunks: start..chunk,
            y: cut_off(&mut self.y, nodes(velocity) * D),
            q: cut_off(&mut self.q, nodes(pressure)),
            ghost_y: cut_off(&mut self.ghost_y, starts(velocity.ghosts.starts()) * D),
            ghost_q: cut_off(&mut self.ghost_q, starts(pressure.ghosts.starts())),
            twists: cut_off(&mut self.twists, starts(operator.bodies.starts()) * CellOperator::<T, D>::TWIST),
        }
    }

    pub(super) fn clear(self)
    where
        X: Scalar,
    {
        for part in [self.y, self.q, self.ghost_y, self.ghost_q, self.twists] {
            part.fill(X::ZERO);
        }
    }
}

/// Cuts off the first `count` entries, or all that there are.
fn cut_off<'a, X>(rest: &mut &'a mut [X], count: usize) -> &'a mut [X] {
    let count = count.min(rest.len());
    let (first, second) = std::mem::take(rest).split_at_mut(count);
    *rest = second;
    first
}

/// Adds the contributions to ghosts to the nodes that `chunks` own, in the order of the contributing chunks.
pub(super) fn add_ghost_contributions<X: Scalar, const C: usize>(
    partition: &NodePartition,
    chunks: Range<usize>,
    y: &mut [X],
    ghosts: &[X],
    part_count: usize,
) {
    if chunks.is_empty() {
        return;
    }
    let first = partition.first_of(chunks.start);
    if part_count > 1 && chunks.len() > 1 {
        let middle = chunks.start + chunks.len() / 2;
        let (left, right) = y.split_at_mut((partition.first_of(middle) - first) * C);
        let (before, after) = (chunks.start..middle, middle..chunks.end);
        rayon::join(
            || add_ghost_contributions::<X, C>(partition, before, left, ghosts, part_count / 2),
            || add_ghost_contributions::<X, C>(partition, after, right, ghosts, part_count.div_ceil(2)),
        );
        return;
    }
    let owned = &partition.owned_ghosts;
    let all = owned.range(chunks.start).start..owned.range(chunks.end - 1).end;
    for &position in &owned.items()[all] {
        let node = partition.ghosts.items()[position as usize] as usize - first;
        let (sum, add) = (&mut y[node * C..][..C], &ghosts[position as usize * C..][..C]);
        (0..C).for_each(|c| sum[c] += add[c]);
    }
}
