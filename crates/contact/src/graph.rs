//! Which pairs take part in a step, in an order that does not depend on the numbering of the particles.

use gluey_geom::Vector;
use serde::{Deserialize, Serialize};

use crate::broadphase;

/// Two particles, `first < second`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PairKey {
    /// The smaller index.
    pub first: u32,
    /// The larger index.
    pub second: u32,
}

impl PairKey {
    /// The pair of two particles, given in any order.
    pub fn new(i: usize, j: usize) -> Self {
        Self { first: i.min(j) as u32, second: i.max(j) as u32 }
    }

    /// The indices.
    pub fn indices(self) -> (usize, usize) {
        (self.first as usize, self.second as usize)
    }
}

/// Pairs nearer than this part of their summed radii take part whatever they do: a cheap way to seldom search twice.
const SKIN: f64 = 0.01;

/// Finds the pairs whose gap could close when particles move by given displacements.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    /// Distances up to which the pairs are complete, one a particle.
    reach: Vec<f64>,
    half_widths: Vec<f64>,
    pairs: Vec<PairKey>,
}

impl Search {
    /// Begins a step: nothing is known.
    pub(crate) fn begin(&mut self) {
        self.reach.clear();
    }

    /// All pairs whose boxes meet when each particle moves by up to `displacements` plus the margin
    /// `margin * radius`; a superset of the pairs that can touch.
    pub(crate) fn candidates<const D: usize>(
        &mut self,
        positions: &[Vector<D>],
        radii: &[f64],
        displacements: &[Vector<D>],
        margin: f64,
    ) -> &[PairKey] {
        let moves = displacements.iter().zip(radii).map(|(s, radius)| s.norm() + margin * radius);
        let known = self.reach.len() == positions.len()
            && moves.clone().zip(&self.reach).all(|(needed, reach)| needed <= *reach);
        if !known {
            self.reach.clear();
            self.reach.extend(moves.zip(radii).map(|(needed, radius)| needed + SKIN * radius));
            self.half_widths.clear();
            self.half_widths.extend(self.reach.iter().zip(radii).map(|(reach, radius)| reach + radius));
            broadphase::overlapping(positions, &self.half_widths, &mut self.pairs);
        }
        &self.pairs
    }
}

/// Whether a pair with the gap `gap` and summed radii `rest` could close under the relative displacement `relative`.
pub(crate) fn could_close<const D: usize>(gap: f64, relative: &Vector<D>, rest: f64, margin: f64) -> bool {
    gap <= relative.norm() + (margin + SKIN) * rest
}

/// Rank of each particle in the lexicographic order of positions: an order of space, not of input.
pub(crate) fn ranks<const D: usize>(positions: &[Vector<D>]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    let compare = |i: &u32, j: &u32| {
        let (x, y) = (&positions[*i as usize], &positions[*j as usize]);
        (0..D).map(|d| x[d].total_cmp(&y[d])).find(|order| order.is_ne()).unwrap_or(i.cmp(j))
    };
    order.sort_unstable_by(compare);
    let mut ranks = vec![0; positions.len()];
    for (rank, particle) in order.into_iter().enumerate() {
        ranks[particle as usize] = rank as u32;
    }
    ranks
}
