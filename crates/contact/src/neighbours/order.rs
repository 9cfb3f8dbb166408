//! An order of space: particles by cells of a grid, within a cell by their coordinates.

use gluey_geom::Vector;

use crate::grid::{Grid, sort_by_key};

/// Sorts points so that neighbours in space are near each other in memory, whatever order they come in.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpatialOrder {
    cells: Vec<u32>,
    starts: Vec<u32>,
}

impl SpatialOrder {
    /// Replaces `order` by the points' indices in the order of space. Points that coincide keep their order.
    pub(crate) fn sort<const D: usize>(&mut self, points: &[Vector<D>], order: &mut Vec<u32>) {
        let grid = Grid::fine(points);
        self.cells.clear();
        self.cells.extend(points.iter().map(|x| grid.cell(x) as u32));
        let cells = &self.cells;
        sort_by_key(points.len(), grid.cell_count(), |i| cells[i] as usize, &mut self.starts, order);
        for range in self.starts.windows(2) {
            order[range[0] as usize..range[1] as usize].sort_unstable_by(|&i, &j| {
                let (x, y) = (&points[i as usize], &points[j as usize]);
                (0..D).map(|d| x[d].total_cmp(&y[d])).find(|order| order.is_ne()).unwrap_or(i.cmp(&j))
            });
        }
    }
}
