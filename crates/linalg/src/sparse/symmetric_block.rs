//! Symmetric sparse matrices in blocks of fixed size, and their Galerkin products.

use super::prolongation::Prolongation;
use super::{BlockGroups, BlockPattern, Pattern, SparseError, SparseMatrix};
use crate::jagged::Jagged;
use crate::operator::LinOp;
use crate::parallel;

/// Block with a row per component of the row's node.
type Block<const B: usize> = [[f64; B]; B];

/// Rows of blocks.
#[derive(Clone, Debug)]
struct BlockRows<const B: usize> {
    /// Columns of each row, ascending.
    columns: Jagged<u32>,
    /// One block per column.
    blocks: Vec<Block<B>>,
}

/// A symmetric matrix on the `B` components of nodes, of which the lower triangle is kept.
///
/// ```
/// use gluey_linalg::{LinOp, LocalTerm, Pattern, Prolongation, SymmetricBlockMatrix};
///
/// // Three springs between the points 0, 1, 2 and a wall, in one dimension.
/// let spring = [1.0, -1.0, -1.0, 1.0];
/// let mut a = SymmetricBlockMatrix::<1>::zeros(&Pattern::from_groups(3, &[[0, 1], [1, 2]])?);
/// for first in 0..2 {
///     let [left, right] = [0, 1].map(|local| LocalTerm { row: first + local, local, weight: 1.0 });
///     a.add_local(&[left, right], &spring);
/// }
/// a.add_local(&[LocalTerm { row: 2, local: 0, weight: 1.0 }], &spring);
/// let mut force = [0.0; 3];
/// a.apply(&[1.0, 2.0, 4.0], &mut force);
/// assert_eq!(force, [-1.0, -1.0, 6.0]);
///
/// // With the points moving as one only the spring to the wall is left.
/// let as_one = Prolongation::new(1, (0..3).map(|_| [(0, 1.0)]));
/// assert_eq!(a.galerkin(&as_one).diagonal(), [1.0]);
/// # Ok::<(), gluey_linalg::SparseError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SymmetricBlockMatrix<const B: usize> {
    lower: BlockRows<B>,
}

/// A block row of a matrix that a node of a small dense matrix stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalTerm {
    /// The row.
    pub row: u32,
    /// The node of the dense matrix.
    pub local: u32,
    /// Value at the node where the row's unknowns are one.
    pub weight: f64,
}

impl<const B: usize> SymmetricBlockMatrix<B> {
    /// The zero matrix with the lower triangle of this symmetric pattern of blocks.
    pub fn zeros(pattern: &Pattern) -> Self {
        let row_count = pattern.row_count();
        let mut columns = Jagged::with_capacity(row_count, (pattern.entry_count() + row_count) / 2);
        for row in 0..row_count {
            let all = pattern.columns_of(row).iter().copied();
            columns.push(all.take_while(|&column| column as usize <= row));
        }
        let blocks = parallel::filled([[0.0; B]; B], columns.items().len());
        Self { lower: BlockRows { columns, blocks } }
    }

    /// Adds `C^T K C` for a symmetric dense matrix `K` of the nodes of a cell, given row by row, and the
    /// terms of `C`, sorted by their rows.
    pub fn add_local(&mut self, terms: &[LocalTerm], dense: &[f64]) {
        let size = dense.len().isqrt();
        let BlockRows { columns, blocks } = &mut self.lower;
        for row in terms {
            let range = columns.range(row.row as usize);
            let (columns, blocks) = (&columns.items()[range.clone()], &mut blocks[range]);
            let mut place = 0;
            let rows = &dense[row.local as usize * B * size..][..B * size];
            for column in terms.iter().take_while(|column| column.row <= row.row) {
                while columns[place] < column.row {
                    place += 1;
                }
                let weight = row.weight * column.weight;
                for (block, row) in blocks[place].iter_mut().zip(rows.chunks_exact(size)) {
                    let values = &row[column.local as usize * B..][..B];
                    block.iter_mut().zip(values).for_each(|(entry, value)| *entry += weight * value);
                }
            }
        }
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.lower.columns.len()
    }

