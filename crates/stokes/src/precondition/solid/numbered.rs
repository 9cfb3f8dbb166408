//! Some of the nodes of a mesh, numbered.

use gluey_fem::Evaluator;
use gluey_fem::element::{multi_index, values_1d};

use super::prolongation::Prolongation;
use crate::space::Discretisation;

/// The number of a node that is not among them.
const NONE: u32 = u32::MAX;

/// Nodes of a mesh with numbers of their own.
pub struct Numbered<'a, const D: usize> {
    /// The mesh.
    pub mesh: &'a Discretisation<D>,
    /// Number of each node, or `u32::MAX`.
    pub number: Vec<u32>,
    /// Nodes with a number.
    pub count: usize,
}

impl<'a, const D: usize> Numbered<'a, D> {
    /// Numbers the nodes for which `is_in` holds.
    pub fn new(mesh: &'a Discretisation<D>, is_in: impl Fn(usize) -> bool) -> Self {
        let mut new = Self { mesh, number: vec![NONE; mesh.velocity.node_count()], count: 0 };
        for node in (0..new.number.len()).filter(|&node| is_in(node)) {
            new.number[node] = new.count as u32;
            new.count += 1;
        }
        new
    }

    /// The components of the nodes among those of all nodes, in the order of their numbers.
    pub fn positions(&self) -> Vec<u32> {
        let numbered = (0..).zip(&self.number).filter(|(_, number)| **number != NONE);
        numbered.flat_map(|(node, _): (u32, _)| node * D as u32..(node + 1) * D as u32).collect()
    }

    /// The numbered nodes of each cell whose centre has a number.
    pub fn cells(&self) -> impl Iterator<Item = Vec<u32>> {
        let nodes = &self.mesh.velocity;
        let centre = nodes.nodes_per_cell() / 2;
        let number = |node: &u32| Some(self.number[*node as usize]).filter(|&n| n != NONE);
        (0..nodes.cell_count())
            .map(|cell| nodes.cell(cell))
            .filter(move |cell| number(&cell[centre]).is_some())
            .map(move |cell| cell.iter().filter_map(number).collect())
    }

    /// The nodes of a coarser mesh that lie at numbered ones, and the interpolation from them.
    pub fn coarsened<'b>(&self, mesh: &'b Discretisation<D>) -> (Numbered<'b, D>, Prolongation) {
        let mut found: Vec<(usize, [[f64; 3]; D])> = Vec::with_capacity(self.count);
        let mut is_in = vec![false; mesh.velocity.node_count()];
        let evaluator = Evaluator::new(&mesh.mesh);
        for node in (0..self.number.len()).filter(|&node| self.number[node] != NONE) {
            let Some((cell, x)) = evaluator.locate(&self.mesh.velocity, node) else { continue };
            let place = (0..D).rev().try_fold(0, |place, d| {
                let along = 2.0 * x[d];
                (along == along.round()).then_some(3 * place + along as usize)
            });
            if let Some(place) = place {
                is_in[mesh.velocity.cell(cell)[place] as usize] = true;
            }
            found.push((cell, x.map(|x| values_1d(2, x))));
        }
        let coarse = Numbered::new(mesh, |node| is_in[node]);
        let terms = |(cell, line): &(usize, [[f64; 3]; D])| {
            let weight = |i: usize| (0..D).map(|d| line[d][multi_index::<D>(i, 3)[d]]).product::<f64>();
            let nodes = mesh.velocity.cell(*cell).iter().map(|&n| coarse.number[n as usize]).enumerate();
            let terms = nodes.filter(|term| term.1 != NONE).map(|(i, node)| (node, weight(i)));
            terms.filter(|term| term.1 != 0.0).collect::<Vec<_>>()
        };
        let prolongation = Prolongation::new(coarse.count, found.iter().map(terms));
        (coarse, prolongation)
    }
}
