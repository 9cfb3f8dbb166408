//! Nodes of a level as a rank sees them: those of its cells and around, the range that it owns, and the plan
//! of the ghosts that it needs.

use std::ops::Range;
use std::sync::Arc;

use gluey_fem::cells::CellData;
use gluey_fem::{Chunks, Cuts, ImplicitTree, NodeMap, Part};
use gluey_parallel::{Communicator, GhostPlan, Wanted};

/// Velocities of one level.
#[derive(Clone)]
pub struct LevelSpace<const D: usize> {
    pub part: Arc<Part<D>>,
    pub velocity: Arc<Nodes<D>>,
    pub pressure: Arc<Nodes<D>>,
    pub chunks: Arc<Chunks<D>>,
}

/// Nodes of one degree.
pub struct Nodes<const D: usize> {
    pub map: NodeMap<D>,
    /// First touched by a cell of the rank.
    pub owned: Range<usize>,
    /// The constraint of each hanging node, or none.
    constraint_of: Vec<u32>,
}

impl<const D: usize> Nodes<D> {
    fn new(part: &Part<D>, degree: usize) -> Self {
        let map = NodeMap::new(&part.mesh, degree);
        let touched = |cells| map.cells(cells).iter().max().map_or(0, |&node| node as usize + 1);
        let first = touched(0..part.own().start);
        let owned = first..touched(0..part.own().end).max(first);
        let mut constraint_of = vec![u32::MAX; map.node_count()];
        for (k, constraint) in map.constraints().iter().enumerate() {
            constraint_of[constraint.node as usize] = k as u32;
        }
        Self { map, owned, constraint_of }
    }

    /// Regular nodes and weights that a node stands for: itself, or the masters of a hanging one.
    pub fn regular(&self, node: u32) -> impl Iterator<Item = (u32, f64)> {
        let constraint = self.map.constraints().get(self.constraint_of[node as usize] as usize);
        let itself = constraint.is_none().then_some((node, 1.0));
        itself.into_iter().chain(constraint.into_iter().flat_map(|c| c.masters.iter().copied()))
    }

    /// Whether a node has an unknown velocity.
    pub fn is_free(&self, node: usize) -> bool {
        self.constraint_of[node] == u32::MAX && !self.map.is_on_boundary(node)
    }
}

impl<const D: usize> LevelSpace<D> {
    /// The tree cut at `depth`, around the keys `inner` or else those of the rank.
    pub fn new(
        tree: &mut ImplicitTree<'_, D>,
        depth: u8,
        own: &Range<u64>,
        inner: Option<Range<u64>>,
    ) -> Self {
        let part = Part::new(tree, depth, own, &inner.unwrap_or(own.clone()));
        let (velocity, pressure) = (Nodes::new(&part, 2), Nodes::new(&part, 1));
        let chunks = Arc::new(Chunks::new(&velocity.map, &pressure.map));
        Self { part: part.into(), velocity: velocity.into(), pressure: pressure.into(), chunks }
    }

    /// Own cells, in a fluid of this viscosity.
    pub fn cells(&self, viscosity: f64) -> impl Iterator<Item = CellData<'static>> {
        let mesh = &self.part.mesh;
        self.part.own().map(move |cell| {
            let h = mesh.size(mesh.cells()[cell].level);
            let (viscous, divergence) = (viscosity * h.powi(D as i32 - 2), h.powi(D as i32 - 1));
            CellData { cell, viscous, divergence, points: &[] }
        })
    }
}

/// The plan of the ghosts among the nodes that the inner cells of a part depend on, for nodes that `keep`.
pub fn ghost_plan<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    (cuts, ranks): (&Cuts, &dyn Communicator),
    part: &Part<D>,
    nodes: &Nodes<D>,
    keep: impl Fn(usize) -> bool,
) -> GhostPlan {
    let (depth, degree) = (part.mesh.max_level(), nodes.map.degree() as u32);
    let mut is_wanted = vec![false; nodes.map.node_count()];
    for &node in nodes.map.cells(part.inner()) {
        for (node, _) in nodes.regular(node) {
            is_wanted[node as usize] |= keep(node as usize);
        }
    }
    is_wanted[nodes.owned.clone()].fill(false);
    let wanted = |node: usize| {
        let first = tree.first_touching(depth, degree, nodes.map.lattice_point(node));
        Wanted { owner: cuts.owner(first), key: nodes.map.key(node), place: node as u32 }
    };
    let wanted = (0..is_wanted.len()).filter(|&node| is_wanted[node]).map(wanted).collect();
    let mut owned: Vec<(u64, u32)> =
        nodes.owned.clone().map(|node| (nodes.map.key(node), node as u32)).collect();
    owned.sort_unstable();
    GhostPlan::new(ranks, wanted, |key| {
        owned.binary_search_by_key(&key, |owned| owned.0).ok().map(|k| owned[k].1)
    })
}
