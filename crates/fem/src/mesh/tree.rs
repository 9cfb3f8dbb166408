//! A 2^D-tree over a box of cubic root cells, balanced 2:1 across faces, edges and corners.

use gluey_geom::{Aabb, Vector};
use rustc_hash::FxHashMap;

/// Bits of one coordinate in a packed lattice key; bounds the resolution of a mesh.
pub(crate) const COORD_BITS: u32 = 21;

/// A cell of the tree: `coords` counts cells of its own `level` from the lower corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cell<const D: usize> {
    /// Depth in the tree; the roots have level 0.
    pub level: u8,
    /// Integer position among the cells of this level.
    pub coords: [u32; D],
}

impl<const D: usize> Cell<D> {
    pub(super) fn parent(&self) -> Self {
        Self { level: self.level - 1, coords: self.coords.map(|c| c >> 1) }
    }

    pub(super) fn children(self) -> impl Iterator<Item = Self> {
        (0..1u32 << D).map(move |k| Self {
            level: self.level + 1,
            coords: std::array::from_fn(|d| 2 * self.coords[d] + ((k >> d) & 1)),
        })
    }

    /// Interleaved bits of the lower corner on the lattice of `max_level`.
    pub(super) fn morton(&self, max_level: u8) -> u64 {
        let shift = max_level - self.level;
        let mut key = 0;
        for bit in 0..COORD_BITS {
            for d in 0..D {
                key |= u64::from((self.coords[d] << shift) >> bit & 1) << (bit as usize * D + d);
            }
        }
        key
    }
}

/// Reason why a mesh cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The root cells would not be cubes.
    #[error("the box {extent:?} is not divided into cubes by {roots:?} root cells")]
    NotCubic {
        /// Edge lengths of the box.
        extent: Vec<f64>,
        /// Root cells per direction.
        roots: Vec<u32>,
    },
    /// The mesh would need more lattice points per direction than a key holds.
    #[error("level {level} with {roots} root cells exceeds 2^{limit} cells per direction")]
    TooFine {
        /// Finest level asked for.
        level: u8,
        /// Largest number of root cells in a direction.
        roots: u32,
        /// Largest admissible power of two.
        limit: u32,
    },
}

/// The leaves of a balanced 2^D-tree over a box.
///
/// The box may be sheared: what stands at `x` in the box is at `x + shear (y - y_lower) e_1` in space. Places
/// (corners of cells, nodes) are given in the box.
#[derive(Clone, Debug)]
pub struct TreeMesh<const D: usize> {
    domain: Aabb<D>,
    shear: f64,
    roots: [u32; D],
    periodic: [bool; D],
    max_level: u8,
    /// Refined (non-leaf) cells of each level, sorted.
    refined: Vec<Vec<Cell<D>>>,
    leaves: Vec<Cell<D>>,
    index: FxHashMap<Cell<D>, u32>,
}

impl<const D: usize> TreeMesh<D> {
    /// The mesh whose cells all have the level `level`.
    pub fn uniform(
        domain: Aabb<D>,
        roots: [u32; D],
        periodic: [bool; D],
        level: u8,
    ) -> Result<Self, MeshError> {
        Self::refine(domain, roots, periodic, level, |_, _, _| true)
    }

    /// Refines every cell of a level below `max_level` for which `wants(lower corner, size, level)` holds,
    /// then balances 2:1.
    ///
    /// # Errors
    /// [`MeshError`] if the roots are not cubes or `max_level` is beyond the resolution of the keys.
    pub fn refine(
        domain: Aabb<D>,
        roots: [u32; D],
        periodic: [bool; D],
        max_level: u8,
        wants: impl Fn(&Vector<D>, f64, u8) -> bool,
    ) -> Result<Self, MeshError> {
        let mut mesh = Self::without_cells(domain, roots, periodic, max_level)?;
        let mut candidates = mesh.root_cells();
        for level in 0..max_level {
            candidates.retain(|c| wants(&mesh.lower_corner(c), mesh.size(level), level));
            let next = candidates.iter().flat_map(|c| c.children()).collect();
            mesh.refined.push(std::mem::replace(&mut candidates, next));
        }
        mesh.balance();
        mesh.collect_leaves();
        Ok(mesh)
    }

    /// A box and its lattice.
    pub(super) fn without_cells(
        domain: Aabb<D>,
        roots: [u32; D],
        periodic: [bool; D],
        max_level: u8,
    ) -> Result<Self, MeshError> {
        check_box(&domain, &roots, max_level)?;
        let (refined, leaves, index) = Default::default();
        Ok(Self { domain, shear: 0.0, roots, periodic, max_level, refined, leaves, index })
    }

    /// These leaves, whatever else the box holds, with a lattice of this level.
    pub(super) fn with_leaves(self, max_level: u8, mut leaves: Vec<Cell<D>>) -> Self {
        leaves.sort_by_cached_key(|c| c.morton(max_level));
        let index = leaves.iter().enumerate().map(|(i, c)| (*c, i as u32)).collect();
        Self { max_level, leaves, index, ..self }
    }

