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
use rayon::prelude::*;

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
    fn new(first: Vec<u32>, touched: impl Fn(usize, &mut Vec<u32>) + Sync) -> Self {
        let mut partition = Self { first, ..Self::default() };
        let ghosts_of = |chunk: usize| {
            let own = partition.owned(chunk);
            let mut nodes = Vec::new();
            touched(chunk, &mut nodes);
            nodes.retain(|&n| !own.contains(&(n as usize)));
            nodes.sort_unstable();
            nodes.dedup();
            nodes
        };
        let count = partition.first.len() - 1;
        let ghosts: Vec<Vec<u32>> = (0..count).into_par_iter().map(ghosts_of).collect();
        partition.ghosts = ghosts.into_iter().collect();
        partition.find_owned_ghosts();
        partition
    }

    fn find_owned_ghosts(&mut self) {
        let owner = |&node: &u32| self.first.partition_point(|&f| f <= node) - 1;
        let owners: Vec<usize> = self.ghosts.items().par_iter().map(owner).collect();
        self.owned_ghosts = Jagged::grouped(self.first.len() - 1, owners.into_iter().zip(0u32..));
    }

    /// Local index of a node that a chunk touches.
    fn local(&self, chunk: usize, node: u32) -> u16 {
        let own = self.owned(chunk);
        let ghost = || self.ghosts[chunk].binary_search(&node).expect("the chunk touches the node");
        let local =
            if own.contains(&(node as usize)) { node as usize - own.start } else { own.len() + ghost() };
        u16::try_from(local).expect("a chunk touches few nodes")
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
            ..Self::default()
        };
        let constraint_of = |node: &u32| Some(constraint_of[*node as usize]).filter(|&k| k != u32::MAX);
        let piece = |chunk: usize| {
            let mut piece = ChunkEntries::default();
            piece.place_pressures(&chunks, velocity, pressure, chunk);
            let local = |node: u32| chunks.velocity.local(chunk, node);
            let nodes = chunks.velocity.local_nodes(chunk);
            piece.boundary = nodes.filter(|&n| velocity.is_on_boundary(n as usize)).map(local).collect();
            let nodes = velocity.cells(cells_of(chunk, cell_count)).iter();
            piece.place_hanging(velocity, nodes.filter_map(constraint_of).collect(), local);
            piece
        };
        let pieces: Vec<ChunkEntries> = (0..chunks.count()).into_par_iter().map(piece).collect();
        pieces.into_iter().for_each(|piece| chunks.push(piece));
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

    /// Appends what belongs to the next chunk.
    fn push(&mut self, mut piece: ChunkEntries) {
        self.pressure_locals.append(&mut piece.pressure_locals);
        self.ghost_pressure_locals.append(&mut piece.ghost_pressure_locals);
        self.boundary.push(piece.boundary);
        let before = self.masters.len() as u32;
        let hanging = piece.hanging.into_iter();
        self.hanging.push(hanging.map(|h| Hanging { masters_end: h.masters_end + before, ..h }));
        self.masters.append(&mut piece.masters);
        self.weights.append(&mut piece.weights);
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

/// Entries of [`Chunks`] for one chunk, whose masters are counted from its first.
#[derive(Default)]
struct ChunkEntries {
    pressure_locals: Vec<u16>,
    ghost_pressure_locals: Vec<u16>,
    hanging: Vec<Hanging>,
    masters: Vec<u16>,
    weights: Vec<f64>,
    boundary: Vec<u16>,
}

impl ChunkEntries {
    fn place_pressures<const D: usize>(
        &mut self,
        chunks: &Chunks<D>,
        velocity: &NodeMap<D>,
        pressure: &NodeMap<D>,
        chunk: usize,
    ) {
        let own = chunks.pressure.owned(chunk);
        let ghosts = &chunks.pressure.ghosts[chunk];
        self.pressure_locals = vec![0; own.len()];
        self.ghost_pressure_locals = vec![0; ghosts.len()];
        for cell in chunks.cells(chunk) {
            for (corner, &q) in pressure.cell(cell).iter().enumerate() {
                let local = chunks.velocity.local(chunk, velocity.cell(cell)[corner_node::<D>(corner)]);
                if own.contains(&(q as usize)) {
                    self.pressure_locals[q as usize - own.start] = local;
                } else if let Ok(k) = ghosts.binary_search(&q) {
                    self.ghost_pressure_locals[k] = local;
                }
            }
        }
    }

    /// Places hanging nodes, given by the numbers of their constraints.
    fn place_hanging<const D: usize>(
        &mut self,
        velocity: &NodeMap<D>,
        mut constraints: Vec<u32>,
        local: impl Fn(u32) -> u16,
    ) {
        constraints.sort_unstable();
        constraints.dedup();
        for k in constraints {
            let constraint = &velocity.constraints()[k as usize];
            self.masters.extend(constraint.masters.iter().map(|m| local(m.0)));
            self.weights.extend(constraint.masters.iter().map(|m| m.1));
            let masters_end = self.masters.len() as u32;
            self.hanging.push(Hanging { local: local(constraint.node), masters_end });
        }
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
