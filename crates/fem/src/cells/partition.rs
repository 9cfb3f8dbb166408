//! Contiguous runs of cells that own contiguous runs of nodes.
//!
//! Cells in Morton order are cut into chunks of [`CHUNK_CELLS`]. Nodes are numbered as the cells touch them first, so a
//! chunk owns a range of nodes; those of other chunks that its cells also touch it *borrows*. A chunk works in a buffer
//! of its own, first the nodes it owns, then those it borrows, and its contributions to the latter are added by their
//! owners, in the order of the chunks. So the cutting, and with it every bit of a sum, depends on the mesh alone and not
//! on the number of threads.

use std::ops::Range;

use gluey_linalg::Jagged;

use crate::space::NodeMap;

/// Cells of a chunk: their nodes stay in the cache next to a core.
pub const CHUNK_CELLS: usize = 512;

/// Which chunk owns and which borrows the nodes of one space.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shares {
    /// First node of each chunk, and the number of nodes.
    first: Vec<u32>,
    /// Nodes of other chunks that a chunk touches, in ascending order.
    pub(crate) borrowed: Jagged<u32>,
    /// Positions among all borrowed nodes of those that a chunk owns, in ascending order.
    pub(crate) returned: Jagged<u32>,
}

impl Shares {
    /// `touched(chunk, nodes)` appends the nodes a chunk touches.
    fn new(first: Vec<u32>, touched: impl Fn(usize, &mut Vec<u32>)) -> Self {
        let mut shares = Self { first, ..Self::default() };
        let mut nodes = Vec::new();
        for chunk in 0..shares.first.len() - 1 {
            touched(chunk, &mut nodes);
            let own = shares.owned(chunk);
            nodes.retain(|&n| !own.contains(&(n as usize)));
            nodes.sort_unstable();
            nodes.dedup();
            shares.borrowed.push(nodes.drain(..));
        }
        shares.find_returned();
        shares
    }

    fn find_returned(&mut self) {
        let owner = |node: u32| self.first.partition_point(|&f| f <= node) - 1;
        let owned = self.borrowed.items().iter().zip(0u32..).map(|(&node, position)| (owner(node), position));
        self.returned = Jagged::grouped(self.first.len() - 1, owned);
    }

    /// Nodes a chunk owns.
    pub(crate) fn owned(&self, chunk: usize) -> Range<usize> {
        self.first[chunk] as usize..self.first[chunk + 1] as usize
    }

    /// Nodes of the space.
    pub(crate) fn node_count(&self) -> usize {
        self.first.last().map_or(0, |&n| n as usize)
    }
}

/// A hanging node in the buffer of a chunk, and where its masters end in the list of all masters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hanging {
    pub(crate) slot: u16,
    pub(crate) masters_end: u32,
}

