//! Interpolation from a level to the next finer one, on the owned nodes of the finer one.
//!
//! A fine node lies on the grid of `5^D` points of the coarse cell that covers the cell of the rank that
//! touches it first. That is the first to touch it of all, so ranks agree with the serial solver.

use gluey_fem::element::{multi_index, node_count, values_1d};

use crate::space::LevelSpace;

/// Points of the grid a direction.
const POINTS: usize = 5;
/// Place of a node without an unknown.
const NOWHERE: u8 = u8::MAX;
/// Most nodes of a cell.
const MOST_NODES: usize = 27;

/// Interpolation between the nodes of two levels, and its transpose.
pub struct Transfer<const D: usize> {
    /// Coarse cell of each owned fine node, and place in its grid.
    places: Vec<(u32, u8)>,
    /// Weights of the nodes of a cell at each point of its grid.
    weights: Vec<[f32; MOST_NODES]>,
}

impl<const D: usize> Transfer<D> {
    pub fn new(coarse: &LevelSpace<D>, fine: &LevelSpace<D>) -> Self {
        let owned = &fine.velocity.owned;
        let mut places = vec![(0, NOWHERE); owned.len()];
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
        Self { places, weights: (0..POINTS.pow(D as u32)).map(weights_at::<D>).collect() }
    }

    /// `fine = P coarse` on the owned nodes, of a field that is right at all nodes of the coarse part.
    pub fn prolong(&self, coarse: &LevelSpace<D>, field: &[f32], fine: &mut [f32]) {
        for (&(cell, place), value) in self.places.iter().zip(fine.as_chunks_mut::<D>().0) {
            *value = [0.0; D];
            let Some(weights) = self.weights.get(usize::from(place)) else { continue };
            for (&node, &weight) in coarse.velocity.map.cell(cell as usize).iter().zip(weights) {
                (0..D).for_each(|c| value[c] += weight * field[node as usize * D + c]);
            }
        }
    }

    /// `field = P^T fine` at all nodes of the coarse part.
    pub fn restrict(&self, coarse: &LevelSpace<D>, fine: &[f32], field: &mut [f32]) {
        field.fill(0.0);
        for (&(cell, place), value) in self.places.iter().zip(fine.as_chunks::<D>().0) {
            let Some(weights) = self.weights.get(usize::from(place)) else { continue };
            for (&node, &weight) in coarse.velocity.map.cell(cell as usize).iter().zip(weights) {
                (0..D).for_each(|c| field[node as usize * D + c] += weight * value[c]);
            }
        }
    }
}

/// Weights of the nodes at a point of the grid.
fn weights_at<const D: usize>(place: usize) -> [f32; MOST_NODES] {
    let point = multi_index::<D>(place, POINTS);
    let along = point.map(|i| values_1d(2, i as f64 / (POINTS - 1) as f64));
    let mut weights = [0.0; MOST_NODES];
    for (i, weight) in weights.iter_mut().enumerate().take(node_count::<D>(2)) {
        let index = multi_index::<D>(i, 3);
        *weight = (0..D).map(|d| along[d][index[d]]).product::<f64>() as f32;
    }
    weights
}
