//! Additive Schwarz smoothing with the cells of the solid as patches.
//!
//! A cell that a solid's surface cuts holds motions of every stiffness between that of the fluid and that of
//! the solid, and no diagonal tells them apart; the operator's block on the nodes of the cell does. With `W`
//! the inverse number of patches a node belongs to, `z = W^1/2 sum R_c^T A_c^-1 R_c W^1/2 r`. The weights
//! bring the largest eigenvalue from about ten down to two. Nodes of no patch are divided by their diagonal.

use gluey_linalg::{BlockError, DenseSymmetric, Preconditioner, Scalar};

use super::node_matrix::NodeMatrix;

/// The inverses of the blocks on cells, for vectors of `T`.
pub struct Patches<T, const D: usize> {
    /// Nodes of patch after patch.
    nodes: Vec<u32>,
    /// Where those of each patch end.
    ends: Vec<u32>,
    /// Lower triangles of the inverses, weights included, row by row.
    inverses: Vec<f32>,
    /// Inverse diagonal on nodes of no patch, zero elsewhere.
    diagonal: Vec<T>,
    r: Vec<f32>,
    z: Vec<f32>,
}

impl<T: Scalar, const D: usize> Patches<T, D> {
    /// For the block of `matrix` on the nodes of each cell, and an inverse `diagonal` for the nodes that are
    /// in none.
    pub fn new(
        matrix: &NodeMatrix<D>,
        cells: impl Iterator<Item = Vec<u32>>,
        diagonal: Vec<T>,
    ) -> Result<Self, BlockError> {
        let mut new = Self {
            nodes: Vec::new(),
            ends: Vec::new(),
            inverses: Vec::new(),
            diagonal,
            r: Vec::new(),
            z: Vec::new(),
        };
        for mut cell in cells {
            cell.sort_unstable();
            new.nodes.extend(cell);
            new.ends.push(new.nodes.len() as u32);
        }
        let mut count = vec![0u32; matrix.node_count()];
        new.nodes.iter().for_each(|&n| count[n as usize] += 1);
        let mut place = vec![u32::MAX; matrix.node_count()];
        let sizes = std::iter::once(0).chain(new.ends.iter().copied()).zip(&new.ends);
        let size = |(start, end): (u32, &u32)| (end - start) as usize * D;
        new.inverses.reserve_exact(sizes.map(size).map(|n| n * (n + 1) / 2).sum());
        let (mut dense, mut weights) = (DenseSymmetric::default(), Vec::new());
        let mut start = 0;
        for &end in &new.ends {
            let nodes = &new.nodes[start as usize..end as usize];
            block_on(matrix, nodes, &mut place, &mut dense);
            dense.sweep()?;
            weights.clear();
            let weight = |node: &u32| 1.0 / f64::from(count[*node as usize]).sqrt();
            weights.extend(nodes.iter().map(weight).flat_map(|weight| [weight; D]));
            for (i, own) in weights.iter().enumerate() {
                let row = dense.row(i).iter().zip(&weights);
                new.inverses.extend(row.map(|(value, weight)| -(own * weight * value) as f32));
            }
            start = end;
        }
        for &node in &new.nodes {
            new.diagonal[node as usize * D..][..D].fill(T::ZERO);
        }
        Ok(new)
    }
}

impl<T: Scalar, const D: usize> Preconditioner<T> for Patches<T, D> {
    fn apply(&mut self, r: &[T], z: &mut [T]) {
        gluey_linalg::vector::multiply(&self.diagonal, r, z);
        let (mut start, mut inverses) = (0, self.inverses.as_slice());
        for &end in &self.ends {
            let nodes = &self.nodes[start as usize..end as usize];
            let n = nodes.len() * D;
            let (inverse, rest) = inverses.split_at(n * (n + 1) / 2);
            self.r.clear();
            for &node in nodes {
                self.r.extend(r[node as usize * D..][..D].iter().map(|r| r.to_f64() as f32));
            }
            self.z.clear();
            self.z.resize(n, 0.0);
            multiply_triangle(inverse, &self.r, &mut self.z);
            for (z_local, &node) in self.z.chunks_exact(D).zip(nodes) {
                let z = &mut z[node as usize * D..][..D];
                z.iter_mut().zip(z_local).for_each(|(z, &local)| *z += T::from_f64(f64::from(local)));
            }
            (start, inverses) = (end, rest);
        }
    }
}

