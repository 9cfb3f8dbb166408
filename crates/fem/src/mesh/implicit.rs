//! A tree that is asked for its cells instead of stored: what a rank needs of a mesh that it holds a part of.
//!
//! Whether a cell is refined follows from what is wanted near it: it is wanted itself, or a refined cell one
//! level finer touches it (balance). The answer is the one of [`TreeMesh::refine`], and is found without the
//! rest of the tree. Answers are kept, so memory grows with what was asked.

use std::ops::Range;

use gluey_geom::{Aabb, Vector};
use rustc_hash::FxHashMap;

use super::tree::{COORD_BITS, Cell, MeshError, TreeMesh, offsets};

/// Criterion for cells that are wanted finer, by lower corner, size and level.
type Wants<'a, const D: usize> = dyn Fn(&Vector<D>, f64, u8) -> bool + 'a;

/// The tree of [`TreeMesh::refine`], known cell by cell.
///
/// Methods that take a `depth` speak of the tree cut there, [`TreeMesh::coarsened`].
pub struct ImplicitTree<'a, const D: usize> {
    /// The box, without cells.
    frame: TreeMesh<D>,
    wants: &'a Wants<'a, D>,
    /// The roots in Morton order.
    roots: Vec<Cell<D>>,
    wanted: FxHashMap<Cell<D>, bool>,
    refined: FxHashMap<Cell<D>, bool>,
}

impl<'a, const D: usize> ImplicitTree<'a, D> {
    /// The tree that [`TreeMesh::refine`] makes of these arguments.
    ///
    /// # Errors
    /// As there.
    pub fn new(
        domain: Aabb<D>,
        roots: [u32; D],
        periodic: [bool; D],
        max_level: u8,
        wants: &'a Wants<'a, D>,
    ) -> Result<Self, MeshError> {
        let frame = TreeMesh::without_cells(domain, roots, periodic, max_level)?;
        let mut roots = frame.root_cells();
        roots.sort_by_key(|cell| cell.morton(max_level));
        Ok(Self { frame, wants, roots, wanted: FxHashMap::default(), refined: FxHashMap::default() })
    }

    /// The same tree in a box with this shear.
    #[must_use]
    pub fn sheared(self, shear: f64) -> Self {
        Self { frame: self.frame.sheared(shear), ..self }
    }

    /// The same tree with nothing known of it yet.
    #[must_use]
    pub fn forgotten(&self) -> Self {
        let (wanted, refined) = Default::default();
        Self { frame: self.frame.clone(), wants: self.wants, roots: self.roots.clone(), wanted, refined }
    }

    /// The box; its mesh has no cells.
    pub fn frame(&self) -> &TreeMesh<D> {
        &self.frame
    }

    /// Level of the finest lattice.
    pub fn max_level(&self) -> u8 {
        self.frame.max_level()
    }

    /// Cells whose answers are kept.
    pub fn known_count(&self) -> usize {
        self.refined.len() + self.wanted.len()
    }

    /// Place in the order of cells: that of its lower corner on the finest lattice.
    pub fn key(&self, cell: &Cell<D>) -> u64 {
        self.frame.key(cell)
    }

    /// Keys of the lower corners in a cell.
    pub fn keys(&self, cell: &Cell<D>) -> Range<u64> {
        let first = self.key(cell);
        first..first + (1 << (usize::from(self.max_level() - cell.level) * D))
    }

    /// More than every key.
    pub fn end(&self) -> u64 {
        let largest = self.frame.roots().into_iter().max().unwrap_or(1);
        1 << ((u32::from(self.max_level()) + largest.next_power_of_two().ilog2()) as usize * D)
    }

    /// Whether a cell has children in the whole tree.
    pub fn is_refined(&mut self, cell: &Cell<D>) -> bool {
        if cell.level >= self.max_level() {
            return false;
        }
        if let Some(&known) = self.refined.get(cell) {
            return known;
        }
        let answer = self.is_wanted(cell) || self.is_forced(cell);
        self.refined.insert(*cell, answer);
        answer
    }

