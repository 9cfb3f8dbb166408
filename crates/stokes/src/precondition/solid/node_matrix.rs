//! Symmetric sparse matrices in blocks, one for each pair of nodes, and their Galerkin products.

use gluey_geom::{Dim, Space};
use gluey_linalg::{BlockGroups, BlockPattern, LinOp, Pattern, SparseMatrix};

use super::numbered::Numbered;
use super::prolongation::Prolongation;
use crate::error::StokesError;
use crate::operator::Elements;

/// Rows of a matrix on the `D` components of two nodes.
type Block<const D: usize> = [[f64; D]; D];

/// Rows of blocks.
struct Rows<const D: usize> {
    /// First block of each row, then their number.
    start: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<Block<D>>,
}

/// A symmetric matrix on the `D` velocity components of numbered nodes.
pub struct NodeMatrix<const D: usize> {
    /// The lower triangle.
    lower: Rows<D>,
}

impl<const D: usize> NodeMatrix<D>
where
    Dim<D>: Space<D>,
{
    /// The sum of the matrices of cells on the numbered nodes.
    pub fn assembled(nodes: &Numbered<'_, D>, elements: &Elements<'_, D>) -> Result<Self, StokesError> {
        let (forms, mut terms) = (NodeForms::new(nodes), Vec::new());
        let (mut cells, mut groups) = (Vec::new(), BlockGroups::default());
        for (index, cell) in elements.cells().iter().enumerate() {
            forms.of_cell(cell.cell as usize, &mut terms);
            if !terms.is_empty() {
                groups.push(terms.iter().map(|term| term.number as usize));
                cells.push(index);
            }
        }
        let groups: Vec<&[usize]> = groups.iter().collect();
        let mut new = Self::zeros(&Pattern::from_groups(nodes.count, &groups)?);
        let mut element = vec![0.0; elements.size().pow(2)];
        for index in cells {
            forms.of_cell(elements.cells()[index].cell as usize, &mut terms);
            elements.fill(index, &mut element);
            new.add(&terms, &element, elements.size());
        }
        Ok(new)
    }

    fn zeros(pattern: &Pattern) -> Self {
        let mut lower = Rows { start: vec![0], columns: Vec::new(), blocks: Vec::new() };
        lower.columns.reserve_exact((pattern.entry_count() + pattern.row_count()) / 2);
        for row in 0..pattern.row_count() {
            let columns = pattern.columns_of(row).iter();
            lower.columns.extend(columns.take_while(|&&column| column as usize <= row));
            lower.start.push(lower.columns.len() as u32);
        }
        lower.blocks.resize(lower.columns.len(), [[0.0; D]; D]);
        Self { lower }
    }

    /// Adds the matrix of a cell; the terms are sorted by their numbers.
    fn add(&mut self, terms: &[Term], element: &[f64], size: usize) {
        let Rows { start, columns, blocks } = &mut self.lower;
        for row in terms {
            let mut place = start[row.number as usize] as usize;
            let rows = &element[row.local as usize * D * size..][..D * size];
            for column in terms.iter().take_while(|column| column.number <= row.number) {
                while columns[place] < column.number {
                    place += 1;
                }
                let weight = row.weight * column.weight;
                for (block, row) in blocks[place].iter_mut().zip(rows.chunks_exact(size)) {
                    let values = &row[column.local as usize * D..][..D];
                    block.iter_mut().zip(values).for_each(|(entry, value)| *entry += weight * value);
                }
            }
        }
    }
}

/// A numbered node that a node of a cell stands for.
struct Term {
    number: u32,
    local: u32,
    weight: f64,
}

/// The numbered nodes that nodes stand for: themselves, or the masters they hang on.
struct NodeForms<'a, const D: usize> {
    nodes: &'a Numbered<'a, D>,
    /// Index of the constraint of each node, or `u32::MAX`.
    constraint: Vec<u32>,
}

impl<'a, const D: usize> NodeForms<'a, D> {
    fn new(nodes: &'a Numbered<'a, D>) -> Self {
        let mut constraint = vec![u32::MAX; nodes.number.len()];
        for (k, hanging) in nodes.mesh.velocity.constraints().iter().enumerate() {
            constraint[hanging.node as usize] = k as u32;
        }
        Self { nodes, constraint }
    }

    /// The terms of a cell, sorted by their numbers.
    fn of_cell(&self, cell: usize, terms: &mut Vec<Term>) {
        terms.clear();
        let nodes = &self.nodes.mesh.velocity;
        for (local, &node) in (0..).zip(nodes.cell(cell)) {
            let mut push = |node: u32, weight: f64| match self.nodes.number[node as usize] {
                u32::MAX => {}
                number => terms.push(Term { number, local, weight }),
            };
            match nodes.constraints().get(self.constraint[node as usize] as usize) {
                None => push(node, 1.0),
                Some(hanging) => hanging.masters.iter().for_each(|&(master, weight)| push(master, weight)),
            }
        }
        terms.sort_unstable_by_key(|term| (term.number, term.local));
    }
}

