//! The partition of particles among ranks by space: along a Morton curve through the cells of a grid, cut
//! into equal numbers. All ranks find it for themselves.

use gluey_geom::Vector;

use super::{PartParticle, RankShare};
use crate::grid::{Grid, sort_by_key};
use crate::neighbours::{Moves, SpatialOrder, for_each_image, wrap};
use crate::{ContactError, Domain, PairKey, PairState, Partner, StepGeometry};

/// Cells for every particle at most.
const CELLS_PER_PARTICLE: usize = 2;

/// Displacements that a search is to find the pairs of.
#[derive(Debug, Default)]
pub(crate) struct SearchedMoves<const D: usize> {
    /// By particle.
    pub displacements: Vec<Vector<D>>,
    /// Factor of what these have besides their affine part.
    pub widening: f64,
}

/// A rank among those that share a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RankOf {
    /// Its number, from zero.
    pub rank: usize,
    /// How many there are.
    pub size: usize,
}

/// The partition of particles, kept from step to step for its vectors.
#[derive(Debug, Default)]
pub(crate) struct Partitioner<const D: usize> {
    spatial: SpatialOrder,
    wrapped: Vec<Vector<D>>,
    windings: Vec<[i32; 3]>,
    /// Particles in the order of space, their ranks in it, and how far to search around each of it.
    order: Vec<u32>,
    places: Vec<u32>,
    reach: Vec<f64>,
    /// By place in the order of space.
    positions: Vec<Vector<D>>,
    moves: Vec<Vector<D>>,
    owners: Vec<u32>,
    cells: Cells,
}

/// Cells of the grid, and which ranks own particles in them.
#[derive(Debug, Default)]
struct Cells {
    /// Cell of each place.
    of_place: Vec<u32>,
    starts: Vec<u32>,
    /// Places by cell.
    members: Vec<u32>,
    /// First and last rank of each cell; none in cells without particles.
    ranks: Vec<[u32; 2]>,
    /// Whether the rank has particles in a cell or its neighbours.
    is_near: Vec<bool>,
}

/// Ranks of a cell without particles.
const NOBODY: [u32; 2] = [1, 0];

impl Cells {
    /// Whether a rank has particles in a cell.
    fn has(&self, cell: usize, rank: u32) -> bool {
        let [first, last] = self.ranks[cell];
        (first..=last).contains(&rank)
    }

    /// Finds the cells near those of a rank; `point` is that of a place.
    fn find_near<'a, const D: usize>(
        &mut self,
        grid: &Grid<D>,
        rank: u32,
        point: impl Fn(u32) -> &'a Vector<D>,
    ) {
        let mut is_near = std::mem::take(&mut self.is_near);
        is_near.clear();
        is_near.resize(grid.cell_count(), false);
        for cell in (0..grid.cell_count()).filter(|&cell| self.has(cell, rank)) {
            let first = self.members[self.starts[cell] as usize];
            grid.for_each_row(point(first), |row| is_near[row].fill(true));
        }
        self.is_near = is_near;
    }
}

impl<const D: usize> Partitioner<D> {
    /// What a rank gets of a step, and of what pairs remember.
    pub(crate) fn partition(
        &mut self,
        step: &StepGeometry<'_, D>,
        domain: &Domain<D>,
        moves: &SearchedMoves<D>,
        memory: &[PairState],
        RankOf { rank, size }: RankOf,
    ) -> Result<RankShare, ContactError> {
        self.order(step, domain, moves)?;
        let widest = self.reach.iter().copied().fold(0.0, f64::max);
        let grid = Grid::over(&self.wrapped, 2.0 * widest, CELLS_PER_PARTICLE * self.wrapped.len());
        self.own(&grid, size);
        let rank = rank as u32;
        let mut held = self.held(&grid, domain, 2.0 * widest, rank);
        let place = |particle: u32| self.places[particle as usize];
        let owner = |state: &&PairState| self.owners[place(state.pair.first) as usize];
        let own: Vec<&PairState> = memory.iter().filter(|state| owner(state) == rank).collect();
        let partner = |state: &&PairState| state.pair.particles().1.map(|second| place(second as u32));
        held.extend(own.iter().filter_map(partner));
        held.sort_unstable();
        held.dedup();
        let here = |particle: u32| held.binary_search(&place(particle)).unwrap_or(0);
        let renamed = |state: &PairState| {
            let first = here(state.pair.first);
            let pair = match state.pair.second {
                Partner::Wall(wall) => PairKey::wall(first, wall as usize),
                Partner::Particle { index, image } => PairKey::across(first, here(index), image),
            };
            PairState { pair, ..*state }
        };
        let memory = own.into_iter().map(renamed).collect();
        let particles = held.iter().map(|&place| self.particle(place)).collect();
        Ok(RankShare { rank, particles, memory })
    }

