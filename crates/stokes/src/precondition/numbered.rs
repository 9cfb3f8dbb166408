//! Some of the nodes of a mesh, numbered.

use gluey_fem::Evaluator;
use gluey_fem::element::{multi_index, values_1d};
use gluey_linalg::{Prolongation, Subset};

use crate::space::Discretisation;

/// Nodes of a mesh with numbers of their own.
pub struct NumberedNodes<'a, const D: usize> {
    /// The mesh.
    pub mesh: &'a Discretisation<D>,
    /// The numbered nodes among all velocity nodes.
    pub nodes: Subset,
}

impl<'a, const D: usize> NumberedNodes<'a, D> {
    /// Numbers the nodes for which `is_in` holds.
    pub fn new(mesh: &'a Discretisation<D>, is_in: impl Fn(usize) -> bool) -> Self {
        Self { mesh, nodes: Subset::new(mesh.velocity.node_count(), is_in) }
    }

    /// The components of the nodes among those of all nodes, in the order of their numbers.
    pub fn positions(&self) -> Vec<u32> {
        let nodes = self.nodes.positions().iter();
        nodes.flat_map(|&node| node * D as u32..(node + 1) * D as u32).collect()
    }

    /// The numbered nodes of each cell whose centre has a number.
    pub fn cells(&self) -> impl Iterator<Item = Vec<u32>> {
        let nodes = &self.mesh.velocity;
        let centre = nodes.nodes_per_cell() / 2;
        let number = |node: &u32| self.nodes.number(*node as usize).map(|number| number as u32);
        (0..nodes.cell_count())
            .map(|cell| nodes.cell(cell))
            .filter(move |cell| self.nodes.contains(cell[centre] as usize))
            .map(move |cell| cell.iter().filter_map(number).collect())
    }

    /// The nodes of a coarser mesh that lie at numbered ones, and the interpolation from them.
    pub fn coarsened<'b>(&self, mesh: &'b Discretisation<D>) -> (NumberedNodes<'b, D>, Prolongation) {
        let mut found: Vec<(usize, [[f64; 3]; D])> = Vec::with_capacity(self.nodes.len());
        let mut is_in = vec![false; mesh.velocity.node_count()];
        let evaluator = Evaluator::new(&mesh.mesh);
        for &node in self.nodes.positions() {
            let Some((cell, x)) = evaluator.locate(&self.mesh.velocity.point(node as usize)) else {
                continue;
            };
            let place = (0..D).rev().try_fold(0, |place, d| {
                let along = 2.0 * x[d];
                (along == along.round()).then_some(3 * place + along as usize)
            });
            if let Some(place) = place {
                is_in[mesh.velocity.cell(cell)[place] as usize] = true;
            }
            found.push((cell, x.map(|x| values_1d(2, x))));
        }
        let coarse = NumberedNodes::new(mesh, |node| is_in[node]);
        let terms = |(cell, line): &(usize, [[f64; 3]; D])| {
            let weight = |i: usize| (0..D).map(|d| line[d][multi_index::<D>(i, 3)[d]]).product::<f64>();
            let numbers = mesh.velocity.cell(*cell).iter().map(|&n| coarse.nodes.number(n as usize));
            let terms = numbers.enumerate().filter_map(|(i, number)| Some((number? as u32, weight(i))));
            terms.filter(|term| term.1 != 0.0).collect::<Vec<_>>()
        };
        let prolongation = Prolongation::new(coarse.nodes.len(), found.iter().map(terms));
        (coarse, prolongation)
    }
}
