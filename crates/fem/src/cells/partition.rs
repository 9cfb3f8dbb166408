//! Contiguous runs of cells that own contiguous runs of nodes.
//!
//! Cells in Morton order are cut into chunks of [`CHUNK_CELLS`]. Nodes are numbered as the cells touch them
//! first, so a chunk *owns* a range of nodes; those of other chunks that its cells also touch are its
//! *ghosts*. A chunk works in a buffer of its own, first the owned nodes, then the ghosts: the position of a
//! node there is its *local index*. Contributions to ghosts are added by the owners, in the order of the
//! chunks. So the partition, and with it every bit of a sum, depends on the mesh alone and not on the number
//! of threads.

use std::ops::Range;

use gluey_linalg::Jagged;

use crate::space::NodeMap;

/// Cells of a chunk: their nodes stay in the cache next to a core.
pub const CHUNK_CELLS: usize = 512;

/// The nodes of one space: those that each chunk owns, and its ghosts.
#[derive(Clone, Debug, Default)]
pub(crate) struct NodePartition {
    /// First node of each chunk, and the number of nodes.
    first: Vec<u32>,
    /// Nodes of other chunks that a chunk touches, in ascending order.
    pub(crate) ghosts: Jagged<u32>,
    /// Positions in the list of all ghosts of those that a chunk owns, in ascending order.
    pub(crate) owned_ghosts: Jagged<u32>,
}

impl NodePartition {
    /// `touched(chunk, nodes)` appends the nodes that a chunk touches.
    fn new(first: Vec<u32>, touched: impl Fn(usize, &mut Vec<u32>)) -> Self {
        let mut partition = Self { first, ..Self::default() };
        let mut nodes = Vec::new();
        for chunk in 0..partition.first.len() - 1 {
            touched(chunk, &mut nodes);
            let own = partition.owned(chunk);
            nodes.retain(|&n| !own.contains(&(n as usize)));
            nodes.sort_unstable();
            nodes.dedup();
            partition.ghosts.push(nodes.drain(..));
        }
        partition.find_owned_ghosts();
        partition
    }

    fn find_owned_ghosts(&mut self) {
        let owner = |node: u32| self.first.partition_point(|&f| f <= node) - 1;
        let owned = self.ghosts.items().iter().zip(0u32..).map(|(&node, position)| (owner(node), position));
        self.owned_ghosts = Jagged::grouped(self.first.len() - 1, owned);
    }

    /// Nodes that a chunk owns.
    pub(crate) fn owned(&self, chunk: usize) -> Range<usize> {
        self.first[chunk] as usize..self.first[chunk + 1] as usize
    }

    /// First node that a chunk owns; for the number of chunks, the number of nodes.
    pub(crate) fn first_of(&self, chunk: usize) -> usize {
        self.first[chunk] as usize
    }

    /// All nodes of a chunk in the order of their local indices.
    pub(crate) fn local_nodes(&self, chunk: usize) -> impl Iterator<Item = u32> {
        self.owned(chunk).map(|node| node as u32).chain(self.ghosts[chunk].iter().copied())
    }

    /// Nodes of the space.
    pub(crate) fn node_count(&self) -> usize {
        self.first.last().map_or(0, |&n| n as usize)
    }
}

/// A hanging node in the buffer of a chunk, and where its masters end in the list of all masters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hanging {
    pub(crate) local: u16,
    pub(crate) masters_end: u32,
}

/// The chunks of a mesh with the nodes of the Q2-Q1 pair.
#[derive(Clone, Debug, Default)]
pub struct Chunks<const D: usize> {
    cell_count: usize,
    pub(crate) velocity: NodePartition,
    pub(crate) pressure: NodePartition,
    /// Local index of each pressure node in the chunk that owns it: that of the velocity node at the same
    /// place.
    pub(crate) pressure_locals: Vec<u16>,
    /// Local indices of the pressure ghosts.
    pub(crate) ghost_pressure_locals: Vec<u16>,
    /// Hanging velocity nodes of the cells of a chunk.
    pub(crate) hanging: Jagged<Hanging>,
    pub(crate) masters: Vec<u16>,
    pub(crate) weights: Vec<f64>,
    /// Local indices of the nodes on the boundary.
    pub(crate) boundary: Jagged<u16>,
}

impl<const D: usize> Chunks<D> {
    /// Cuts a mesh with these nodes, of degrees 2 and 1, into chunks.
    pub fn new(velocity: &NodeMap<D>, pressure: &NodeMap<D>) -> Self {
        let cell_count = velocity.cell_count();
        let mut constraint_of = vec![u32::MAX; velocity.node_count()];
        for (k, constraint) in velocity.constraints().iter().enumerate() {
            constraint_of[constraint.node as usize] = k as u32;
        }
        let constraint = |node: u32| velocity.constraints().get(constraint_of[node as usize] as usize);
        let mut chunks = Self {
            cell_count,
            velocity: NodePartition::new(first_nodes(velocity), |chunk, touched| {
                for &node in velocity.cells(cells_of(chunk, cell_count)) {
                    touched.push(node);
                    touched.extend(constraint(node).iter().flat_map(|c| c.masters.iter().map(|m| m.0)));
                }
            }),
            pressure: NodePartition::new(first_nodes(pressure), |chunk, touched| {
                touched.extend_from_slice(pressure.cells(cells_of(chunk, cell_count)));
            }),
            pressure_locals: vec![0; pressure.node_count()],
            ..Self::default()
        };
        let mut locals = LocalIndices::new(velocity.node_count());
        for chunk in 0..chunks.count() {
            locals.set(&chunks.velocity, chunk);
            chunks.place_pressures(velocity, pressure, chunk, &locals);
            let nodes = chunks.velocity.local_nodes(chunk);
            let boundary = nodes.filter(|&n| velocity.is_on_boundary(n as usize)).map(|n| locals.of(n));
            chunks.boundary.push(boundary.collect::<Vec<u16>>());
            let nodes = velocity.cells(cells_of(chunk, cell_count)).iter();
            let hanging = nodes.map(|&n| constraint_of[n as usize]).filter(|&k| k != u32::MAX);
            chunks.place_hanging(velocity, hanging.collect(), &locals);
        }
        chunks
    }

