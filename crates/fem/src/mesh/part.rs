//! The part of a tree that a rank holds: its own leaves, and those around them.
//!
//! Leaves in Morton order are cut into runs, one for each rank; a coarser level is cut at the same keys, so
//! that a cell belongs to the rank that owns its lower corner. Nodes are numbered as cells touch them first,
//! so those that a rank owns, first touched by a leaf of its own, are a range in its own numbering, in the
//! order of the whole mesh: the ranges of all ranks, one after the other, number the whole mesh.

use std::ops::Range;
use std::sync::Arc;

use rustc_hash::FxHashSet;

use super::implicit::ImplicitTree;
use super::tree::{Cell, TreeMesh};

/// Keys at which the order of cells is cut: one run for each rank.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cuts {
    /// First key of each rank, and the end of the last.
    firsts: Vec<u64>,
}

impl Cuts {
    /// Runs that begin at these keys, the last of which ends at `end`.
    ///
    /// # Panics
    /// If there is no run or the keys are not in ascending order from zero.
    pub fn new(mut firsts: Vec<u64>, end: u64) -> Self {
        firsts.push(end);
        assert!(firsts.len() > 1 && firsts[0] == 0 && firsts.is_sorted(), "runs begin one after the other");
        Self { firsts }
    }

    /// One run of everything.
    pub fn one<const D: usize>(tree: &ImplicitTree<'_, D>) -> Self {
        Self::new(vec![0], tree.end())
    }

    /// Runs of the whole tree that differ by one leaf at most, found by one rank that asks for all leaves.
    pub fn equal<const D: usize>(tree: &mut ImplicitTree<'_, D>, ranks: usize) -> Self {
        let (all, end) = (0..tree.end(), tree.end());
        let total = tree.count_leaves(&all);
        let first = |rank: usize| match rank {
            0 => 0,
            _ => tree.nth_key(&all, rank * total / ranks).unwrap_or(end),
        };
        Self::new((0..ranks).map(first).collect(), end)
    }

    /// First keys of the runs, and the end of the last.
    pub fn firsts(&self) -> &[u64] {
        &self.firsts
    }

    /// Number of runs.
    pub fn count(&self) -> usize {
        self.firsts.len() - 1
    }

    /// Keys of a rank.
    pub fn of(&self, rank: usize) -> Range<u64> {
        self.firsts[rank]..self.firsts[rank + 1]
    }

    /// The rank whose run holds a key.
    pub fn owner(&self, key: u64) -> usize {
        self.firsts[..self.count()].partition_point(|&first| first <= key) - 1
    }
}

/// Leaves of a rank with those around them.
#[derive(Clone, Debug)]
pub struct Part<const D: usize> {
    /// The leaves, as a mesh. Its nodes are numbered like those of the whole, and hanging nodes of the inner
    /// cells have their constraints; at its rim it knows nothing of what lies outside.
    pub mesh: Arc<TreeMesh<D>>,
    own: Range<usize>,
    inner: Range<usize>,
}

impl<const D: usize> Part<D> {
    /// The leaves that begin in the keys `own` of the tree cut at `depth`, and around those that overlap the
    /// keys `inner` whatever touches them.
    pub fn new(tree: &mut ImplicitTree<'_, D>, depth: u8, own: &Range<u64>, inner: &Range<u64>) -> Self {
        Self::widened(tree, depth, [own, inner], 1, &|_| false)
    }

    /// The same with more of what is around: `rings` times the leaves that touch a leaf that is there
    /// already, but for the first time only those that touch one that `spreads`.
    pub fn widened(
        tree: &mut ImplicitTree<'_, D>,
        depth: u8,
        [own, inner]: [&Range<u64>; 2],
        rings: usize,
        spreads: &dyn Fn(&Cell<D>) -> bool,
    ) -> Self {
        let mut leaves = Vec::new();
        tree.for_each_leaf(depth, inner, |cell| leaves.push(cell));
        let Some(first) = leaves.first().map(|cell| tree.key(cell)) else {
            let mesh = tree.frame().clone().with_leaves(depth, Vec::new());
            return Self { mesh: Arc::new(mesh), own: 0..0, inner: 0..0 };
        };
        let (inner_count, owned) = (leaves.len(), |cell: &Cell<D>| own.contains(&tree.key(cell)));
        let before_own = leaves.iter().take_while(|cell| tree.key(cell) < own.start).count();
        let own_count = leaves.iter().filter(|cell| owned(cell)).count();
        let mut around = tree.surroundings(depth, &leaves);
        spread(tree, depth, &leaves, &mut around, rings, spreads);
        let before = around.iter().filter(|cell| tree.key(cell) < first).count();
        leaves.extend(around);
        let own = before + before_own..before + before_own + own_count;
        let mesh = tree.frame().clone().with_leaves(depth, leaves);
        Self { mesh: Arc::new(mesh), own, inner: before..before + inner_count }
    }

    /// Leaves of the rank, of those of the mesh.
    pub fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// Leaves whose nodes are known with their constraints: those of the rank, and on a coarser level the one
    /// that its run begins in.
    pub fn inner(&self) -> Range<usize> {
        self.inner.clone()
    }
}

/// Adds rings of leaves to those around some.
fn spread<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    depth: u8,
    leaves: &[Cell<D>],
    around: &mut Vec<Cell<D>>,
    rings: usize,
    spreads: &dyn Fn(&Cell<D>) -> bool,
) {
    let mut known: FxHashSet<Cell<D>> = leaves.iter().chain(&*around).copied().collect();
    let mut rim: Vec<Cell<D>> = around.clone();
    for _ in 1..rings {
        rim.retain(spreads);
        rim = tree.surroundings(depth, &rim);
        rim.retain(|cell| known.insert(*cell));
        around.extend_from_slice(&rim);
    }
}
