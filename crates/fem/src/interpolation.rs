//! Interpolation from the space of a coarse mesh to that of a finer one whose cells refine it.

use crate::element::{split, values_1d};
use crate::nodes::NodeMap;
use crate::tree::{Cell, TreeMesh};

/// Sparse interpolation of nodal values, by rows: fine node = weighted sum of coarse nodes.
///
/// Rows of hanging fine nodes are empty: their values follow from their masters.
#[derive(Clone, Debug)]
pub struct Interpolation {
    starts: Vec<u32>,
    columns: Vec<u32>,
    weights: Vec<f32>,
}

impl Interpolation {
    /// Interpolation between the spaces `coarse_nodes` on `coarse` and `fine_nodes` on `fine`.
    ///
    /// # Panics
    /// If `coarse` is not `fine`, [`TreeMesh::coarsened`] by one level.
    pub fn new<const D: usize>(
        coarse: &TreeMesh<D>,
        coarse_nodes: &NodeMap<D>,
        fine: &TreeMesh<D>,
        fine_nodes: &NodeMap<D>,
    ) -> Self {
        let source = source_cells(coarse, fine, fine_nodes);
        let mut new = Self { starts: vec![0], columns: Vec::new(), weights: Vec::new() };
        for (node, source) in source.iter().enumerate() {
            if !fine_nodes.is_hanging(node) {
                new.push_row(coarse_nodes, source);
            }
            new.starts.push(new.columns.len() as u32);
        }
        new
    }

    /// Number of fine nodes.
    pub fn fine_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// `fine = P coarse` for fields with `components` interleaved components.
    pub fn prolong(&self, components: usize, coarse: &[f32], fine: &mut [f32]) {
        for (node, target) in fine.chunks_exact_mut(components).take(self.fine_count()).enumerate() {
            target.fill(0.0);
            for k in self.starts[node] as usize..self.starts[node + 1] as usize {
                let source = &coarse[self.columns[k] as usize * components..][..components];
                for c in 0..components {
                    target[c] += self.weights[k] * source[c];
                }
            }
        }
    }

    /// `coarse += P^T fine`.
    pub fn restrict(&self, components: usize, fine: &[f32], coarse: &mut [f32]) {
        for (node, source) in fine.chunks_exact(components).take(self.fine_count()).enumerate() {
            for k in self.starts[node] as usize..self.starts[node + 1] as usize {
                let target = &mut coarse[self.columns[k] as usize * components..][..components];
                for c in 0..components {
                    target[c] += self.weights[k] * source[c];
                }
            }
        }
    }

    fn push_row<const D: usize>(&mut self, coarse_nodes: &NodeMap<D>, source: &Source<D>) {
        let degree = coarse_nodes.degree();
        let values: [[f64; 3]; D] =
            std::array::from_fn(|d| values_1d(degree, f64::from(source.quarter[d]) / (2 * degree) as f64));
        for (i, &column) in coarse_nodes.cell(source.cell as usize).iter().enumerate() {
            let index = split::<D>(i, degree + 1);
            let weight: f64 = (0..D).map(|d| values[d][index[d]]).product();
            if weight != 0.0 {
                self.columns.push(column);
                self.weights.push(weight as f32);
            }
        }
    }
}

/// Where a fine node lies: in a coarse cell, at `quarter / (2 degree)` of its width.
#[derive(Clone, Copy)]
struct Source<const D: usize> {
    cell: u32,
    quarter: [u8; D],
}

fn source_cells<const D: usize>(
    coarse: &TreeMesh<D>,
    fine: &TreeMesh<D>,
    fine_nodes: &NodeMap<D>,
) -> Vec<Source<D>> {
    let mut source = vec![Source { cell: u32::MAX, quarter: [0; D] }; fine_nodes.node_count()];
    let n = fine_nodes.degree() + 1;
    for (c, cell) in fine.cells().iter().enumerate() {
        let (found, child) = match coarse.find(cell) {
            Some(found) => (found, None),
            None => (parent_in(coarse, cell), Some(cell.coords.map(|x| x & 1))),
        };
        for (i, &node) in fine_nodes.cell(c).iter().enumerate() {
            let index = split::<D>(i, n);
            source[node as usize] = Source {
                cell: found as u32,
                quarter: std::array::from_fn(|d| match child {
                    None => 2 * index[d] as u8,
                    Some(half) => (index[d] + half[d] as usize * (n - 1)) as u8,
                }),
            };
        }
    }
    source
}

fn parent_in<const D: usize>(coarse: &TreeMesh<D>, cell: &Cell<D>) -> usize {
    let parent = Cell { level: cell.level - 1, coords: cell.coords.map(|c| c >> 1) };
    coarse.find(&parent).expect("a mesh cut one level lower holds the parent of every cell it lacks")
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_geom::{Aabb, Vector};

    fn interpolation_is_exact_and_adjoint<const D: usize>() {
        let fine = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], 4, |lower, h, level| {
            level < 2 || (lower + Vector::repeat(0.5 * h) - Vector::repeat(0.3)).norm() <= h
        })
        .unwrap();
        let coarse = fine.coarsened(3);
        let (fine_nodes, coarse_nodes) = (NodeMap::new(&fine, 2), NodeMap::new(&coarse, 2));
        let interpolation = Interpolation::new(&coarse, &coarse_nodes, &fine, &fine_nodes);
        let f = |x: Vector<D>| (0..D).map(|d| 1.0 + x[d] * x[d] - 0.3 * x[d]).product::<f64>() as f32;
        let u: Vec<f32> = (0..coarse_nodes.node_count()).map(|n| f(coarse_nodes.point(n))).collect();
        let mut v = vec![0.0; fine_nodes.node_count()];
        interpolation.prolong(1, &u, &mut v);
        for n in (0..v.len()).filter(|&n| !fine_nodes.is_hanging(n)) {
            assert!((v[n] - f(fine_nodes.point(n))).abs() < 1e-5);
        }
        let load: Vec<f32> = (0..v.len()).map(|n| (n as f32).sin()).collect();
        let mut collected = vec![0.0; u.len()];
        interpolation.restrict(1, &load, &mut collected);
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(x, y)| f64::from(x * y)).sum::<f64>();
        assert!((dot(&load, &v) - dot(&collected, &u)).abs() < 1e-3);
    }

    #[test]
    fn interpolation_reproduces_quadratics() {
        interpolation_is_exact_and_adjoint::<2>();
        interpolation_is_exact_and_adjoint::<3>();
    }
}
