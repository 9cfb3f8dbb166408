//! The partition of particles among ranks by space: along a Morton curve through the cells of a grid, cut
//! into equal numbers.

use gluey_geom::Vector;

use super::{PartMemory, PartParticle, RankShare};
use crate::grid::{Grid, sort_by_key};
use crate::neighbours::{Moves, SpatialOrder, for_each_image, wrap};
use crate::{ContactError, Domain, PairKey, PairState, Partner, StepGeometry};

/// Cells for every particle at most.
const CELLS_PER_PARTICLE: usize = 2;

/// What particles do in a step.
pub(crate) struct Motion<'a, const D: usize> {
    /// Displacements without contact, by particle.
    pub free: &'a [Vector<D>],
    /// Displacements to search for, by particle.
    pub needed: &'a [Vector<D>],
    /// Factor of what these have besides their affine part.
    pub widening: f64,
    /// Velocity that a unit force gives each particle.
    pub mobilities: &'a [f64],
    /// What pairs remember.
    pub memory: &'a [PairState],
}

/// Deals particles to ranks.
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
    /// Ranks of each cell with particles and its neighbours: where they begin, and all.
    near_starts: Vec<u32>,
    near: Vec<u32>,
}

/// Ranks of a cell without particles.
const NOBODY: [u32; 2] = [1, 0];

impl Cells {
    /// Adds the ranks of the cells around a point.
    fn add_ranks<const D: usize>(&self, grid: &Grid<D>, x: &Vector<D>, ranks: &mut Vec<u32>) {
        grid.for_each_row(x, |row| {
            for &[first, last] in &self.ranks[row] {
                // Neighbours mostly are of one rank.
                let is_known = ranks.last() == Some(&last) && first == last;
                if !is_known {
                    ranks.extend(first..=last);
                }
            }
        });
    }

    /// Finds the ranks of each cell and its neighbours; `point` is that of a place.
    fn find_near<'a, const D: usize>(&mut self, grid: &Grid<D>, point: impl Fn(u32) -> &'a Vector<D>) {
        // Around most cells all is of one rank.
        let mut range = self.ranks.clone();
        grid.join_neighbours(&mut range, |[a, b], [c, d]| match (b < a, d < c) {
            (true, _) => [c, d],
            (_, true) => [a, b],
            _ => [a.min(c), b.max(d)],
        });
        let mut ranks = Vec::new();
        self.near.clear();
        self.near_starts.clear();
        self.near_starts.push(0);
        for cell in 0..grid.cell_count() {
            ranks.clear();
            let [first, end] = [self.starts[cell], self.starts[cell + 1]];
            if first < end && range[cell][0] == range[cell][1] {
                ranks.push(range[cell][0]);
            } else if first < end {
                self.add_ranks(grid, point(self.members[first as usize]), &mut ranks);
            }
            ranks.sort_unstable();
            ranks.dedup();
            self.near.extend_from_slice(&ranks);
            self.near_starts.push(self.near.len() as u32);
        }
    }

    /// The ranks of a cell and its neighbours, sorted.
    fn near(&self, cell: usize) -> &[u32] {
        &self.near[self.near_starts[cell] as usize..self.near_starts[cell + 1] as usize]
    }
}

impl<const D: usize> Partitioner<D> {
    /// What each of so many ranks gets.
    pub(crate) fn partition(
        &mut self,
        step: &StepGeometry<'_, D>,
        domain: &Domain<D>,
        motion: &Motion<'_, D>,
        rank_count: usize,
    ) -> Result<Vec<RankShare<D>>, ContactError> {
        self.order(step, domain, motion)?;
        let widest = self.reach.iter().copied().fold(0.0, f64::max);
        let grid = Grid::over(&self.wrapped, 2.0 * widest, CELLS_PER_PARTICLE * self.wrapped.len());
        self.own(&grid, rank_count);
        let mut holders: Vec<Vec<u32>> = vec![Vec::new(); rank_count];
        self.hold(&grid, domain, 2.0 * widest, &mut holders);
        let ranks = 0..rank_count as u32;
        let mut shares: Vec<RankShare<D>> =
            ranks.map(|rank| RankShare { rank, ..RankShare::default() }).collect();
        let mut partners: Vec<Vec<u32>> = vec![Vec::new(); rank_count];
        for state in motion.memory {
            let (owner, memory, second) = self.remembered(state);
            shares[owner].memory.push(memory);
            partners[owner].extend(second.filter(|place| holders[owner].binary_search(place).is_err()));
        }
        for ((places, shares), partners) in holders.iter_mut().zip(&mut shares).zip(&partners) {
            if !partners.is_empty() {
                places.extend(partners);
                places.sort_unstable();
                places.dedup();
            }
            shares.particles.extend(places.iter().map(|&place| self.particle(place, step, motion)));
        }
        Ok(shares)
    }