    /// Whether it and all its ancestors are wanted finer.
    fn is_wanted(&mut self, cell: &Cell<D>) -> bool {
        if let Some(&known) = self.wanted.get(cell) {
            return known;
        }
        let above = cell.level == 0 || self.is_wanted(&cell.parent());
        let (corner, size) = (self.frame.lower_corner(cell), self.frame.size(cell.level));
        let answer = above && (self.wants)(&corner, size, cell.level);
        self.wanted.insert(*cell, answer);
        answer
    }

    /// Whether balance refines it: a refined cell one level finer touches it. What forces it, be it through
    /// others, lies closer than its size, so only where a neighbour is wanted finer there is more to ask.
    fn is_forced(&mut self, cell: &Cell<D>) -> bool {
        if cell.level + 1 >= self.max_level() {
            return false;
        }
        let near: Vec<Cell<D>> = self.around(cell).collect();
        if !near.iter().any(|near| self.is_wanted(near)) {
            return false;
        }
        let first = Cell { level: cell.level + 1, coords: cell.coords.map(|c| 2 * c) };
        let block = (0..4i32.pow(D as u32)).map(|k| std::array::from_fn(|d| k / 4i32.pow(d as u32) % 4 - 1));
        let finer: Vec<Cell<D>> = block.filter_map(|offset| self.frame.neighbour(&first, &offset)).collect();
        finer.iter().any(|finer| self.is_refined(finer))
    }

    /// A cell and those of its level that touch it.
    fn around(&self, cell: &Cell<D>) -> impl Iterator<Item = Cell<D>> {
        offsets::<D>().filter_map(|offset| self.frame.neighbour(cell, &offset))
    }

    fn is_leaf(&mut self, depth: u8, cell: &Cell<D>) -> bool {
        cell.level >= depth || !self.is_refined(cell)
    }

    /// Visits the leaves that overlap a range of keys, in Morton order.
    pub fn for_each_leaf(&mut self, depth: u8, keys: &Range<u64>, mut visit: impl FnMut(Cell<D>)) {
        let mut stack: Vec<Cell<D>> = self.roots.iter().rev().copied().collect();
        while let Some(cell) = stack.pop() {
            let own = self.keys(&cell);
            if own.end <= keys.start || keys.end <= own.start {
                continue;
            }
            if self.is_leaf(depth, &cell) {
                visit(cell);
            } else {
                let at = stack.len();
                stack.extend(cell.children());
                stack[at..].reverse();
            }
        }
    }

    /// Number of leaves of the whole tree that begin in a range of keys.
    pub fn count_leaves(&mut self, keys: &Range<u64>) -> usize {
        self.weigh_leaves(keys, &|_| 1) as usize
    }

    /// Their weights, added up.
    pub fn weigh_leaves(&mut self, keys: &Range<u64>, weight: &dyn Fn(&Cell<D>) -> u64) -> u64 {
        let (mut sum, depth) = (0, self.max_level());
        self.for_each_leaf(depth, keys, |cell| {
            sum += if cell.morton(depth) >= keys.start { weight(&cell) } else { 0 };
        });
        sum
    }

    /// Key of leaf `n` among those of the whole tree that begin in a range of keys.
    pub fn nth_key(&mut self, keys: &Range<u64>, n: usize) -> Option<u64> {
        self.key_after(keys, n as u64, &|_| 1)
    }

    /// Key of the first leaf among them before which leaves weigh `least` or more, but for those without a
    /// weight before it.
    pub fn key_after(
        &mut self,
        keys: &Range<u64>,
        least: u64,
        weight: &dyn Fn(&Cell<D>) -> u64,
    ) -> Option<u64> {
        let (mut found, mut before, depth) = (None, 0, self.max_level());
        self.for_each_leaf(depth, keys, |cell| {
            let key = cell.morton(depth);
            if key >= keys.start && found.is_none() {
                let own = weight(&cell);
                found = (before >= least && own > 0).then_some(key);
                before += own;
            }
        });
        found
    }

    /// The first key from this one on at which no leaf is cut in two.
    pub fn end_of_leaf(&mut self, key: u64) -> u64 {
        let (mut before, depth) = (None, self.max_level());
        self.for_each_leaf(depth, &(key.saturating_sub(1)..key), |leaf| before = Some(leaf));
        before.map_or(key, |leaf| self.keys(&leaf).end)
    }