    /// The box with these cells, whatever else it holds, as a rank knows a part of a mesh.
    #[must_use]
    pub fn with_cells(self, cells: Vec<Cell<D>>) -> Self {
        let level = self.max_level;
        self.with_leaves(level, cells)
    }

    /// The same tree in a box with this shear.
    #[must_use]
    pub fn sheared(self, shear: f64) -> Self {
        Self { shear, ..self }
    }

    /// Shear of the box.
    pub fn shear(&self) -> f64 {
        self.shear
    }

    /// Distance in space from the centre of a cell of this edge length to its farthest corner.
    pub fn half_diagonal(&self, size: f64) -> f64 {
        half_diagonal::<D>(size, self.shear)
    }

    /// The same tree cut at `max_level`: finer cells are merged into their ancestors.
    pub fn coarsened(&self, max_level: u8) -> Self {
        let max_level = max_level.min(self.max_level);
        let mut mesh = Self {
            refined: self.refined[..usize::from(max_level)].to_vec(),
            leaves: Vec::new(),
            index: FxHashMap::default(),
            max_level,
            ..*self
        };
        mesh.collect_leaves();
        mesh
    }

    /// Whether it is [`TreeMesh::coarsened`] from `fine`.
    pub fn is_coarsening_of(&self, fine: &Self) -> bool {
        let same_box = (self.domain, self.shear, self.roots, self.periodic)
            == (fine.domain, fine.shear, fine.roots, fine.periodic);
        let refined = fine.refined.get(..usize::from(self.max_level));
        same_box && self.max_level <= fine.max_level && refined == Some(self.refined.as_slice())
    }

    /// Number of leaves.
    pub fn cell_count(&self) -> usize {
        self.leaves.len()
    }

    /// The leaves in Morton order.
    pub fn cells(&self) -> &[Cell<D>] {
        &self.leaves
    }

    /// Level of the finest lattice (a mesh may have no cell that fine).
    pub fn max_level(&self) -> u8 {
        self.max_level
    }

    /// Place of a cell in the order of cells: that of its lower corner on the finest lattice.
    pub fn key(&self, cell: &Cell<D>) -> u64 {
        cell.morton(self.max_level)
    }

    /// The meshed box.
    pub fn domain(&self) -> &Aabb<D> {
        &self.domain
    }

    /// Root cells per direction.
    pub fn roots(&self) -> [u32; D] {
        self.roots
    }

    /// Which directions are periodic.
    pub fn periodic(&self) -> [bool; D] {
        self.periodic
    }

    /// Edge length of a cell of `level`.
    pub fn size(&self, level: u8) -> f64 {
        self.domain.extent()[0] / f64::from(self.roots[0]) / f64::from(1u32 << level)
    }

    /// Lower corner of a cell.
    pub fn lower_corner(&self, cell: &Cell<D>) -> Vector<D> {
        let h = self.size(cell.level);
        Vector::from_fn(|d, _| self.domain.lower[d] + h * f64::from(cell.coords[d]))
    }

    /// Index of the leaf equal to `cell`, if it is one.
    pub fn find(&self, cell: &Cell<D>) -> Option<usize> {
        self.index.get(cell).map(|&i| i as usize)
    }

    /// The leaf that is `cell` or one of its ancestors.
    pub fn find_covering(&self, cell: &Cell<D>) -> Option<usize> {
        let mut cell = *cell;
        loop {
            if let Some(found) = self.find(&cell) {
                return Some(found);
            }
            if cell.level == 0 {
                return None;
            }
            cell = cell.parent();
        }
    }

    /// The cell of the same level displaced by `offset` cells, wrapped in periodic directions; `None`
    /// outside.
    pub fn neighbour(&self, cell: &Cell<D>, offset: &[i32; D]) -> Option<Cell<D>> {
        let mut coords = cell.coords;
        for d in 0..D {
            let count = i64::from(self.roots[d]) << cell.level;
            let moved = i64::from(coords[d]) + i64::from(offset[d]);
            coords[d] = match (0..count).contains(&moved) {
                true => moved as u32,
                false if self.periodic[d] => moved.rem_euclid(count) as u32,
                false => return None,
            };
        }
        Some(Cell { level: cell.level, coords })
    }

    pub(super) fn root_cells(&self) -> Vec<Cell<D>> {
        let count = self.roots.iter().product::<u32>();
        (0..count)
            .map(|mut k| {
                let coords = std::array::from_fn(|d| {
                    let c = k % self.roots[d];
                    k /= self.roots[d];
                    c
                });
                Cell { level: 0, coords }
            })
            .collect()
    }

    /// Adds refined cells until neighbouring leaves differ by at most one level: where a cell is refined, its
    /// neighbours of the same level exist, that is, their parents are refined.
    fn balance(&mut self) {
        for level in (1..self.refined.len()).rev() {
            let mut parents = Vec::new();
            for cell in &self.refined[level] {
                let around = offsets::<D>().filter_map(|o| self.neighbour(cell, &o));
                parents.extend(around.map(|n| n.parent()));
            }
            let coarser = &mut self.refined[level - 1];
            coarser.extend(parents);
            coarser.sort_unstable_by_key(|c| c.coords);
            coarser.dedup();
        }
    }

