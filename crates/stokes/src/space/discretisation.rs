//! A mesh with its velocity and pressure nodes.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use gluey_fem::{Chunks, Interpolation, NodeMap, ReferenceMatrices, TreeMesh};
use gluey_linalg::vector;

use super::partition::Partition;

/// A mesh with the nodes of the Q2-Q1 pair. Cheap to clone: clones share all of it.
#[derive(Clone, Debug)]
pub struct Discretisation<const D: usize> {
    /// The mesh.
    pub mesh: Arc<TreeMesh<D>>,
    /// Nodes of the velocity, degree 2.
    pub velocity: Arc<NodeMap<D>>,
    /// Nodes of the pressure, degree 1.
    pub pressure: Arc<NodeMap<D>>,
    /// How operators cut the mesh.
    pub chunks: Arc<Chunks<D>>,
    /// This rank's share, where the mesh is a part of a larger one.
    partition: Option<Arc<Partition<D>>>,
}

impl<const D: usize> Discretisation<D> {
    /// Numbers the nodes of `mesh`.
    pub fn new(mesh: TreeMesh<D>) -> Self {
        let nodes = |degree| Arc::new(NodeMap::new(&mesh, degree));
        let (velocity, pressure) = rayon::join(|| nodes(2), || nodes(1));
        let chunks = Arc::new(Chunks::new(&velocity, &pressure));
        Self { mesh: Arc::new(mesh), velocity, pressure, chunks, partition: None }
    }

    /// A part of a larger mesh: operators are sums over the cells of `partition`, sums over all cells those
    /// of all parts.
    pub fn of_part(
        mesh: Arc<TreeMesh<D>>,
        [velocity, pressure]: [Arc<NodeMap<D>>; 2],
        chunks: Arc<Chunks<D>>,
        partition: Partition<D>,
    ) -> Self {
        Self { mesh, velocity, pressure, chunks, partition: Some(Arc::new(partition)) }
    }

    /// The same mesh as one that no ranks share.
    #[must_use]
    pub fn alone(&self) -> Self {
        Self { partition: None, ..self.clone() }
    }

    /// This rank's share; `None` where the mesh is no part.
    pub fn partition(&self) -> Option<&Partition<D>> {
        self.partition.as_deref()
    }

    /// Whether the mesh is a part of a larger one.
    pub fn is_part(&self) -> bool {
        self.partition.is_some()
    }

    /// Whether a cell is added up here: all are, but in a part.
    pub fn is_own(&self, cell: usize) -> bool {
        self.partition().is_none_or(|part| part.part.own().contains(&cell))
    }

    /// The velocity nodes that this rank owns.
    pub fn own_nodes(&self) -> Range<usize> {
        self.partition().map_or(0..self.velocity.node_count(), |part| part.nodes.clone())
    }

    /// The pressure nodes that this rank owns.
    pub fn own_pressure_nodes(&self) -> Range<usize> {
        self.partition().map_or(0..self.pressure.node_count(), |part| part.pressure_nodes.clone())
    }

    /// Pseudo-random numbers at the own pressures, for any number of ranks those of one; zero at others.
    pub fn pseudo_random_pressures(&self) -> Vec<f32> {
        let mut numbers = vec![0.0; self.pressure.node_count()];
        let before = self.partition().map_or(0, |part| part.pressures_before);
        vector::fill_pseudo_random_from(1, before, &mut numbers[self.own_pressure_nodes()]);
        numbers
    }

    /// The same at own velocities and the twists of own bodies of so many, with `width` numbers each.
    pub fn pseudo_random_velocities(&self, bodies: usize, width: usize) -> Vec<f32> {
        let nodal = self.velocity.node_count() * D;
        let mut numbers = vec![0.0; nodal + bodies * width];
        let Some(part) = self.partition() else {
            vector::fill_pseudo_random(1, &mut numbers);
            return numbers;
        };
        let [all, before] = part.node_counts;
        let own = part.nodes.start * D..part.nodes.end * D;
        vector::fill_pseudo_random_from(1, before * D, &mut numbers[own]);
        for body in part.own_bodies() {
            let first = all * D + part.bodies[body] as usize * width;
            vector::fill_pseudo_random_from(1, first, &mut numbers[nodal + body * width..][..width]);
        }
        numbers
    }

    /// The interpolation between nodes of this mesh and of one that is finer by one level: on parts to those
    /// that the rank owns.
    pub fn interpolation(&self, fine: &Self, nodes: fn(&Self) -> &Arc<NodeMap<D>>) -> Interpolation<D> {
        match (self.partition(), fine.partition()) {
            (Some(from), Some(to)) => {
                Interpolation::of_parts(&from.part, nodes(self).clone(), &to.part, nodes(fine))
            }
            _ => Interpolation::new(&self.mesh, nodes(self).clone(), &fine.mesh, nodes(fine)),
        }
    }

    /// Level of the smallest cell at each velocity node.
    pub fn finest_levels(&self) -> Cow<'_, [u8]> {
        if let Some(part) = self.partition() {
            return Cow::Borrowed(&part.finest);
        }
        Cow::Owned(finest_levels(&self.mesh, &self.velocity))
    }

    /// Velocity and pressure unknowns of the mesh, as if there were no bodies and no hanging nodes.
    pub fn dof_count(&self) -> usize {
        self.velocity.node_count() * D + self.pressure.node_count()
    }

    /// The element matrices of its cells, which are sheared like the box.
    pub fn reference(&self) -> ReferenceMatrices<D> {
        ReferenceMatrices::sheared(self.mesh.shear())
    }

    /// Edge length of the smallest cells.
    pub fn finest_cell_size(&self) -> f64 {
        self.mesh.size(self.mesh.max_level())
    }

    /// Edge length of a cell.
    pub fn cell_size(&self, cell: usize) -> f64 {
        self.mesh.size(self.mesh.cells()[cell].level)
    }
}

/// Level of the smallest cell of a mesh at each node.
pub fn finest_levels<const D: usize>(mesh: &TreeMesh<D>, nodes: &NodeMap<D>) -> Vec<u8> {
    let mut finest = vec![0; nodes.node_count()];
    for (index, cell) in mesh.cells().iter().enumerate() {
        for &node in nodes.cell(index) {
            finest[node as usize] = cell.level.max(finest[node as usize]);
        }
    }
    finest
}
