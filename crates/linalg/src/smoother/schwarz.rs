//! Additive Schwarz smoothing: exact inverses on overlapping patches, added up.
//!
//! Where a cell holds motions of every stiffness no diagonal tells them apart; the operator's block on the
//! nodes of the cell does. With `R_c` the restriction to a patch, `A_c` the block of the matrix there and `W`
//! the inverse number of patches a node belongs to, `z = W^1/2 sum R_c^T A_c^-1 R_c W^1/2 r`. Without the
//! weights the largest eigenvalue of the smoothed operator is about the largest number of patches at a node.
//! Nodes of no patch are divided by their diagonal. (Dryja and Widlund 1987; Toselli and Widlund, Domain
//! Decomposition Methods, 2005.)

use crate::dense::{BlockError, DenseSymmetric};
use crate::jagged::Jagged;
use crate::operator::Preconditioner;
use crate::scalar::Scalar;
use crate::sparse::SymmetricBlockMatrix;
use crate::vector;

/// A block that is not positive definite, and its patch.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("patch {patch}: {source}")]
pub struct PatchError {
    /// Place among the patches.
    pub patch: usize,
    /// Cause.
    pub source: BlockError,
}

/// The inverses of the blocks on patches of nodes with `B` components, for vectors of `T`.
#[derive(Clone, Debug)]
pub struct SchwarzPatches<T, const B: usize> {
    /// Nodes of each patch.
    patches: Jagged<u32>,
    /// Lower triangles of the inverses, symmetric weights included, row by row.
    inverses: Vec<f32>,
    /// Weights of the corrections of each node of each patch.
    weights: Vec<T>,
    /// Inverse diagonal on nodes of no patch, zero elsewhere.
    diagonal: Vec<T>,
    /// Residual and correction on a patch.
    r: Vec<f32>,
    z: Vec<f32>,
}

/// Places of the weights of a node.
#[derive(Clone, Copy, PartialEq)]
enum Weights {
    /// Their roots before and after the inverses.
    Symmetric,
    /// After the inverses.
    Restricted,
}

impl<T: Scalar, const B: usize> SchwarzPatches<T, B> {
    /// For the block of `matrix` on the nodes of each patch, and an inverse `diagonal` for the nodes that are
    /// in none.
    ///
    /// # Errors
    /// If a block is not positive definite.
    pub fn new(
        matrix: &SymmetricBlockMatrix<B>,
        patches: impl Iterator<Item = Vec<u32>>,
        diagonal: Vec<T>,
    ) -> Result<Self, BlockError> {
        Self::weighted(matrix, patches, diagonal, Weights::Symmetric).map_err(|error| error.source)
    }

    /// Restricted additive Schwarz (Cai and Sarkis 1999): `z = W sum R_c^T A_c^-1 R_c r`, which is not
    /// symmetric and needs no damping.
    ///
    /// # Errors
    /// If a block is not positive definite.
    pub fn restricted(
        matrix: &SymmetricBlockMatrix<B>,
        patches: impl Iterator<Item = Vec<u32>>,
        diagonal: Vec<T>,
    ) -> Result<Self, PatchError> {
        Self::weighted(matrix, patches, diagonal, Weights::Restricted)
    }

    fn weighted(
        matrix: &SymmetricBlockMatrix<B>,
        patches: impl Iterator<Item = Vec<u32>>,
        mut diagonal: Vec<T>,
        weights_of: Weights,
    ) -> Result<Self, PatchError> {
        let ascending = patches.map(|mut nodes| {
            nodes.sort_unstable();
            nodes
        });
        let patches: Jagged<u32> = ascending.collect();
        let mut count = vec![0u32; matrix.node_count()];
        patches.items().iter().for_each(|&node| count[node as usize] += 1);
        let share = |node: u32| f64::from(count[node as usize]);
        let weight =
            |&node: &u32| if weights_of == Weights::Symmetric { 1.0 / share(node).sqrt() } else { 1.0 };
        let after = |&node: &u32| match weights_of {
            Weights::Symmetric => T::ONE,
            Weights::Restricted => T::from_f64(1.0 / share(node)),
        };
        let after = patches.items().iter().map(after).collect();
        let mut inverses = Vec::new();
        inverses.reserve_exact(patches.iter().map(|nodes| triangle_size(nodes.len() * B)).sum());
        let mut place = vec![u32::MAX; matrix.node_count()];
        let (mut dense, mut weights) = (DenseSymmetric::default(), Vec::new());
        for (patch, nodes) in patches.iter().enumerate() {
            block_on(matrix, nodes, &mut place, &mut dense);
            dense.sweep().map_err(|source| PatchError { patch, source })?;
            weights.clear();
            weights.extend(nodes.iter().map(weight).flat_map(|weight| [weight; B]));
            for (i, own) in weights.iter().enumerate() {
                let row = dense.row(i).iter().zip(&weights);
                inverses.extend(row.map(|(value, weight)| -(own * weight * value) as f32));
            }
        }
        for &node in patches.items() {
            diagonal[node as usize * B..][..B].fill(T::ZERO);
        }
        let largest = patches.iter().map(<[u32]>::len).max().unwrap_or(0) * B;
        let [r, z] = [(); 2].map(|()| Vec::with_capacity(largest));
        Ok(Self { patches, inverses, weights: after, diagonal, r, z })
    }
}

