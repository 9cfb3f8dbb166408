//! Nodes of a level as a rank sees them: those of its cells and around, the range that it owns, and the plan
//! of the ghosts that it needs.

use std::ops::Range;
use std::sync::Arc;

use gluey_fem::{Cell, Chunks, ImplicitTree, NodeMap, Part};
use gluey_parallel::{Communicator, Wanted};

use crate::bodies::Shared;

/// Velocities of one level.
#[derive(Clone)]
pub struct LevelSpace<const D: usize> {
    pub part: Arc<Part<D>>,
    pub velocity: Arc<Nodes<D>>,
    pub pressure: Arc<Nodes<D>>,
    pub chunks: Arc<Chunks<D>>,
}

/// What else a part of the finest level holds.
pub struct GhostLayer<'a, const D: usize> {
    /// How many rings of cells around its own.
    pub rings: usize,
    /// By which cells all but the first of them spread.
    pub spreads: &'a dyn Fn(&Cell<D>) -> bool,
}

/// Nodes of one degree.
#[derive(Debug)]
pub struct Nodes<const D: usize> {
    pub map: Arc<NodeMap<D>>,
    /// First touched by a cell of the rank.
    pub owned: Range<usize>,
    /// The constraint of each hanging node, or none.
    constraint_of: Vec<u32>,
}

impl<const D: usize> Nodes<D> {
    fn new(part: &Part<D>, degree: usize) -> Self {
        let map = Arc::new(NodeMap::new(&part.mesh, degree));
        let owned = map.end_of(0..part.own().start)..map.end_of(0..part.own().end);
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

    /// Which nodes the inner cells of a part depend on: their own, and the masters of hanging ones.
    pub fn needed(&self, part: &Part<D>) -> Vec<bool> {
        let mut needed = vec![false; self.map.node_count()];
        for &node in self.map.cells(part.inner()) {
            self.regular(node).for_each(|(node, _)| needed[node as usize] = true);
        }
        needed
    }

    /// Where an owned node stands, by its key.
    pub fn finder(&self) -> impl Fn(u64) -> Option<u32> {
        let mut owned: Vec<(u64, u32)> =
            self.owned.clone().map(|node| (self.map.key(node), node as u32)).collect();
        owned.sort_unstable();
        move |key| owned.binary_search_by_key(&key, |owned| owned.0).ok().map(|k| owned[k].1)
    }
}

impl<const D: usize> LevelSpace<D> {
    /// The tree cut at `depth`, around the keys `inner` or else those of the rank, with more of what is
    /// around. All ranks call this.
    pub fn new(
        tree: &mut ImplicitTree<'_, D>,
        depth: u8,
        shared: &Shared<'_, '_, D>,
        inner: Option<Range<u64>>,
        around: Option<&GhostLayer<'_, D>>,
    ) -> Self {
        let own = shared.cuts.of(shared.ranks.rank());
        let inner = inner.unwrap_or(own.clone());
        let part = match around {
            None => Part::new(tree, depth, &own, &inner),
            Some(around) => Part::widened(tree, depth, [&own, &inner], around.rings, around.spreads),
        };
        let (velocity, pressure) = (Nodes::new(&part, 2), Nodes::new(&part, 1));
        let chunks = Arc::new(Chunks::new(&velocity.map, &pressure.map));
        Self { part: part.into(), velocity: velocity.into(), pressure: pressure.into(), chunks }
    }

    /// Length of the velocities alone.
    pub fn nodal_dim(&self) -> usize {
        self.velocity.map.node_count() * D
    }

    /// Length of the owned velocities.
    pub fn owned_nodal_dim(&self) -> usize {
        self.velocity.owned.len() * D
    }
}

/// The nodes of a part that others own, of those that `keep`.
pub fn wanted_nodes<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    shared: &Shared<'_, '_, D>,
    part: &Part<D>,
    nodes: &Nodes<D>,
    keep: impl Fn(usize) -> bool,
) -> Vec<Wanted> {
    let (depth, degree) = (part.mesh.max_level(), nodes.map.degree() as u32);
    let wanted = |node: usize| {
        let first = tree.first_touching(depth, degree, nodes.map.lattice_point(node));
        Wanted { owner: shared.cuts.owner(first), key: nodes.map.key(node), place: node as u32 }
    };
    (0..nodes.map.node_count()).filter(|&n| !nodes.owned.contains(&n) && keep(n)).map(wanted).collect()
}