/// The dense block of `matrix` on some nodes, ascending. `place` is all `u32::MAX` before and after.
fn block_on<const D: usize>(
    matrix: &NodeMatrix<D>,
    nodes: &[u32],
    place: &mut [u32],
    dense: &mut DenseSymmetric,
) {
    dense.reset(nodes.len() * D);
    for (i, &node) in nodes.iter().enumerate() {
        place[node as usize] = i as u32;
    }
    for (i, &node) in nodes.iter().enumerate() {
        for (column, block) in matrix.row(node as usize) {
            let j = place[column as usize];
            if j != u32::MAX {
                for (a, row) in block.iter().enumerate() {
                    dense.row_mut(i * D + a)[j as usize * D..][..D].copy_from_slice(row);
                }
            }
        }
    }
    nodes.iter().for_each(|&node| place[node as usize] = u32::MAX);
}

/// `y += A x` for a symmetric matrix given by its lower triangle, row by row.
fn multiply_triangle(mut triangle: &[f32], x: &[f32], y: &mut [f32]) {
    const LANES: usize = 8;
    for i in 0..x.len() {
        let (row, rest) = triangle.split_at(i + 1);
        let ((row_full, row_rest), (x_full, x_rest)) =
            (row[..i].as_chunks::<LANES>(), x[..i].as_chunks::<LANES>());
        let (below, from) = y.split_at_mut(i);
        let (y_full, y_rest) = below.as_chunks_mut::<LANES>();
        let mut lanes = [0.0; LANES];
        for ((a, x_full), y) in row_full.iter().zip(x_full).zip(y_full) {
            for l in 0..LANES {
                lanes[l] += a[l] * x_full[l];
                y[l] += a[l] * x[i];
            }
        }
        for ((a, x_rest), y) in row_rest.iter().zip(x_rest).zip(y_rest) {
            lanes[0] += a * x_rest;
            *y += a * x[i];
        }
        from[0] += lanes.iter().sum::<f32>() + row[i] * x[i];
        triangle = rest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_linalg::{LinOp, Pattern, SparseMatrix, vector};
    use std::sync::Arc;

    /// With one patch over all nodes the smoother is the inverse.
    fn one_patch_inverts<const D: usize>() {
        let nodes = 7;
        let all: Vec<usize> = (0..nodes * D).collect();
        let mut matrix = SparseMatrix::zeros(Arc::new(Pattern::from_groups(nodes * D, &[&all]).unwrap()));
        let entry = |i: usize, j: usize| if i == j { 20.0 } else { ((i + j) as f64).sin() };
        let n = all.len();
        let dense: Vec<f64> = (0..n * n).map(|e| entry(e / n, e % n)).collect();
        matrix.add_block(&all, &dense).unwrap();
        let mut matrix = NodeMatrix::<D>::from_sparse(&matrix);
        let cells = std::iter::once((0..nodes as u32).rev().collect());
        let mut patches = Patches::new(&matrix, cells, vec![1.0; n]).unwrap();
        let (mut x, mut ax, mut z) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        vector::fill_pseudo_random(1, &mut x);
        matrix.apply(&x, &mut ax);
        patches.apply(&ax, &mut z);
        assert!(z.iter().zip(&x).all(|(z, x)| (z - x).abs() < 1e-5));
    }

    #[test]
    fn a_patch_over_all_nodes_solves() {
        one_patch_inverts::<2>();
        one_patch_inverts::<3>();
    }
}
