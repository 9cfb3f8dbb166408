//! A mesh with its velocity and pressure nodes, and how its cells meet the bodies.

use std::sync::Arc;

use gluey_fem::{Chunks, NodeMap, TreeMesh};

use gluey_levelset::{Ball, BallTree};

use crate::space::SolidNodes;

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
}

impl<const D: usize> Discretisation<D> {
    /// Numbers the nodes of `mesh`.
    pub fn new(mesh: TreeMesh<D>) -> Self {
        let nodes = |degree| Arc::new(NodeMap::new(&mesh, degree));
        let (velocity, pressure) = (nodes(2), nodes(1));
        let chunks = Arc::new(Chunks::new(&velocity, &pressure));
        Self { mesh: Arc::new(mesh), velocity, pressure, chunks }
    }

    /// Velocity and pressure unknowns of the mesh, as if there were no bodies and no hanging nodes.
    pub fn dof_count(&self) -> usize {
        self.velocity.node_count() * D + self.pressure.node_count()
    }

    /// Edge length of a cell.
    pub fn cell_size(&self, cell: usize) -> f64 {
        self.mesh.size(self.mesh.cells()[cell].level)
    }
}

/// The nodes with `alpha >= offset h`, each with the body whose level set is largest there; `h` is the size of the
/// smallest cell at the node. A negative offset takes nodes slightly outside the surface.
pub fn solid_nodes<const D: usize>(
    mesh: &TreeMesh<D>,
    nodes: &NodeMap<D>,
    bodies: &[Ball<D>],
    offset: f64,
) -> SolidNodes {
    let mut finest = vec![0; nodes.node_count()];
    for (index, cell) in mesh.cells().iter().enumerate() {
        for &node in nodes.cell(index) {
            finest[node as usize] = cell.level.max(finest[node as usize]);
        }
    }
    let bodies = BallTree::new(bodies);
    let at = |node: usize| {
        let threshold = offset * mesh.size(finest[node]);
        bodies.nearest_within(&nodes.point(node), -threshold).map(|b| b.0 as u32)
    };
    (0..nodes.node_count()).map(at).collect()
}

/// How the cells of a mesh are made of free and rigid nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellKind {
    /// Every node belongs to one body: no strain, no flow.
    Rigid,
    /// Every node belongs to a body, but not to the same one: it is strained, but nothing flows.
    Bridge,
    /// Some nodes are free.
    Fluid,
}

/// Kind of a cell from the bodies its nodes belong to.
pub fn cell_kind(bodies: impl Iterator<Item = Option<u32>>) -> CellKind {
    let mut first = None;
    let mut kind = CellKind::Rigid;
    for body in bodies {
        match (body, first) {
            (None, _) => return CellKind::Fluid,
            (Some(b), None) => first = Some(b),
            (Some(b), Some(f)) if b != f => kind = CellKind::Bridge,
            _ => {}
        }
    }
    kind
}
