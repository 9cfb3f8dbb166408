//! The viscous matrix of the penalised operator on numbered nodes.

use gluey_geom::{Dim, Space};
use gluey_linalg::{BlockGroups, LocalTerm, Pattern, SparseError, SymmetricBlockMatrix};

use super::numbered::NumberedNodes;
use crate::operator::Elements;

/// Stands for the constraint of a node that has none.
const NONE: u32 = u32::MAX;

/// The sum of the matrices of cells on the numbered nodes.
pub fn assemble_on_nodes<const D: usize>(
    nodes: &NumberedNodes<'_, D>,
    elements: &Elements<'_, D>,
) -> Result<SymmetricBlockMatrix<D>, SparseError>
where
    Dim<D>: Space<D>,
{
    let (forms, mut terms) = (NodeForms::new(nodes), Vec::new());
    let (mut cells, mut groups) = (Vec::new(), BlockGroups::default());
    for (index, cell) in elements.cells().iter().enumerate() {
        forms.of_cell(cell.cell as usize, &mut terms);
        if !terms.is_empty() {
            groups.push(terms.iter().map(|term| term.row as usize));
            cells.push(index);
        }
    }
    let groups: Vec<&[usize]> = groups.iter().collect();
    let mut matrix = SymmetricBlockMatrix::zeros(&Pattern::from_groups(nodes.nodes.len(), &groups)?);
    let mut element = vec![0.0; elements.size().pow(2)];
    for index in cells {
        forms.of_cell(elements.cells()[index].cell as usize, &mut terms);
        elements.fill(index, &mut element);
        matrix.add_local(&terms, &element);
    }
    Ok(matrix)
}

/// The numbered nodes that nodes stand for: themselves, or the masters they hang on.
struct NodeForms<'a, const D: usize> {
    nodes: &'a NumberedNodes<'a, D>,
    /// Index of the constraint of each node, or [`NONE`].
    constraint: Vec<u32>,
}

impl<'a, const D: usize> NodeForms<'a, D> {
    fn new(nodes: &'a NumberedNodes<'a, D>) -> Self {
        let mut constraint = vec![NONE; nodes.nodes.whole()];
        for (k, hanging) in nodes.mesh.velocity.constraints().iter().enumerate() {
            constraint[hanging.node as usize] = k as u32;
        }
        Self { nodes, constraint }
    }

    /// The terms of a cell, sorted by their rows.
    fn of_cell(&self, cell: usize, terms: &mut Vec<LocalTerm>) {
        terms.clear();
        let nodes = &self.nodes.mesh.velocity;
        for (local, &node) in (0..).zip(nodes.cell(cell)) {
            let mut push = |node: u32, weight: f64| {
                let row = self.nodes.nodes.number(node as usize);
                terms.extend(row.map(|row| LocalTerm { row: row as u32, local, weight }));
            };
            match nodes.constraints().get(self.constraint[node as usize] as usize) {
                None => push(node, 1.0),
                Some(hanging) => hanging.masters.iter().for_each(|&(master, weight)| push(master, weight)),
            }
        }
        terms.sort_unstable_by_key(|term| (term.row, term.local));
    }
}