    /// The blocks in a row up to the diagonal, `(column, block)`, columns ascending.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (u32, &[[f64; B]; B])> {
        self.lower.row(row)
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.node_count() * B];
        for (node, diagonal) in diagonal.chunks_exact_mut(B).enumerate() {
            if let Some((_, block)) = self.row(node).find(|(column, _)| *column as usize == node) {
                let entries = block.as_flattened().iter().step_by(B + 1);
                diagonal.iter_mut().zip(entries).for_each(|(d, &value)| *d = value);
            }
        }
        diagonal
    }

    /// The matrix in single unknowns, and the pattern of its blocks.
    ///
    /// # Errors
    /// If it has more entries than can be counted.
    pub fn to_sparse(&self) -> Result<(SparseMatrix, BlockPattern), SparseError> {
        let mut pairs = BlockGroups::default();
        for row in 0..self.node_count() {
            self.row(row).for_each(|(column, _)| pairs.push([row, column as usize]));
        }
        let first = (0..=self.node_count() * B).step_by(B).map(|k| k as u32).collect();
        let pattern = BlockPattern::new(first, pairs)?;
        let mut blocks = self.lower.blocks.iter();
        let matrix = pattern.sum(|pair, target| {
            let Some(block) = blocks.next() else { return };
            let (size, shift) = (pair.len() * B, (pair.len() - 1) * B);
            for a in 0..B {
                for b in 0..B {
                    target[a * size + shift + b] = block[a][b];
                    target[(shift + b) * size + a] = block[a][b];
                }
            }
        });
        Ok((matrix, pattern))
    }

    /// `P^T A P`, which is `M + M^T` for `M = P^T (L + D/2) P` with the blocks `L` below and `D` on the
    /// diagonal of `A`.
    pub fn galerkin(&self, prolongation: &Prolongation) -> Self {
        let coarse_count = prolongation.coarse_count();
        let product = sum_of_rows(self.node_count(), coarse_count, |row, sum: &mut Sum<B>| {
            for (column, block) in self.row(row) {
                let share = if column as usize == row { 0.5 } else { 1.0 };
                for &(coarse, weight) in prolongation.of(column as usize) {
                    sum.add(coarse, share * weight, block);
                }
            }
        });
        let transposed = prolongation.transposed();
        let half = sum_of_rows(coarse_count, coarse_count, |row, sum| {
            for &(fine, weight) in transposed.of(row) {
                product.row(fine as usize).for_each(|(column, block)| sum.add(column, weight, block));
            }
        });
        Self { lower: half.plus_transposed() }
    }

    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        let (x, y) = (x.as_chunks::<B>().0, y.as_chunks_mut::<B>().0);
        for row in 0..self.node_count() {
            for (column, block) in self.row(row) {
                let column = column as usize;
                for a in 0..B {
                    for b in 0..B {
                        y[row][a] += block[a][b] * x[column][b];
                        if column != row {
                            y[column][b] += block[a][b] * x[row][a];
                        }
                    }
                }
            }
        }
    }
}

impl<const B: usize> BlockRows<B> {
    fn row(&self, row: usize) -> impl Iterator<Item = (u32, &Block<B>)> {
        self.columns[row].iter().copied().zip(&self.blocks[self.columns.range(row)])
    }

    /// The lower triangle of the sum of this square matrix and its transpose.
    fn plus_transposed(&self) -> Self {
        let count = self.columns.len();
        let mut upper = vec![Vec::new(); count];
        for row in 0..count {
            for (column, block) in self.row(row).filter(|(column, _)| *column as usize >= row) {
                upper[column as usize].push((row as u32, block));
            }
        }
        sum_of_rows(count, count, |row, sum: &mut Sum<B>| {
            let lower = self.row(row).take_while(|(column, _)| *column as usize <= row);
            lower.for_each(|(column, block)| sum.add(column, 1.0, block));
            for &(column, block) in &upper[row] {
                sum.add(column, 1.0, &std::array::from_fn(|a| std::array::from_fn(|b| block[b][a])));
            }
        })
    }
}

impl<const B: usize> LinOp<f64> for SymmetricBlockMatrix<B> {
    fn dim(&self) -> usize {
        self.node_count() * B
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.multiply(x, y);
    }
}

impl<const B: usize> LinOp<f64> for &SymmetricBlockMatrix<B> {
    fn dim(&self) -> usize {
        self.node_count() * B
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.multiply(x, y);
    }
}

/// A row of blocks while terms are added to it.
struct Sum<const B: usize> {
    /// Place of each column among those met, or `u32::MAX`.
    place: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<Block<B>>,
}

impl<const B: usize> Sum<B> {
    fn add(&mut self, column: u32, weight: f64, block: &Block<B>) {
        let place = &mut self.place[column as usize];
        if *place == u32::MAX {
            *place = self.columns.len() as u32;
            self.columns.push(column);
            self.blocks.push([[0.0; B]; B]);
        }
        let sum = self.blocks[*place as usize].as_flattened_mut();
        sum.iter_mut().zip(block.as_flattened()).for_each(|(sum, value)| *sum += weight * value);
    }
}

/// The matrix whose rows `fill` sums up.
fn sum_of_rows<const B: usize>(
    row_count: usize,
    column_count: usize,
    mut fill: impl FnMut(usize, &mut Sum<B>),
) -> BlockRows<B> {
    let mut new = BlockRows { columns: Jagged::with_capacity(row_count, 0), blocks: Vec::new() };
    let mut sum = Sum { place: vec![u32::MAX; column_count], columns: Vec::new(), blocks: Vec::new() };
    for row in 0..row_count {
        fill(row, &mut sum);
        sum.columns.sort_unstable();
        for &column in &sum.columns {
            let place = std::mem::replace(&mut sum.place[column as usize], u32::MAX) as usize;
            new.blocks.push(sum.blocks[place]);
        }
        new.columns.push(sum.columns.drain(..));
        sum.blocks.clear();
    }
    new
}