impl<const D: usize> NodeMatrix<D> {
    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.lower.count()
    }

    /// The blocks in a row up to the diagonal, `(column, block)`, columns ascending.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (u32, &Block<D>)> {
        self.lower.row(row)
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.node_count() * D];
        for (node, diagonal) in diagonal.chunks_exact_mut(D).enumerate() {
            if let Some((_, block)) = self.row(node).find(|(column, _)| *column as usize == node) {
                let entries = block.as_flattened().iter().step_by(D + 1);
                diagonal.iter_mut().zip(entries).for_each(|(d, &value)| *d = value);
            }
        }
        diagonal
    }

    /// The matrix in single unknowns, and a good order to eliminate them in.
    pub fn to_sparse(&self) -> Result<(SparseMatrix, Vec<usize>), StokesError> {
        let mut pairs = BlockGroups::default();
        for row in 0..self.node_count() {
            self.row(row).for_each(|(column, _)| pairs.push([row, column as usize]));
        }
        let first = (0..=self.node_count() * D).step_by(D).map(|k| k as u32).collect();
        let pattern = BlockPattern::new(first, pairs)?;
        let mut blocks = self.lower.blocks.iter();
        let matrix = pattern.sum(|pair, target| {
            let Some(block) = blocks.next() else { return };
            let (size, shift) = (pair.len() * D, (pair.len() - 1) * D);
            for a in 0..D {
                for b in 0..D {
                    target[a * size + shift + b] = block[a][b];
                    target[(shift + b) * size + a] = block[a][b];
                }
            }
        });
        Ok((matrix, pattern.minimum_degree()?))
    }

    /// `P^T A P`, which is `M + M^T` for `M = P^T (L + D/2) P` with the blocks `L` below and `D` on the
    /// diagonal of `A`.
    pub fn galerkin(&self, prolongation: &Prolongation) -> Self {
        let product = sum_of_rows(self.node_count(), prolongation.coarse_count(), |row, sum: &mut Sum<D>| {
            for (column, block) in self.row(row) {
                let share = if column as usize == row { 0.5 } else { 1.0 };
                for &(coarse, weight) in prolongation.of(column as usize) {
                    sum.add(coarse, share * weight, block);
                }
            }
        });
        let transposed = prolongation.transposed();
        let half = sum_of_rows(prolongation.coarse_count(), prolongation.coarse_count(), |row, sum| {
            for &(fine, weight) in transposed.of(row) {
                product.row(fine as usize).for_each(|(column, block)| sum.add(column, weight, block));
            }
        });
        Self { lower: half.plus_transposed() }
    }

    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        let (x, y) = (x.as_chunks::<D>().0, y.as_chunks_mut::<D>().0);
        for row in 0..self.node_count() {
            for (column, block) in self.row(row) {
                let column = column as usize;
                for a in 0..D {
                    for b in 0..D {
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

impl<const D: usize> Rows<D> {
    fn count(&self) -> usize {
        self.start.len() - 1
    }

    fn row(&self, row: usize) -> impl Iterator<Item = (u32, &Block<D>)> {
        let range = self.start[row] as usize..self.start[row + 1] as usize;
        self.columns[range.clone()].iter().copied().zip(&self.blocks[range])
    }

    /// The lower triangle of the sum of this square matrix and its transpose.
    fn plus_transposed(&self) -> Self {
        let mut upper = vec![Vec::new(); self.count()];
        for row in 0..self.count() {
            for (column, block) in self.row(row).filter(|(column, _)| *column as usize >= row) {
                upper[column as usize].push((row as u32, block));
            }
        }
        sum_of_rows(self.count(), self.count(), |row, sum: &mut Sum<D>| {
            let lower = self.row(row).take_while(|(column, _)| *column as usize <= row);
            lower.for_each(|(column, block)| sum.add(column, 1.0, block));
            for &(column, block) in &upper[row] {
                sum.add(column, 1.0, &std::array::from_fn(|a| std::array::from_fn(|b| block[b][a])));
            }
        })
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
    blocks: Vec<Block<D>>,
}

impl<const D: usize> Sum<D> {
    fn add(&mut self, column: u32, weight: f64, block: &Block<D>) {
        let place = &mut self.place[column as usize];
        if *place == u32::MAX {
            *place = self.columns.len() as u32;
            self.columns.push(column);
            self.blocks.push([[0.0; D]; D]);
        }
        let sum = self.blocks[*place as usize].as_flattened_mut();
        sum.iter_mut().zip(block.as_flattened()).for_each(|(sum, value)| *sum += weight * value);
    }
}

/// The matrix whose rows `fill` sums up.
fn sum_of_rows<const D: usize>(
    row_count: usize,
    column_count: usize,
    mut fill: impl FnMut(usize, &mut Sum<D>),
) -> Rows<D> {
    let mut new = Rows { start: vec![0], columns: Vec::new(), blocks: Vec::new() };
    let mut sum = Sum { place: vec![u32::MAX; column_count], columns: Vec::new(), blocks: Vec::new() };
    for row in 0..row_count {
        fill(row, &mut sum);
        sum.columns.sort_unstable();
        for column in sum.columns.drain(..) {
            let place = std::mem::replace(&mut sum.place[column as usize], u32::MAX) as usize;
            new.columns.push(column);
            new.blocks.push(sum.blocks[place]);
        }
        sum.blocks.clear();
        new.start.push(new.columns.len() as u32);
    }
    new
}

#[cfg(test)]
impl<const D: usize> NodeMatrix<D> {
    /// The blocks of a matrix whose unknowns are the components of node after node.
    pub fn from_sparse(matrix: &SparseMatrix) -> Self {
        let pattern = matrix.pattern();
        let mut lower = Rows { start: vec![0], columns: Vec::new(), blocks: Vec::new() };
        for row in 0..pattern.row_count() / D {
            let columns = pattern.columns_of(row * D).iter().step_by(D).map(|column| column / D as u32);
            for column in columns.take_while(|&column| column as usize <= row) {
                let entry = |a: usize, b: usize| matrix.get(row * D + a, column as usize * D + b);
                lower.blocks.push(std::array::from_fn(|a| std::array::from_fn(|b| entry(a, b))));
                lower.columns.push(column);
            }
            lower.start.push(lower.columns.len() as u32);
        }
        Self { lower }
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