    /// Number of chunks.
    pub fn count(&self) -> usize {
        self.velocity.first.len() - 1
    }

    /// Cells of a chunk.
    pub(crate) fn cells(&self, chunk: usize) -> Range<usize> {
        cells_of(chunk, self.cell_count)
    }

    fn place_pressures(
        &mut self,
        velocity: &NodeMap<D>,
        pressure: &NodeMap<D>,
        chunk: usize,
        locals: &LocalIndices,
    ) {
        let own = self.pressure.owned(chunk);
        let ghosts = &self.pressure.ghosts[chunk];
        let mut ghost_locals = vec![0; ghosts.len()];
        for cell in self.cells(chunk) {
            for (corner, &q) in pressure.cell(cell).iter().enumerate() {
                let local = locals.of(velocity.cell(cell)[corner_node::<D>(corner)]);
                if own.contains(&(q as usize)) {
                    self.pressure_locals[q as usize] = local;
                } else if let Ok(k) = ghosts.binary_search(&q) {
                    ghost_locals[k] = local;
                }
            }
        }
        self.ghost_pressure_locals.extend(ghost_locals);
    }

    /// Places hanging nodes, given by the numbers of their constraints.
    fn place_hanging(&mut self, velocity: &NodeMap<D>, mut constraints: Vec<u32>, locals: &LocalIndices) {
        constraints.sort_unstable();
        constraints.dedup();
        let mut hanging = Vec::with_capacity(constraints.len());
        for k in constraints {
            let constraint = &velocity.constraints()[k as usize];
            self.masters.extend(constraint.masters.iter().map(|m| locals.of(m.0)));
            self.weights.extend(constraint.masters.iter().map(|m| m.1));
            hanging
                .push(Hanging { local: locals.of(constraint.node), masters_end: self.masters.len() as u32 });
        }
        self.hanging.push(hanging);
    }

    /// Calls `visit(local, masters, weights)` for the hanging nodes of a chunk.
    #[inline(always)]
    pub(crate) fn for_each_hanging(&self, chunk: usize, mut visit: impl FnMut(u16, &[u16], &[f64])) {
        let range = self.hanging.range(chunk);
        let mut start = match range.start {
            0 => 0,
            k => self.hanging.items()[k - 1].masters_end as usize,
        };
        for hanging in &self.hanging[chunk] {
            let end = hanging.masters_end as usize;
            visit(hanging.local, &self.masters[start..end], &self.weights[start..end]);
            start = end;
        }
    }

    /// Nodes in the buffer of a chunk.
    pub(crate) fn local_count(&self, chunk: usize) -> usize {
        self.velocity.owned(chunk).len() + self.velocity.ghosts.range(chunk).len()
    }
}

/// The velocity node of a cell at a corner.
pub(crate) const fn corner_node<const D: usize>(corner: usize) -> usize {
    let (mut node, mut stride, mut d) = (0, 2, 0);
    while d < D {
        node += (corner >> d & 1) * stride;
        stride *= 3;
        d += 1;
    }
    node
}

fn cells_of(chunk: usize, cell_count: usize) -> Range<usize> {
    chunk * CHUNK_CELLS..((chunk + 1) * CHUNK_CELLS).min(cell_count)
}

fn first_nodes<const D: usize>(nodes: &NodeMap<D>) -> Vec<u32> {
    let mut first = vec![0];
    let mut next = 0;
    for chunk in 0..nodes.cell_count().div_ceil(CHUNK_CELLS) {
        let touched = nodes.cells(cells_of(chunk, nodes.cell_count()));
        next = touched.iter().fold(next, |next, &n| next.max(n + 1));
        first.push(next);
    }
    first
}

/// Local indices of the nodes of one chunk at a time.
pub(crate) struct LocalIndices {
    of: Vec<u16>,
}

impl LocalIndices {
    pub(crate) fn new(node_count: usize) -> Self {
        Self { of: vec![0; node_count] }
    }

    pub(crate) fn set(&mut self, partition: &NodePartition, chunk: usize) {
        let count = partition.owned(chunk).len() + partition.ghosts[chunk].len();
        assert!(count < usize::from(u16::MAX), "a chunk touches at most {CHUNK_CELLS} cells' nodes");
        for (local, node) in partition.local_nodes(chunk).enumerate() {
            self.of[node as usize] = local as u16;
        }
    }

    pub(crate) fn of(&self, node: u32) -> u16 {
        self.of[node as usize]
    }
}