    /// Orders particles by space, and finds how far to search around each.
    fn order(
        &mut self,
        step: &StepGeometry<'_, D>,
        domain: &Domain<D>,
        motion: &Motion<'_, D>,
    ) -> Result<(), ContactError> {
        wrap(step.positions, domain, &mut self.wrapped, &mut self.windings);
        self.spatial.sort(&self.wrapped, &mut self.order);
        self.places.resize(self.order.len(), 0);
        self.positions.clear();
        self.moves.clear();
        for (place, &particle) in self.order.iter().enumerate() {
            self.places[particle as usize] = place as u32;
            self.positions.push(step.positions[particle as usize]);
            self.moves.push(motion.needed[particle as usize]);
        }
        let moves = Moves {
            order: &self.order,
            positions: &self.positions,
            displacements: &self.moves,
            margin: 0.0,
            widening: motion.widening,
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

    /// Lists for each rank the places of its own particles and of those that come near them, themselves or by
    /// an image. Particles farther apart than `reach` never meet.
    fn hold(&mut self, grid: &Grid<D>, domain: &Domain<D>, reach: f64, holders: &mut [Vec<u32>]) {
        let Self { order, wrapped, cells, .. } = self;
        cells.find_near(grid, |place| &wrapped[order[place as usize] as usize]);
        let mut beyond = Vec::new();
        let is_periodic = domain.lattice.periods().map(|period| period.is_some());
        for (place, &particle) in order.iter().enumerate() {
            let cell = cells.of_place[place] as usize;
            let near = cells.near(cell);
            near.iter().for_each(|&rank| holders[rank as usize].push(place as u32));
            if grid.is_at_side(cell, &is_periodic) {
                let x = wrapped[particle as usize];
                beyond.clear();
                for_each_image(&x, &domain.lattice, reach, |image| {
                    cells.add_ranks(grid, &(x + domain.shift(&image)), &mut beyond);
                });
                beyond.sort_unstable();
                beyond.dedup();
                let others = beyond.iter().filter(|rank| near.binary_search(rank).is_err());
                others.for_each(|&rank| holders[rank as usize].push(place as u32));
            }
        }
    }

    /// Who takes what a pair remembers, and the place of its second particle.
    fn remembered(&self, state: &PairState) -> (usize, PartMemory, Option<u32>) {
        let first = self.places[state.pair.first as usize];
        let (second, place) = match state.pair.second {
            Partner::Wall(wall) => (Partner::Wall(wall), None),
            Partner::Particle { index, image } => {
                let place = self.places[index as usize];
                (Partner::Particle { index: place, image }, Some(place))
            }
        };
        let pair = PairKey { first, second };
        let memory = PartMemory { pair, gamma: state.gamma, lambda: state.lambda };
        (self.owners[first as usize] as usize, memory, place)
    }

    fn particle(&self, place: u32, step: &StepGeometry<'_, D>, motion: &Motion<'_, D>) -> PartParticle<D> {
        let particle = self.order[place as usize] as usize;
        PartParticle {
            index: particle as u32,
            order: place,
            owner: self.owners[place as usize],
            position: step.positions[particle],
            free: motion.free[particle],
            radius: step.radii[particle],
            mobility: motion.mobilities[particle],
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