impl<T: Scalar, const B: usize> Preconditioner<T> for SchwarzPatches<T, B> {
    fn apply(&mut self, r: &[T], z: &mut [T]) {
        vector::multiply(&self.diagonal, r, z);
        let (mut inverses, mut weights) = (self.inverses.as_slice(), self.weights.as_slice());
        for nodes in self.patches.iter() {
            let n = nodes.len() * B;
            let (inverse, rest) = inverses.split_at(triangle_size(n));
            self.r.clear();
            for &node in nodes {
                self.r.extend(r[node as usize * B..][..B].iter().map(|r| r.to_f64() as f32));
            }
            self.z.clear();
            self.z.resize(n, 0.0);
            multiply_triangle(inverse, &self.r, &mut self.z);
            let (of_patch, others) = weights.split_at(nodes.len());
            for ((z_local, &node), &weight) in self.z.chunks_exact(B).zip(nodes).zip(of_patch) {
                let z = &mut z[node as usize * B..][..B];
                z.iter_mut()
                    .zip(z_local)
                    .for_each(|(z, &local)| *z += weight * T::from_f64(f64::from(local)));
            }
            (inverses, weights) = (rest, others);
        }
    }
}

/// Entries of the lower triangle of a matrix of `n` rows.
fn triangle_size(n: usize) -> usize {
    n * (n + 1) / 2
}

/// The dense block of `matrix` on some nodes, ascending. `place` is all `u32::MAX` before and after.
pub(super) fn block_on<const B: usize>(
    matrix: &SymmetricBlockMatrix<B>,
    nodes: &[u32],
    place: &mut [u32],
    dense: &mut DenseSymmetric,
) {
    dense.reset(nodes.len() * B);
    for (i, &node) in nodes.iter().enumerate() {
        place[node as usize] = i as u32;
    }
    for (i, &node) in nodes.iter().enumerate() {
        for (column, block) in matrix.row(node as usize) {
            let j = place[column as usize];
            if j != u32::MAX {
                for (a, row) in block.iter().enumerate() {
                    dense.row_mut(i * B + a)[j as usize * B..][..B].copy_from_slice(row);
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
    use crate::operator::LinOp;
    use crate::sparse::{Pattern, SparseMatrix};
    use std::sync::Arc;

    /// A dense matrix of nodes with `B` components, with this on its diagonal.
    fn full<const B: usize>(nodes: usize, diagonal: f64) -> SymmetricBlockMatrix<B> {
        let all: Vec<usize> = (0..nodes * B).collect();
        let pattern = Pattern::from_groups(all.len(), &[&all]).expect("valid");
        let mut matrix = SparseMatrix::zeros(Arc::new(pattern));
        let entry = |i: usize, j: usize| if i == j { diagonal } else { ((i + j) as f64).sin() };
        let n = all.len();
        let dense: Vec<f64> = (0..n * n).map(|e| entry(e / n, e % n)).collect();
        matrix.add_block(&all, &dense).expect("in the pattern");
        SymmetricBlockMatrix::from_sparse(&matrix)
    }

    /// With one patch over all nodes the smoother is the inverse.
    fn one_patch_inverts<const B: usize>() {
        let nodes = 7;
        let n = nodes * B;
        let mut matrix = full::<B>(nodes, 20.0);
        let all = std::iter::once((0..nodes as u32).rev().collect());
        let mut patches = SchwarzPatches::new(&matrix, all, vec![1.0; n]).expect("positive definite");
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

    #[test]
    fn nodes_of_no_patch_are_divided_by_their_diagonal() {
        let matrix = full::<1>(3, 20.0);
        let mut patches = SchwarzPatches::new(&matrix, std::iter::once(vec![1]), vec![0.5; 3]).expect("fine");
        let mut z = [0.0f64; 3];
        patches.apply(&[2.0, 20.0, 4.0], &mut z);
        assert_eq!(z, [1.0, 1.0, 2.0]);
    }

    #[test]
    fn a_patch_that_is_not_positive_definite_is_refused() {
        let refused = SchwarzPatches::new(&full::<2>(2, -1.0), std::iter::once(vec![0, 1]), vec![1.0f32; 4]);
        assert!(matches!(refused, Err(BlockError::NotPositiveDefinite { pivot: 0, .. })));
    }
}
