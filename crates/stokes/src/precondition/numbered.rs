//! Some of the nodes of a mesh, numbered.

use gluey_linalg::Subset;

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
}
