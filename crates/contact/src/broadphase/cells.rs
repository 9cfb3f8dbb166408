//! The cell list: balls binned by cells as wide as two of the largest radii, so that those that meet are
//! neighbours.

use gluey_geom::Vector;

use super::search::{Broadphase, meet};
use crate::grid::{Grid, sort_by_key};

/// Cells for every ball at most, so that a sparse cloud needs no more memory than a dense one.
const CELLS_PER_BALL: usize = 2;

/// Balls in the cell of a ball, on average, that make the cells crowded: similar sizes have fewer.
const CROWD: f64 = 256.0;

/// Bins of balls, numbered row by row along the first axis.
///
/// The cells of a row are neighbours in memory: three cells of it are one range of balls.
#[derive(Clone, Debug, Default)]
pub struct CellList {
    /// First ball of each cell, in `members`.
    starts: Vec<u32>,
    /// Balls by cell, in each by index.
    members: Vec<u32>,
    /// Cell of each ball.
    cells: Vec<u32>,
    /// Centre and radius of each member.
    balls: Vec<[f64; 4]>,
    /// Pairs as they are found.
    found: Vec<(u32, u32)>,
}

impl CellList {
    fn bin<const D: usize>(&mut self, grid: &Grid<D>, centers: &[Vector<D>], radii: &[f64]) {
        self.cells.clear();
        self.cells.extend(centers.iter().map(|x| grid.cell(x) as u32));
        let cells = &self.cells;
        let count = centers.len();
        sort_by_key(count, grid.cell_count(), |i| cells[i] as usize, &mut self.starts, &mut self.members);
        self.balls.clear();
        self.balls.extend(self.members.iter().map(|&i| {
            let (x, radius) = (&centers[i as usize], radii[i as usize]);
            std::array::from_fn(|d| if d < D { x[d] } else { radius })
        }));
    }

    /// Bins the balls; whether so many share cells that a search from ball to ball would be slow, as where
    /// one is far from all others.
    pub(super) fn is_crowded<const D: usize>(&mut self, centers: &[Vector<D>], radii: &[f64]) -> bool {
        self.bin(&grid(centers, radii), centers, radii);
        let crowd = |cell: &[u32]| f64::from(cell[1] - cell[0]).powi(2);
        self.starts.windows(2).map(crowd).sum::<f64>() > CROWD * centers.len() as f64
    }

    /// Finds the pairs, in the order of the members. Each member looks for those behind it.
    fn find<const D: usize>(&mut self, grid: &Grid<D>, asker_count: usize) {
        let Self { starts, members, balls, found, .. } = self;
        found.clear();
        for (place, (&i, ball)) in members.iter().zip(balls.iter()).enumerate() {
            let x = Vector::<D>::from_fn(|d, _| ball[d]);
            grid.for_each_row(&x, |row| {
                let end = starts[row.end] as usize;
                let range = (starts[row.start] as usize).max(place + 1).min(end)..end;
                for (&j, other) in members[range.clone()].iter().zip(&balls[range]) {
                    let y = Vector::<D>::from_fn(|d, _| other[d]);
                    // Both are computed: a branch on the first could not be predicted.
                    if meet(&x, &y, ball[D] + other[D]) & ((i.min(j) as usize) < asker_count) {
                        found.push((i.min(j), i.max(j)));
                    }
                }
            });
        }
    }
}

/// Cells in which balls that meet are neighbours.
fn grid<const D: usize>(centers: &[Vector<D>], radii: &[f64]) -> Grid<D> {
    let largest = radii.iter().copied().fold(0.0, f64::max);
    Grid::over(centers, 2.0 * largest, CELLS_PER_BALL * centers.len())
}

impl<const D: usize> Broadphase<D> for CellList {
    fn meeting(
        &mut self,
        centers: &[Vector<D>],
        radii: &[f64],
        asker_count: usize,
        pairs: &mut Vec<(u32, u32)>,
    ) {
        pairs.clear();
        if centers.len() < 2 {
            return;
        }
        let grid = grid(centers, radii);
        self.bin(&grid, centers, radii);
        self.find(&grid, asker_count);
        let Self { found, starts, members: order, .. } = self;
        sort_by_key(found.len(), asker_count, |k| found[k].0 as usize, starts, order);
        pairs.extend(order.iter().map(|&k| found[k as usize]));
        for range in starts.windows(2) {
            pairs[range[0] as usize..range[1] as usize].sort_unstable();
        }
    }
}
