//! Interpolation from a level to the next finer one, on the owned nodes of the finer one.
//!
//! A fine node lies on the grid of `5^D` points of the coarse cell that covers the cell of the rank that
//! touches it first. That is the first to touch it of all, so ranks agree with the serial solver. Nodes are
//! numbered as cells touch them: those of a coarse cell follow each other. The grid of a cell is interpolated
//! along one axis after another.

use std::ops::Range;

use gluey_fem::element::{multi_index, node_count};

use crate::space::LevelSpace;

/// Points of the grid a direction.
const POINTS: usize = 5;
/// Points of the grid in 3D.
const MOST_POINTS: usize = POINTS.pow(3);
/// Stands for nodes without an unknown.
const NOWHERE: u8 = MOST_POINTS as u8;

/// Interpolation between the nodes of two levels, and its transpose.
pub struct Transfer {
    /// Coarse cells and the owned fine nodes that take their values from them, in their order.
    cells: Vec<(u32, Range<u32>)>,
    /// Place of each owned fine node in the grid of its cell.
    places: Vec<u8>,
}

impl Transfer {
    pub fn new<const D: usize>(coarse: &LevelSpace<D>, fine: &LevelSpace<D>) -> Self {
        let owned = &fine.velocity.owned;
        let fine_mesh = &fine.part.mesh;
        let (mut cells, mut places) = (Vec::<(u32, Range<u32>)>::new(), Vec::with_capacity(owned.len()));
        for cell in fine.part.own() {
            let own = &fine_mesh.cells()[cell];
            let covering = coarse.part.mesh.find_covering(own);
            let covering = covering.expect("the coarse part covers the cells of the rank");
            let is_refined = coarse.part.mesh.cells()[covering] != *own;
            let first = places.len() as u32;
            for (i, &node) in fine.velocity.map.cell(cell).iter().enumerate() {
                // Those before were touched by other cells.
                if owned.start + places.len() != node as usize || !owned.contains(&(node as usize)) {
                    continue;
                }
                let index = multi_index::<D>(i, 3);
                let along = |d: usize| match is_refined {
                    true => index[d] + 2 * (own.coords[d] & 1) as usize,
                    false => 2 * index[d],
                };
                let place = (0..D).rev().fold(0, |place, d| place * POINTS + along(d));
                places.push(if fine.velocity.is_loose(node as usize) { place as u8 } else { NOWHERE });
            }
            let last = places.len() as u32;
            match cells.last_mut() {
                Some((before, nodes)) if *before == covering as u32 => nodes.end = last,
                _ => cells.push((covering as u32, first..last)),
            }
        }
        assert_eq!(places.len(), owned.len(), "nodes are numbered as cells touch them");
        Self { cells, places }
    }

    /// `fine = P coarse` on the owned nodes, of a field that is right at all nodes of the coarse part.
    pub fn prolong<const D: usize>(&self, coarse: &LevelSpace<D>, field: &[f32], fine: &mut [f32]) {
        let mut grid = [[0.0; D]; MOST_POINTS];
        let fine = fine.as_chunks_mut::<D>().0;
        for (cell, nodes) in &self.cells {
            let of_cell = coarse.velocity.map.cell(*cell as usize);
            for (value, &node) in grid.iter_mut().zip(of_cell) {
                value.copy_from_slice(&field[node as usize * D..][..D]);
            }
            interpolate(&mut grid);
            let nodes = nodes.start as usize..nodes.end as usize;
            for (value, &place) in fine[nodes.clone()].iter_mut().zip(&self.places[nodes]) {
                *value = if place == NOWHERE { [0.0; D] } else { grid[usize::from(place)] };
            }
        }
    }

    /// `field = P^T fine` at all nodes of the coarse part.
    pub fn restrict<const D: usize>(&self, coarse: &LevelSpace<D>, fine: &[f32], field: &mut [f32]) {
        field.fill(0.0);
        let fine = fine.as_chunks::<D>().0;
        for (cell, nodes) in &self.cells {
            let mut grid = [[0.0; D]; MOST_POINTS];
            let nodes = nodes.start as usize..nodes.end as usize;
            for (value, &place) in fine[nodes.clone()].iter().zip(&self.places[nodes]) {
                if place != NOWHERE {
                    grid[usize::from(place)] = *value;
                }
            }
            collect(&mut grid);
            let of_cell = coarse.velocity.map.cell(*cell as usize);
            for (value, &node) in grid.iter().zip(of_cell) {
                let to = &mut field[node as usize * D..][..D];
                (0..D).for_each(|c| to[c] += value[c]);
            }
        }
    }
}

/// A row of the interpolation of second order from three nodes to five points.
const WEIGHTS: [[f32; 3]; POINTS] =
    [[1.0, 0.0, 0.0], [0.375, 0.75, -0.125], [0.0, 1.0, 0.0], [-0.125, 0.75, 0.375], [0.0, 0.0, 1.0]];

/// From the values at the `3^D` nodes of a cell, which come first, to those at its grid.
fn interpolate<const D: usize>(grid: &mut [[f32; D]; MOST_POINTS]) {
    for axis in 0..D {
        let (inner, outer) = (POINTS.pow(axis as u32), node_count::<D>(2) / 3usize.pow(axis as u32 + 1));
        // From the last on: what is written lies behind all that is still read.
        for line in (0..outer).rev() {
            for at in (0..inner).rev() {
                let nodes: [[f32; D]; 3] = std::array::from_fn(|j| grid[(line * 3 + j) * inner + at]);
                for (i, weights) in WEIGHTS.iter().enumerate() {
                    let value = |c: usize| (0..3).map(|j| weights[j] * nodes[j][c]).sum();
                    grid[(line * POINTS + i) * inner + at] = std::array::from_fn(value);
                }
            }
        }
    }
}

/// The transpose of [`interpolate`].
fn collect<const D: usize>(grid: &mut [[f32; D]; MOST_POINTS]) {
    for axis in (0..D).rev() {
        let (inner, outer) = (POINTS.pow(axis as u32), node_count::<D>(2) / 3usize.pow(axis as u32 + 1));
        for line in 0..outer {
            for at in 0..inner {
                let points: [[f32; D]; POINTS] =
                    std::array::from_fn(|i| grid[(line * POINTS + i) * inner + at]);
                for j in 0..3 {
                    let value = |c: usize| (0..POINTS).map(|i| WEIGHTS[i][j] * points[i][c]).sum();
                    grid[(line * 3 + j) * inner + at] = std::array::from_fn(value);
                }
            }
        }
    }
}
