//! Interpolation from a level to the next finer one, on the owned nodes of the finer one.
//!
//! A fine node lies on the grid of `5^D` points of the coarse cell that covers the cell of the rank that
//! touches it first. That is the first to touch it of all, so ranks agree with the serial solver.

use gluey_fem::element::{multi_index, node_count, values_1d};
use gluey_linalg::Jagged;

use crate::space::LevelSpace;

/// Points of the grid a direction.
const POINTS: usize = 5;

/// Interpolation between the nodes of two levels, and its transpose.
pub struct Transfer<const D: usize> {
    /// Coarse cell of each owned fine node, and place in its grid.
    places: Vec<(u32, u8)>,
    /// Nodes of a cell that count at each point of its grid, and their weights; none at the last, which
    /// stands for nodes without an unknown.
    weights: Jagged<(u8, f32)>,
}

impl<const D: usize> Transfer<D> {
    pub fn new(coarse: &LevelSpace<D>, fine: &LevelSpace<D>) -> Self {
        let owned = &fine.velocity.owned;
        let nowhere = POINTS.pow(D as u32) as u8;
        let mut places = vec![(0, nowhere); owned.len()];
        let mut is_placed = vec![false; owned.len()];
        let fine_mesh = &fine.part.mesh;
        for cell in fine.part.own() {
            let own = &fine_mesh.cells()[cell];
            let covering = coarse.part.mesh.find_covering(own);
            let covering = covering.expect("the coarse part covers the cells of the rank");
            let is_refined = coarse.part.mesh.cells()[covering] != *own;
            for (i, &node) in fine.velocity.map.cell(cell).iter().enumerate() {
                let Some(k) = (node as usize).checked_sub(owned.start).filter(|&k| k < owned.len()) else {
                    continue;
                };
                if is_placed[k] {
                    continue;
                }
                is_placed[k] = true;
                if fine.velocity.is_loose(node as usize) {
                    let index = multi_index::<D>(i, 3);
                    let along = |d: usize| match is_refined {
                        true => index[d] + 2 * (own.coords[d] & 1) as usize,
                        false => 2 * index[d],
                    };
                    let place = (0..D).rev().fold(0, |place, d| place * POINTS + along(d));
                    places[k] = (covering as u32, place as u8);
                }
            }
        }
        let points = (0..POINTS.pow(D as u32)).map(weights_at::<D>);
        Self { places, weights: points.chain([Vec::new()]).collect() }
    }

    /// `fine = P coarse` on the owned nodes, of a field that is right at all nodes of the coarse part.
    pub fn prolong(&self, coarse: &LevelSpace<D>, field: &[f32], fine: &mut [f32]) {
        for (&(cell, place), value) in self.places.iter().zip(fine.as_chunks_mut::<D>().0) {
            *value = [0.0; D];
            let nodes = coarse.velocity.map.cell(cell as usize);
            for &(local, weight) in &self.weights[usize::from(place)] {
                let from = &field[nodes[usize::from(local)] as usize * D..][..D];
                (0..D).for_each(|c| value[c] += weight * from[c]);
            }
        }
    }

    /// `field = P^T fine` at all nodes of the coarse part.
    pub fn restrict(&self, coarse: &LevelSpace<D>, fine: &[f32], field: &mut [f32]) {
        field.fill(0.0);
        for (&(cell, place), value) in self.places.iter().zip(fine.as_chunks::<D>().0) {
            let nodes = coarse.velocity.map.cell(cell as usize);
            for &(local, weight) in &self.weights[usize::from(place)] {
                let to = &mut field[nodes[usize::from(local)] as usize * D..][..D];
                (0..D).for_each(|c| to[c] += weight * value[c]);
            }
        }
    }
}

/// The nodes that count at a point of the grid, and their weights.
fn weights_at<const D: usize>(place: usize) -> Vec<(u8, f32)> {
    let point = multi_index::<D>(place, POINTS);
    let along = point.map(|i| values_1d(2, i as f64 / (POINTS - 1) as f64));
    let weight = |i: usize| {
        let index = multi_index::<D>(i, 3);
        (i as u8, (0..D).map(|d| along[d][index[d]]).product::<f64>() as f32)
    };
    (0..node_count::<D>(2)).map(weight).filter(|(_, weight)| *weight != 0.0).collect()
}
