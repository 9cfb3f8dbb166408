//! Symmetric sparse matrices in blocks, one for each pair of nodes, and their Galerkin products.

use gluey_linalg::{BlockGroups, BlockPattern, LinOp, SparseMatrix};

use crate::error::StokesError;

/// A symmetric matrix on the `D` velocity components of numbered nodes.
pub struct NodeMatrix<const D: usize> {
    /// First block of each row of blocks, then their number.
    start: Vec<u32>,
    columns: Vec<u32>,
    /// `D x D` numbers each, row by row.
    blocks: Vec<f64>,
}

impl<const D: usize> NodeMatrix<D> {
    /// The blocks of a matrix whose unknowns are the components of node after node.
    pub fn from_sparse(matrix: &SparseMatrix) -> Self {
        let pattern = matrix.pattern();
        let mut new = Self { start: vec![0], columns: Vec::new(), blocks: Vec::new() };
        for row in 0..pattern.row_count() / D {
            let rows: [&[f64]; D] = std::array::from_fn(|a| &matrix.values()[pattern.range(row * D + a)]);
            let columns = pattern.columns_of(row * D).iter().step_by(D);
            for (k, &column) in columns.enumerate() {
                new.columns.push(column / D as u32);
                rows.iter().for_each(|row| new.blocks.extend_from_slice(&row[k * D..(k + 1) * D]));
            }
            new.start.push(new.columns.len() as u32);
        }
        new
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.start.len() - 1
    }

    /// The blocks in a row, `(column, block)`, columns ascending.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (u32, &[f64])> {
        let range = self.start[row] as usize..self.start[row + 1] as usize;
        let blocks = self.blocks[range.start * D * D..range.end * D * D].chunks_exact(D * D);
        self.columns[range].iter().copied().zip(blocks)
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.node_count() * D];
        for (node, diagonal) in diagonal.chunks_exact_mut(D).enumerate() {
            if let Some((_, block)) = self.row(node).find(|(column, _)| *column as usize == node) {
                diagonal.iter_mut().zip(block.iter().step_by(D + 1)).for_each(|(d, &value)| *d = value);
            }
        }
        diagonal
    }

    /// The matrix in single unknowns, and a good order to eliminate them in.
    pub fn to_sparse(&self) -> Result<(SparseMatrix, Vec<usize>), StokesError> {
        let mut pairs = BlockGroups::default();
        for row in 0..self.node_count() {
            let beyond = self.row(row).map(|(column, _)| column as usize).filter(|&column| column >= row);
            beyond.for_each(|column| pairs.push([row, column]));
        }
        let first = (0..=self.node_count() * D).step_by(D).map(|k| k as u32).collect();
        let pattern = BlockPattern::new(first, pairs)?;
        let mut values = Vec::with_capacity(self.blocks.len());
        for row in 0..self.node_count() {
            for a in 0..D {
                self.row(row).for_each(|(_, block)| values.extend_from_slice(&block[a * D..(a + 1) * D]));
            }
        }
        let mut matrix = SparseMatrix::zeros(pattern.pattern().clone());
        matrix.copy_values(&values)?;
        Ok((matrix, pattern.minimum_degree()?))
    }

    /// `P^T A P`.
    pub fn galerkin(&self, prolongation: &Prolongation) -> Self {
        let product = sum_of_rows(self.node_count(), prolongation.coarse_count, |row, sum: &mut Sum<D>| {
            for (column, block) in self.row(row) {
                for &(coarse, weight) in prolongation.of(column as usize) {
                    sum.add(coarse, weight, block);
                }
            }
        });
        let transposed = prolongation.transposed();
        sum_of_rows(prolongation.coarse_count, prolongation.coarse_count, |row, sum: &mut Sum<D>| {
            for &(fine, weight) in transposed.of(row) {
                product.row(fine as usize).for_each(|(column, block)| sum.add(column, weight, block));
            }
        })
    }
}

impl<const D: usize> NodeMatrix<D> {
    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        for (row, y) in y.as_chunks_mut::<D>().0.iter_mut().enumerate() {
            *y = [0.0; D];
            for (column, block) in self.row(row) {
                let x = &x[column as usize * D..][..D];
                for (y, block) in y.iter_mut().zip(block.chunks_exact(D)) {
                    *y += block.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
                }
            }
        }
    }
}

impl<const D: usize> LinOp<f64> for NodeMatrix<D> {
    fn dim(&self) -> usize {
        self.node_count() * D
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.multiply(x, y);
    }
}

impl<const D: usize> LinOp<f64> for &NodeMatrix<D> {
    fn dim(&self) -> usize {
        self.node_count() * D
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.multiply(x, y);
    }
}

/// A row of blocks while terms are added to it.
struct Sum<const D: usize> {
    /// Place of each column among those met, or `u32::MAX`.
    place: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<f64>,
}

impl<const D: usize> Sum<D> {
    fn add(&mut self, column: u32, weight: f64, block: &[f64]) {
        let place = &mut self.place[column as usize];
        if *place == u32::MAX {
            *place = self.columns.len() as u32;
            self.columns.push(column);
            self.blocks.resize(self.columns.len() * D * D, 0.0);
        }
        let sum = &mut self.blocks[*place as usize * D * D..][..D * D];
        sum.iter_mut().zip(block).for_each(|(sum, value)| *sum += weight * value);
    }
}

