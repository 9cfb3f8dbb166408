//! The viscous matrix on numbered nodes.

use gluey_fem::Constraint;
use gluey_linalg::{BlockGroups, LocalTerm, Pattern, SparseError, SymmetricBlockMatrix};
use rayon::prelude::*;

use super::numbered::NumberedNodes;
use crate::operator::{Elements, MatrixSource};

/// Stands for the constraint of a node that has none.
const NONE: u32 = u32::MAX;
/// Matrices that are made at a time, and at least how many by one thread.
const BATCH: usize = 64;
const LEAST_SHARE: usize = 8;

/// The sum of the matrices of cells on the numbered nodes.
pub fn assemble_on_nodes<const D: usize>(
    nodes: &NumberedNodes<'_, D>,
    elements: &Elements<'_, D>,
) -> Result<SymmetricBlockMatrix<D>, SparseError> {
    let (forms, mut terms) = (NodeForms::new(nodes, elements.system().space.ghosts()), Vec::new());
    let (mut sources, mut groups) = (Vec::new(), BlockGroups::default());
    for source in elements.viscous_sources() {
        forms.of_cell(source.cell(), &mut terms);
        if !terms.is_empty() {
            groups.push(terms.iter().map(|term| term.row as usize));
            sources.push(source);
        }
    }
    let groups: Vec<&[usize]> = groups.iter().collect();
    let mut matrix = SymmetricBlockMatrix::zeros(&Pattern::from_groups(nodes.nodes.len(), &groups)?);
    for_each_matrix(elements, &sources, |source, dense| {
        forms.of_cell(source.cell(), &mut terms);
        matrix.add_local(&terms, dense);
    });
    Ok(matrix)
}

/// Makes the matrices of these cells and pieces, some at a time side by side, and hands them on in their
/// order.
pub fn for_each_matrix<const D: usize>(
    elements: &Elements<'_, D>,
    sources: &[MatrixSource],
    mut visit: impl FnMut(MatrixSource, &[f64]),
) {
    let len = elements.size().pow(2);
    let mut dense = vec![0.0; BATCH.min(sources.len()) * len];
    for batch in sources.chunks(BATCH) {
        let pairs = batch.par_iter().zip(dense.par_chunks_exact_mut(len));
        pairs.with_min_len(LEAST_SHARE).for_each_init(
            || elements.of_pieces(),
            |pieces, (&source, dense)| {
                elements.fill_velocities(source, pieces, dense);
            },
        );
        batch.iter().zip(dense.chunks_exact(len)).for_each(|(&source, dense)| visit(source, dense));
    }
}

/// The numbered nodes that nodes stand for: themselves, or the masters they hang on.
pub struct NodeForms<'a, const D: usize> {
    nodes: &'a NumberedNodes<'a, D>,
    /// Hanging nodes and ghosts.
    constraints: Vec<&'a Constraint>,
    /// Index of the constraint of each node, or [`NONE`].
    constraint: Vec<u32>,
}

impl<'a, const D: usize> NodeForms<'a, D> {
    /// For a mesh with these ghosts.
    pub fn new(nodes: &'a NumberedNodes<'a, D>, ghosts: &'a [Constraint]) -> Self {
        let constraints: Vec<&Constraint> = nodes.mesh.velocity.constraints().iter().chain(ghosts).collect();
        let mut constraint = vec![NONE; nodes.nodes.whole()];
        for (k, of) in constraints.iter().enumerate() {
            constraint[of.node as usize] = k as u32;
        }
        Self { nodes, constraints, constraint }
    }

    /// The terms of a cell, sorted by their rows.
    pub fn of_cell(&self, cell: usize, terms: &mut Vec<LocalTerm>) {
        terms.clear();
        let nodes = &self.nodes.mesh.velocity;
        for (local, &node) in (0..).zip(nodes.cell(cell)) {
            let mut push = |node: u32, weight: f64| {
                let row = self.nodes.nodes.number(node as usize);
                terms.extend(row.map(|row| LocalTerm { row: row as u32, local, weight }));
            };
            match self.constraints.get(self.constraint[node as usize] as usize) {
                None => push(node, 1.0),
                Some(of) => of.masters.iter().for_each(|&(master, weight)| push(master, weight)),
            }
        }
        terms.sort_unstable_by_key(|term| (term.row, term.local));
    }
}