/// The chunks of a mesh with the nodes of the Q2-Q1 pair. Positions in the buffer of a chunk are called slots.
#[derive(Clone, Debug, Default)]
pub struct Chunks<const D: usize> {
    cell_count: usize,
    pub(crate) velocity: Shares,
    pub(crate) pressure: Shares,
    /// Slot of each pressure node in the chunk that owns it: that of the velocity node at the same place.
    pub(crate) pressure_slots: Vec<u16>,
    /// Slots of the borrowed pressure nodes.
    pub(crate) borrowed_pressure_slots: Vec<u16>,
    /// Hanging velocity nodes of the cells of a chunk.
    pub(crate) hanging: Jagged<Hanging>,
    pub(crate) masters: Vec<u16>,
    pub(crate) weights: Vec<f64>,
    /// Slots of the nodes on the boundary.
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
            velocity: Shares::new(first_nodes(velocity), |chunk, touched| {
                for &node in velocity.cells(cells_of(chunk, cell_count)) {
                    touched.push(node);
                    touched.extend(constraint(node).iter().flat_map(|c| c.masters.iter().map(|m| m.0)));
                }
            }),
            pressure: Shares::new(first_nodes(pressure), |chunk, touched| {
                touched.extend_from_slice(pressure.cells(cells_of(chunk, cell_count)));
            }),
            pressure_slots: vec![0; pressure.node_count()],
            ..Self::default()
        };
        let mut slots = Slots::new(velocity.node_count());
        for chunk in 0..chunks.count() {
            slots.set(&chunks.velocity, chunk);
            chunks.place_pressures(velocity, pressure, chunk, &slots);
            let local = || {
                chunks
                    .velocity
                    .owned(chunk)
                    .map(|n| n as u32)
                    .chain(chunks.velocity.borrowed[chunk].iter().copied())
            };
            let boundary: Vec<u16> =
                local().filter(|&n| velocity.is_on_boundary(n as usize)).map(|n| slots.of(n)).collect();
            let mut hanging: Vec<u32> = velocity
                .cells(cells_of(chunk, cell_count))
                .iter()
                .map(|&n| constraint_of[n as usize])
                .filter(|&k| k != u32::MAX)
                .collect();
            hanging.sort_unstable();
            hanging.dedup();
            chunks.boundary.push(boundary);
            chunks.place_hanging(velocity, &hanging, &slots);
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

    fn place_pressures(&mut self, velocity: &NodeMap<D>, pressure: &NodeMap<D>, chunk: usize, slots: &Slots) {
        let own = self.pressure.owned(chunk);
        let borrowed = &self.pressure.borrowed[chunk];
        let mut borrowed_slots = vec![0; borrowed.len()];
        for cell in self.cells(chunk) {
            for (corner, &q) in pressure.cell(cell).iter().enumerate() {
                let slot = slots.of(velocity.cell(cell)[corner_node::<D>(corner)]);
                if own.contains(&(q as usize)) {
                    self.pressure_slots[q as usize] = slot;
                } else if let Ok(k) = borrowed.binary_search(&q) {
                    borrowed_slots[k] = slot;
                }
            }
        }
        self.borrowed_pressure_slots.extend(borrowed_slots);
    }

    fn place_hanging(&mut self, velocity: &NodeMap<D>, constraints: &[u32], slots: &Slots) {
        let mut hanging = Vec::with_capacity(constraints.len());
        for &k in constraints {
            let constraint = &velocity.constraints()[k as usize];
            self.masters.extend(constraint.masters.iter().map(|m| slots.of(m.0)));
            self.weights.extend(constraint.masters.iter().map(|m| m.1));
            hanging.push(Hanging { slot: slots.of(constraint.node), masters_end: self.masters.len() as u32 });
        }
        self.hanging.push(hanging);
    }

    /// Calls `visit(slot, masters, weights)` for the hanging nodes of a chunk.
    #[inline(always)]
    pub(crate) fn for_each_hanging(&self, chunk: usize, mut visit: impl FnMut(u16, &[u16], &[f64])) {
        let range = self.hanging.range(chunk);
        let mut start = match range.start {
            0 => 0,
            k => self.hanging.items()[k - 1].masters_end as usize,
        };
        for hanging in &self.hanging[chunk] {
            let end = hanging.masters_end as usize;
            visit(hanging.slot, &self.masters[start..end], &self.weights[start..end]);
            start = end;
        }
    }

    /// Slots in the buffer of a chunk.
    pub(crate) fn slot_count(&self, chunk: usize) -> usize {
        self.velocity.owned(chunk).len() + self.velocity.borrowed.range(chunk).len()
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

/// Slots of the nodes in the buffer of one chunk at a time.
pub(crate) struct Slots {
    of: Vec<u16>,
}

impl Slots {
    pub(crate) fn new(node_count: usize) -> Self {
        Self { of: vec![0; node_count] }
    }

    pub(crate) fn set(&mut self, shares: &Shares, chunk: usize) {
        let own = shares.owned(chunk);
        let count = own.len() + shares.borrowed[chunk].len();
        assert!(count < usize::from(u16::MAX), "a chunk touches at most {CHUNK_CELLS} cells' nodes");
        let nodes = own.chain(shares.borrowed[chunk].iter().map(|&n| n as usize));
        for (slot, node) in nodes.enumerate() {
            self.of[node] = slot as u16;
        }
    }

    pub(crate) fn of(&self, node: u32) -> u16 {
        self.of[node as usize]
    }
}