/// The matrix whose rows `fill` sums up.
fn sum_of_rows<const D: usize>(
    row_count: usize,
    column_count: usize,
    mut fill: impl FnMut(usize, &mut Sum<D>),
) -> NodeMatrix<D> {
    let mut new = NodeMatrix { start: vec![0], columns: Vec::new(), blocks: Vec::new() };
    let mut sum = Sum { place: vec![u32::MAX; column_count], columns: Vec::new(), blocks: Vec::new() };
    for row in 0..row_count {
        fill(row, &mut sum);
        sum.columns.sort_unstable();
        for column in sum.columns.drain(..) {
            let place = std::mem::replace(&mut sum.place[column as usize], u32::MAX) as usize;
            new.columns.push(column);
            new.blocks.extend_from_slice(&sum.blocks[place * D * D..(place + 1) * D * D]);
        }
        sum.blocks.clear();
        new.start.push(new.columns.len() as u32);
    }
    new
}

/// Values at nodes as weighted sums of those at fewer nodes, the same for every component.
pub struct Prolongation {
    start: Vec<u32>,
    terms: Vec<(u32, f64)>,
    coarse_count: usize,
}

impl Prolongation {
    /// One row a node, to numbers below `coarse_count`.
    pub fn new(
        coarse_count: usize,
        rows: impl Iterator<Item = impl IntoIterator<Item = (u32, f64)>>,
    ) -> Self {
        let mut new = Self { start: vec![0], terms: Vec::new(), coarse_count };
        for row in rows {
            new.terms.extend(row);
            new.start.push(new.terms.len() as u32);
        }
        new
    }

    /// Number of nodes it goes from.
    pub fn coarse_count(&self) -> usize {
        self.coarse_count
    }

    fn of(&self, node: usize) -> &[(u32, f64)] {
        &self.terms[self.start[node] as usize..self.start[node + 1] as usize]
    }

    fn transposed(&self) -> Self {
        let mut rows = vec![Vec::new(); self.coarse_count];
        for node in 0..self.start.len() - 1 {
            self.of(node)
                .iter()
                .for_each(|&(coarse, weight)| rows[coarse as usize].push((node as u32, weight)));
        }
        Self::new(self.start.len() - 1, rows.into_iter())
    }

    /// `fine += P coarse` for `D` components. Nodes beyond its rows are left alone.
    pub fn prolong<const D: usize>(&self, coarse: &[f64], fine: &mut [f64]) {
        let fine = fine.as_chunks_mut::<D>().0;
        for (node, fine) in fine.iter_mut().enumerate().take(self.start.len() - 1) {
            for &(from, weight) in self.of(node) {
                let from = &coarse[from as usize * D..][..D];
                fine.iter_mut().zip(from).for_each(|(fine, value)| *fine += weight * value);
            }
        }
    }

    /// `coarse = P^T fine`.
    pub fn restrict<const D: usize>(&self, fine: &[f64], coarse: &mut [f64]) {
        coarse.fill(0.0);
        let fine = fine.as_chunks::<D>().0;
        for (node, fine) in fine.iter().enumerate().take(self.start.len() - 1) {
            for &(to, weight) in self.of(node) {
                let to = &mut coarse[to as usize * D..][..D];
                to.iter_mut().zip(fine).for_each(|(to, value)| *to += weight * value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_linalg::{Pattern, vector};
    use std::sync::Arc;

    /// Nodes on a line, coupled with their neighbours.
    fn line<const D: usize>(nodes: usize) -> SparseMatrix {
        let groups: Vec<Vec<usize>> = (1..nodes).map(|k| ((k - 1) * D..(k + 1) * D).collect()).collect();
        let mut matrix = SparseMatrix::zeros(Arc::new(Pattern::from_groups(nodes * D, &groups).unwrap()));
        for (k, group) in groups.iter().enumerate() {
            let entry = |i: usize, j: usize| if i == j { 9.0 + k as f64 } else { ((i + j) as f64).sin() };
            let n = group.len();
            let dense: Vec<f64> = (0..n * n).map(|e| entry(e / n, e % n)).collect();
            matrix.add_block(group, &dense).unwrap();
        }
        matrix
    }

    fn products_agree<const D: usize>() {
        let (fine, coarse) = (9, 5);
        let sparse = line::<D>(fine);
        let mut matrix = NodeMatrix::<D>::from_sparse(&sparse);
        let row = |k: usize| match k % 2 {
            0 => vec![(k as u32 / 2, 1.0)],
            _ => vec![(k as u32 / 2, 0.4), (k as u32 / 2 + 1, 0.6)],
        };
        let prolongation = Prolongation::new(coarse, (0..fine).map(row));
        let mut product = matrix.galerkin(&prolongation);
        let mut x = vec![0.0; coarse * D];
        vector::fill_pseudo_random(1, &mut x);
        let (mut px, mut apx) = (vec![0.0; fine * D], vec![0.0; fine * D]);
        prolongation.prolong::<D>(&x, &mut px);
        sparse.multiply(&px, &mut apx);
        let mut own = vec![0.0; fine * D];
        matrix.apply(&px, &mut own);
        let (mut expected, mut found) = (vec![0.0; coarse * D], vec![0.0; coarse * D]);
        prolongation.restrict::<D>(&apx, &mut expected);
        product.apply(&x, &mut found);
        assert!(own.iter().zip(&apx).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn the_galerkin_product_is_that_of_the_three_matrices() {
        products_agree::<2>();
        products_agree::<3>();
    }
}