    /// The leaf that is `cell`, of a level up to `depth`, or one of its ancestors.
    fn covering(&mut self, depth: u8, cell: &Cell<D>) -> Cell<D> {
        let ancestor = |level: u8| Cell { level, coords: cell.coords.map(|c| c >> (cell.level - level)) };
        let found = (0..cell.level).map(ancestor).find(|ancestor| self.is_leaf(depth, ancestor));
        found.unwrap_or(*cell)
    }

    /// Passes on the leaves that touch a leaf.
    fn touching(&mut self, depth: u8, cell: &Cell<D>, touched: &mut impl FnMut(Cell<D>)) {
        for offset in offsets::<D>().filter(|offset| offset.iter().any(|&o| o != 0)) {
            let Some(near) = self.frame.neighbour(cell, &offset) else { continue };
            if let Some(coarse) = self.coarser(depth, &near) {
                touched(coarse);
            } else if self.is_leaf(depth, &near) {
                touched(near);
            } else {
                let faces = |child: &Cell<D>| {
                    (0..D).all(|d| offset[d] == 0 || offset[d] == 1 - 2 * (child.coords[d] & 1) as i32)
                };
                near.children().filter(faces).for_each(&mut *touched);
            }
        }
    }

    /// The leaf one level coarser that covers a cell.
    fn coarser(&mut self, depth: u8, cell: &Cell<D>) -> Option<Cell<D>> {
        let parent = (cell.level > 0).then(|| cell.parent())?;
        self.is_leaf(depth, &parent).then_some(parent)
    }

    /// Key of the first leaf that touches a point of the lattice of `degree` points a cell of level `depth`.
    pub fn first_touching(&mut self, depth: u8, degree: u32, point: &[u32; D]) -> u64 {
        let mut first = u64::MAX;
        self.for_each_touching(depth, degree, point, |tree, leaf| first = first.min(tree.key(leaf)));
        first
    }

    /// Level of the smallest leaves that touch such a point.
    pub fn finest_touching(&mut self, depth: u8, degree: u32, point: &[u32; D]) -> u8 {
        let mut finest = 0;
        self.for_each_touching(depth, degree, point, |_, leaf| finest = finest.max(leaf.level));
        finest
    }

    /// Visits the leaves that touch a point, some more than once.
    fn for_each_touching(
        &mut self,
        depth: u8,
        degree: u32,
        point: &[u32; D],
        mut visit: impl FnMut(&Self, &Cell<D>),
    ) {
        let counts = self.frame.roots().map(|r| i64::from(r) << depth);
        let periodic = self.frame.periodic();
        for corner in 0..1u32 << D {
            let along = |d: usize| {
                let upper = i64::from(point[d] / degree);
                let on_a_face = point[d].is_multiple_of(degree);
                let cell = if corner >> d & 1 == 0 && on_a_face { upper - 1 } else { upper };
                let wrapped = if periodic[d] { cell.rem_euclid(counts[d]) } else { cell };
                (0..counts[d]).contains(&wrapped).then_some(wrapped as u32)
            };
            let coords: [Option<u32>; D] = std::array::from_fn(along);
            if coords.iter().all(Option::is_some) {
                let cell = Cell { level: depth, coords: coords.map(|c| c.unwrap_or_default()) };
                let leaf = self.covering(depth, &cell);
                visit(self, &leaf);
            }
        }
    }

    /// The leaves around some leaves: those that touch one, and coarser ones that touch those, and so on.
    /// Values of the hanging nodes of `cells` follow from nodes of these.
    pub(super) fn surroundings(&mut self, depth: u8, cells: &[Cell<D>]) -> Vec<Cell<D>> {
        let inside: FxHashMap<Cell<D>, ()> = cells.iter().map(|&cell| (cell, ())).collect();
        let mut seen = inside;
        let mut around = Vec::new();
        for cell in cells {
            self.touching(depth, cell, &mut |near| {
                if seen.insert(near, ()).is_none() {
                    around.push(near);
                }
            });
        }
        let mut next = 0;
        while let Some(&cell) = around.get(next) {
            let near: Vec<Cell<D>> = self.around(&cell).collect();
            for coarse in near.iter().filter_map(|near| self.coarser(depth, near)) {
                if coarse != cell && seen.insert(coarse, ()).is_none() {
                    around.push(coarse);
                }
            }
            next += 1;
        }
        around
    }
}

const _: () = assert!(COORD_BITS * 3 < u64::BITS);