    fn collect_leaves(&mut self) {
        let is_refined: Vec<rustc_hash::FxHashSet<Cell<D>>> =
            self.refined.iter().map(|cells| cells.iter().copied().collect()).collect();
        let leaf = |c: &Cell<D>| is_refined.get(usize::from(c.level)).is_none_or(|set| !set.contains(c));
        let mut leaves: Vec<Cell<D>> = self.root_cells();
        leaves.extend(self.refined.iter().flatten().flat_map(|c| c.children()));
        leaves.retain(leaf);
        leaves.sort_by_cached_key(|c| c.morton(self.max_level));
        self.index = leaves.iter().enumerate().map(|(i, c)| (*c, i as u32)).collect();
        self.leaves = leaves;
    }
}

/// Distance from the centre to the farthest corner of a cube that is sheared.
pub fn half_diagonal<const D: usize>(size: f64, shear: f64) -> f64 {
    0.5 * size * ((1.0 + shear.abs()).powi(2) + (D - 1) as f64).sqrt()
}

/// Meshes of the same box with the same cells and finest lattice.
impl<const D: usize> PartialEq for TreeMesh<D> {
    fn eq(&self, other: &Self) -> bool {
        self.max_level == other.max_level && self.is_coarsening_of(other)
    }
}

/// All `3^D` offsets of a cell to itself and its neighbours.
pub(crate) fn offsets<const D: usize>() -> impl Iterator<Item = [i32; D]> {
    (0..3i32.pow(D as u32)).map(|k| std::array::from_fn(|d| k / 3i32.pow(d as u32) % 3 - 1))
}

fn check_box<const D: usize>(domain: &Aabb<D>, roots: &[u32; D], level: u8) -> Result<(), MeshError> {
    let extent = domain.extent();
    let size = extent[0] / f64::from(roots[0]);
    let cubic = (0..D).all(|d| (extent[d] / f64::from(roots[d]) - size).abs() <= 1e-12 * size);
    if !(size > 0.0 && cubic) {
        let extent = extent.iter().copied().collect();
        return Err(MeshError::NotCubic { extent, roots: roots.to_vec() });
    }
    let largest = roots.iter().copied().max().unwrap_or(1);
    let limit = COORD_BITS - 3;
    if (u64::from(largest) << level.min(40)) > 1 << limit {
        return Err(MeshError::TooFine { level, roots: largest, limit });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near_point<const D: usize>(level: u8, periodic: bool) -> TreeMesh<D> {
        let center = Vector::<D>::repeat(0.13);
        TreeMesh::refine(Aabb::unit(), [1; D], [periodic; D], level, |lower, h, _| {
            (lower + Vector::repeat(0.5 * h) - center).amax() <= h
        })
        .unwrap()
    }

    fn volume_is_covered_and_balanced<const D: usize>(periodic: bool) {
        let mesh = near_point::<D>(6, periodic);
        let volume: f64 = mesh.cells().iter().map(|c| mesh.size(c.level).powi(D as i32)).sum();
        assert!((volume - 1.0).abs() < 1e-12);
        for cell in mesh.cells() {
            for offset in offsets::<D>() {
                let Some(n) = mesh.neighbour(cell, &offset) else { continue };
                if let Some(found) = mesh.find_covering(&n) {
                    assert!(mesh.cells()[found].level + 1 >= cell.level);
                }
            }
        }
        let coarse = mesh.coarsened(3);
        assert!(coarse.is_coarsening_of(&mesh) && !mesh.is_coarsening_of(&coarse));
        assert!(mesh == mesh.clone() && mesh != coarse);
        assert!(!coarse.is_coarsening_of(&near_point::<D>(6, !periodic)));
        assert!(coarse.cells().iter().all(|c| c.level <= 3));
        let volume: f64 = coarse.cells().iter().map(|c| coarse.size(c.level).powi(D as i32)).sum();
        assert!((volume - 1.0).abs() < 1e-12);
    }

    #[test]
    fn leaves_tile_the_box_and_differ_by_one_level() {
        for periodic in [false, true] {
            volume_is_covered_and_balanced::<2>(periodic);
            volume_is_covered_and_balanced::<3>(periodic);
        }
    }

    #[test]
    fn a_flat_root_cell_is_refused() {
        let domain = Aabb { lower: Vector::<2>::zeros(), upper: Vector::<2>::new(1.0, 2.0) };
        let refused = TreeMesh::uniform(domain, [1, 1], [false; 2], 1);
        assert!(matches!(refused, Err(MeshError::NotCubic { .. })));
        assert!(TreeMesh::uniform(domain, [1, 2], [false; 2], 1).is_ok());
        let refused = TreeMesh::uniform(domain, [1, 2], [false; 2], 30);
        assert!(matches!(refused, Err(MeshError::TooFine { .. })));
    }
}