    /// Orders particles by space, and finds how far to search around each.
    fn order(
        &mut self,
        step: &StepGeometry<'_, D>,
        domain: &Domain<D>,
        searched: &SearchedMoves<D>,
    ) -> Result<(), ContactError> {
        wrap(step.positions, domain, &mut self.wrapped, &mut self.windings);
        self.spatial.sort(&self.wrapped, &mut self.order);
        self.places.resize(self.order.len(), 0);
        self.positions.clear();
        self.moves.clear();
        for (place, &particle) in self.order.iter().enumerate() {
            self.places[particle as usize] = place as u32;
            self.positions.push(step.positions[particle as usize]);
            self.moves.push(searched.displacements[particle as usize]);
        }
        let moves = Moves {
            order: &self.order,
            positions: &self.positions,
            displacements: &self.moves,
            margin: 0.0,
            widening: searched.widening,
        };
        moves.reach(step.radii, domain, &mut self.reach)
    }

    /// Gives particles to ranks: equal numbers along the Morton curve through the cells.
    fn own(&mut self, grid: &Grid<D>, rank_count: usize) {
        let Self { order, wrapped, owners, cells, .. } = self;
        let count = order.len();
        cells.of_place.clear();
        cells.of_place.extend(order.iter().map(|&particle| grid.cell(&wrapped[particle as usize]) as u32));
        let of_place = &cells.of_place;
        let cell = |place: usize| of_place[place] as usize;
        sort_by_key(count, grid.cell_count(), cell, &mut cells.starts, &mut cells.members);
        let is_filled = |cell: &usize| cells.starts[*cell] < cells.starts[*cell + 1];
        let mut curve: Vec<(u128, usize)> = (0..grid.cell_count())
            .filter(is_filled)
            .map(|cell| (morton(grid.coordinates(cell)), cell))
            .collect();
        curve.sort_unstable();
        cells.ranks.clear();
        cells.ranks.resize(grid.cell_count(), NOBODY);
        owners.resize(count, 0);
        let mut before = 0;
        for (_, cell) in curve {
            let members = cells.starts[cell] as usize..cells.starts[cell + 1] as usize;
            let owner = |k: usize| (k * rank_count / count) as u32;
            for (k, &place) in cells.members[members.clone()].iter().enumerate() {
                owners[place as usize] = owner(before + k);
            }
            cells.ranks[cell] = [owner(before), owner(before + members.len() - 1)];
            before += members.len();
        }
    }

    /// Places of a rank's own particles and of those that come near them, themselves or by an image.
    /// Particles farther apart than `reach` never meet.
    fn held(&mut self, grid: &Grid<D>, domain: &Domain<D>, reach: f64, rank: u32) -> Vec<u32> {
        let Self { order, wrapped, cells, .. } = self;
        cells.find_near(grid, rank, |place| &wrapped[order[place as usize] as usize]);
        let is_periodic = domain.lattice.periods().map(|period| period.is_some());
        let comes_near = |&place: &u32| {
            let cell = cells.of_place[place as usize] as usize;
            if cells.is_near[cell] || !grid.is_at_side(cell, &is_periodic) {
                return cells.is_near[cell];
            }
            let (x, mut found) = (&wrapped[order[place as usize] as usize], false);
            for_each_image(x, &domain.lattice, reach, |image| {
                grid.for_each_row(&(x + domain.shift(&image)), |mut row| {
                    found |= row.any(|cell| cells.has(cell, rank));
                });
            });
            found
        };
        (0..order.len() as u32).filter(comes_near).collect()
    }

    fn particle(&self, place: u32) -> PartParticle {
        PartParticle {
            index: self.order[place as usize],
            order: place,
            owner: self.owners[place as usize],
            reach: self.reach[place as usize],
        }
    }
}

/// Place on the Morton curve: the bits of the coordinates in turn, those of the last axis first.
fn morton<const D: usize>(coordinates: [usize; D]) -> u128 {
    let highest = usize::BITS - coordinates.iter().fold(0, |all, x| all | x).leading_zeros();
    (0..highest)
        .rev()
        .fold(0, |key, bit| coordinates.iter().rev().fold(key, |key, x| key << 1 | (x >> bit & 1) as u128))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_goes_from_quarter_to_quarter() {
        let along: Vec<u128> = (0..16).map(|k| morton([k % 4, k / 4])).collect();
        assert_eq!(along, [0, 1, 4, 5, 2, 3, 6, 7, 8, 9, 12, 13, 10, 11, 14, 15]);
        assert_eq!(morton([1, 0, 1]), 0b101);
    }
}