#[cfg(test)]
impl<const B: usize> SymmetricBlockMatrix<B> {
    /// The blocks of a matrix whose unknowns are the components of node after node.
    pub(crate) fn from_sparse(matrix: &SparseMatrix) -> Self {
        let pattern = matrix.pattern();
        let mut lower = BlockRows { columns: Jagged::default(), blocks: Vec::new() };
        for row in 0..pattern.row_count() / B {
            let columns = pattern.columns_of(row * B).iter().step_by(B).map(|column| column / B as u32);
            let columns: Vec<u32> = columns.take_while(|&column| column as usize <= row).collect();
            lower.blocks.extend(columns.iter().map(|&column| {
                let entry = |a: usize, b: usize| matrix.get(row * B + a, column as usize * B + b);
                std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b)))
            }));
            lower.columns.push(columns);
        }
        Self { lower }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector;
    use std::sync::Arc;

    /// Nodes on a line, coupled with their neighbours.
    fn line<const B: usize>(nodes: usize) -> SparseMatrix {
        let groups: Vec<Vec<usize>> = (1..nodes).map(|k| ((k - 1) * B..(k + 1) * B).collect()).collect();
        let pattern = Pattern::from_groups(nodes * B, &groups).expect("valid");
        let mut matrix = SparseMatrix::zeros(Arc::new(pattern));
        for (k, group) in groups.iter().enumerate() {
            matrix.add_block(group, &dense(k, group.len())).expect("in the pattern");
        }
        matrix
    }

    fn dense(k: usize, n: usize) -> Vec<f64> {
        let entry = |i: usize, j: usize| if i == j { 9.0 + k as f64 } else { ((i + j) as f64).sin() };
        (0..n * n).map(|e| entry(e / n, e % n)).collect()
    }

    fn products_agree<const B: usize>() {
        let (fine, coarse) = (9, 5);
        let sparse = line::<B>(fine);
        let mut matrix = SymmetricBlockMatrix::<B>::from_sparse(&sparse);
        let row = |k: usize| match k % 2 {
            0 => vec![(k as u32 / 2, 1.0)],
            _ => vec![(k as u32 / 2, 0.4), (k as u32 / 2 + 1, 0.6)],
        };
        let prolongation = Prolongation::new(coarse, (0..fine).map(row));
        let mut product = matrix.galerkin(&prolongation);
        let mut x = vec![0.0; coarse * B];
        vector::fill_pseudo_random(1, &mut x);
        let (mut px, mut apx) = (vec![0.0; fine * B], vec![0.0; fine * B]);
        prolongation.prolong::<B>(&x, &mut px);
        sparse.multiply(&px, &mut apx);
        let mut own = vec![0.0; fine * B];
        matrix.apply(&px, &mut own);
        let (mut expected, mut found) = (vec![0.0; coarse * B], vec![0.0; coarse * B]);
        prolongation.restrict::<B>(&apx, &mut expected);
        product.apply(&x, &mut found);
        assert!(own.iter().zip(&apx).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn the_galerkin_product_is_that_of_the_three_matrices() {
        products_agree::<2>();
        products_agree::<3>();
    }

    /// Cell by cell, in blocks and in single unknowns, and back.
    fn assembly_agrees<const B: usize>() {
        let count = 6;
        let groups: Vec<[usize; 2]> = (1..count).map(|k| [k - 1, k]).collect();
        let pattern = Pattern::from_groups(count, &groups).expect("valid");
        let mut matrix = SymmetricBlockMatrix::<B>::zeros(&pattern);
        for (k, nodes) in groups.iter().enumerate() {
            let term =
                |local: usize| LocalTerm { row: nodes[local] as u32, local: local as u32, weight: 1.0 };
            matrix.add_local(&[0, 1].map(term), &dense(k, 2 * B));
        }
        let sparse = line::<B>(count);
        assert_eq!(matrix.lower.blocks, SymmetricBlockMatrix::<B>::from_sparse(&sparse).lower.blocks);
        assert_eq!(matrix.diagonal(), sparse.diagonal());
        let (again, blocks) = matrix.to_sparse().expect("small");
        assert_eq!((again.values(), again.pattern()), (sparse.values(), blocks.pattern()));
    }

    #[test]
    fn cells_add_up_to_the_matrix_in_single_unknowns() {
        assembly_agrees::<1>();
        assembly_agrees::<2>();
        assembly_agrees::<3>();
    }
}
