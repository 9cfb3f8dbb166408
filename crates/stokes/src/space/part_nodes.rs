//! Nodes of a part of a mesh: those of its cells and around, the range that the rank owns, and who owns the
//! others.

use std::ops::Range;
use std::sync::Arc;

use gluey_fem::{NodeMap, Part};
use gluey_parallel::{GhostPlan, Ranks, Wanted};

/// Nodes of one degree.
#[derive(Clone, Debug)]
pub struct PartNodes<const D: usize> {
    /// All nodes of the part.
    pub map: Arc<NodeMap<D>>,
    /// First touched by a cell of the rank.
    pub owned: Range<usize>,
    /// The rank that owns each of the others.
    owners: Vec<u32>,
    /// The constraint of each hanging node, or none.
    constraint_of: Vec<u32>,
}

impl<const D: usize> PartNodes<D> {
    /// The nodes of a part, which `owner` names the owners of by their points of the lattice.
    pub fn new(part: &Part<D>, degree: usize, mut owner: impl FnMut(&[u32; D]) -> usize) -> Self {
        let map = Arc::new(NodeMap::new(&part.mesh, degree));
        let owned = map.end_of(0..part.own().start)..map.end_of(0..part.own().end);
        let mut constraint_of = vec![u32::MAX; map.node_count()];
        for (k, constraint) in map.constraints().iter().enumerate() {
            constraint_of[constraint.node as usize] = k as u32;
        }
        let mut owners = vec![0; map.node_count()];
        for node in (0..map.node_count()).filter(|node| !owned.contains(node)) {
            owners[node] = owner(map.lattice_point(node)) as u32;
        }
        Self { map, owned, owners, constraint_of }
    }

    /// Regular nodes and weights that a node stands for: itself, or the masters of a hanging one.
    pub fn regular(&self, node: u32) -> impl Iterator<Item = (u32, f64)> {
        let constraint = self.map.constraints().get(self.constraint_of[node as usize] as usize);
        let itself = constraint.is_none().then_some((node, 1.0));
        itself.into_iter().chain(constraint.into_iter().flat_map(|c| c.masters.iter().copied()))
    }

    /// Which nodes some cells depend on: their own, and the masters of hanging ones.
    pub fn needed(&self, cells: Range<usize>) -> Vec<bool> {
        let mut needed = vec![false; self.map.node_count()];
        for &node in self.map.cells(cells) {
            self.regular(node).for_each(|(node, _)| needed[node as usize] = true);
        }
        needed
    }

    /// The plan of those that others own, of the nodes that `keep`. All ranks call this.
    pub fn ghosts(&self, ranks: &Ranks, keep: impl Fn(usize) -> bool) -> GhostPlan {
        let ghosts = (0..self.map.node_count()).filter(|&node| !self.owned.contains(&node) && keep(node));
        let wanted = ghosts.map(|node| Wanted {
            owner: self.owners[node] as usize,
            key: self.map.key(node),
            place: node as u32,
        });
        let mut owned: Vec<(u64, u32)> =
            self.owned.clone().map(|node| (self.map.key(node), node as u32)).collect();
        owned.sort_unstable();
        let find = |key| owned.binary_search_by_key(&key, |owned| owned.0).ok().map(|k| owned[k].1);
        GhostPlan::new(ranks, wanted.collect(), find)
    }
}
