//! Nodes of a continuous Lagrange space on a tree mesh, and the constraints of its hanging nodes.

use gluey_geom::Vector;
use rustc_hash::FxHashMap;

use crate::element::{multi_index, node_count, values_1d};
use crate::mesh::{COORD_BITS, Cell, TreeMesh, offsets};

/// A hanging node: its value is the weighted sum of those of regular nodes, `u = sum_j w_j u_j`.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint {
    /// The hanging node.
    pub node: u32,
    /// Regular nodes and weights; the weights sum to one.
    pub masters: Vec<(u32, f64)>,
}

/// Numbering of the nodes of the continuous Lagrange space of one degree on a mesh.
///
/// Nodes are numbered in the order in which the cells, in Morton order, touch them first.
#[derive(Clone, Debug)]
pub struct NodeMap<const D: usize> {
    degree: usize,
    nodes_per_cell: usize,
    cell_nodes: Vec<u32>,
    lattice: Vec<[u32; D]>,
    lattice_extent: [u32; D],
    spacing: f64,
    lower: Vector<D>,
    periodic: [bool; D],
    constraints: Vec<Constraint>,
    is_hanging: Vec<bool>,
}

impl<const D: usize> NodeMap<D> {
    /// Numbers the nodes of the Lagrange space of `degree` (1 or 2) on `mesh`.
    pub fn new(mesh: &TreeMesh<D>, degree: usize) -> Self {
        let finest = mesh.max_level();
        let mut map = Self {
            degree,
            nodes_per_cell: node_count::<D>(degree),
            cell_nodes: Vec::with_capacity(mesh.cell_count() * node_count::<D>(degree)),
            lattice: Vec::new(),
            lattice_extent: mesh.roots().map(|r| (r * degree as u32) << finest),
            spacing: mesh.size(finest) / degree as f64,
            lower: mesh.domain().lower,
            periodic: mesh.periodic(),
            constraints: Vec::new(),
            is_hanging: Vec::new(),
        };
        let mut index = PointIndex::new(map.lattice_extent, map.cell_nodes.capacity());
        for cell in mesh.cells() {
            map.touch(cell, finest, &mut index);
        }
        map.is_hanging = vec![false; map.lattice.len()];
        map.constrain(mesh);
        map
    }

    /// Polynomial degree, 1 or 2.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Number of nodes, hanging ones included.
    pub fn node_count(&self) -> usize {
        self.lattice.len()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cell_nodes.len() / self.nodes_per_cell
    }

    /// Nodes of a cell, `(degree+1)^D`.
    pub fn nodes_per_cell(&self) -> usize {
        self.nodes_per_cell
    }

    /// Node numbers of a cell, x fastest.
    pub fn cell(&self, cell: usize) -> &[u32] {
        &self.cell_nodes[cell * self.nodes_per_cell..(cell + 1) * self.nodes_per_cell]
    }

    /// Node numbers of successive cells.
    pub fn cells(&self, cells: std::ops::Range<usize>) -> &[u32] {
        &self.cell_nodes[cells.start * self.nodes_per_cell..cells.end * self.nodes_per_cell]
    }

    /// One more than the last node that these cells touch; zero for none. Nodes are numbered as cells touch
    /// them: those that the first cells are the first to touch end there.
    pub fn end_of(&self, cells: std::ops::Range<usize>) -> usize {
        self.cells(cells).iter().max().map_or(0, |&node| node as usize + 1)
    }

    /// Position of a node.
    pub fn point(&self, node: usize) -> Vector<D> {
        let x = &self.lattice[node];
        Vector::from_fn(|d, _| self.lower[d] + self.spacing * f64::from(x[d]))
    }

    /// Position of a node on the lattice of `degree` points a cell of the finest level.
    pub fn lattice_point(&self, node: usize) -> &[u32; D] {
        &self.lattice[node]
    }

    /// A number that stands for the position of a node, the same in every mesh of the box with this finest
    /// level.
    pub fn key(&self, node: usize) -> u64 {
        pack(&self.lattice[node])
    }

    /// Whether a node lies on a face of the box that is not periodic.
    pub fn is_on_boundary(&self, node: usize) -> bool {
        let x = &self.lattice[node];
        (0..D).any(|d| !self.periodic[d] && (x[d] == 0 || x[d] == self.lattice_extent[d]))
    }

    /// Whether the value of a node follows from others.
    pub fn is_hanging(&self, node: usize) -> bool {
        self.is_hanging[node]
    }

    /// The hanging nodes, each resolved to regular nodes.
    pub fn constraints(&self) -> &[Constraint] {
        &self.constraints
    }

    /// Sets every hanging node of a field with `N` interleaved components from its masters.
    pub fn distribute<T: Copy + std::ops::AddAssign + std::ops::Mul<Output = T>>(
        &self,
        components: usize,
        weight: impl Fn(f64) -> T,
        field: &mut [T],
    ) {
        for constraint in &self.constraints {
            let target = constraint.node as usize * components;
            for c in 0..components {
                let mut sum = weight(0.0);
                for &(master, w) in &constraint.masters {
                    sum += weight(w) * field[master as usize * components + c];
                }
                field[target + c] = sum;
            }
        }
    }

    /// The transpose of [`NodeMap::distribute`]: moves the load on hanging nodes to their masters.
    pub fn condense<T: Copy + std::ops::AddAssign + std::ops::Mul<Output = T>>(
        &self,
        components: usize,
        weight: impl Fn(f64) -> T,
        load: &mut [T],
    ) {
        for constraint in &self.constraints {
            let source = constraint.node as usize * components;
            for c in 0..components {
                let value = load[source + c];
                load[source + c] = weight(0.0);
                for &(master, w) in &constraint.masters {
                    load[master as usize * components + c] += weight(w) * value;
                }
            }
        }
    }

    /// Appends the nodes of a cell; `index` finds those that other cells have touched before by their lattice
    /// points.
    fn touch(&mut self, cell: &Cell<D>, finest: u8, index: &mut PointIndex<D>) {
        for i in 0..self.nodes_per_cell {
            let point = self.wrap(lattice_point(cell, self.degree, i, finest));
            let next = self.lattice.len() as u32;
            let node = index.find_or_insert(&point, next);
            if node == next {
                self.lattice.push(point);
            }
            self.cell_nodes.push(node);
        }
    }

    fn wrap(&self, mut point: [u32; D]) -> [u32; D] {
        for d in 0..D {
            if self.periodic[d] && point[d] == self.lattice_extent[d] {
                point[d] = 0;
            }
        }
        point
    }

    /// Finds the hanging nodes, coarsest constraining cell first, so that the masters are already resolved.
    fn constrain(&mut self, mesh: &TreeMesh<D>) {
        let mut coarse_of: Vec<(u8, u32, u32)> = Vec::new();
        let mut coarsest = vec![u8::MAX; self.node_count()];
        for (c, cell) in mesh.cells().iter().enumerate() {
            for offset in offsets::<D>() {
                let Some(coarse) = coarser_neighbour(mesh, cell, &offset) else { continue };
                let level = mesh.cells()[coarse].level;
                for i in self.nodes_facing(&offset) {
                    let node = self.cell(c)[i];
                    if level < coarsest[node as usize] {
                        coarsest[node as usize] = level;
                        coarse_of.push((level, node, coarse as u32));
                    }
                }
            }
        }
        coarse_of.retain(|&(level, node, _)| coarsest[node as usize] == level);
        coarse_of.sort_unstable();
        let mut resolved: FxHashMap<u32, usize> = FxHashMap::default();
        for (_, node, coarse) in coarse_of {
            if let Some(constraint) = self.constraint(mesh, node, coarse as usize, &resolved) {
                self.is_hanging[node as usize] = true;
                resolved.insert(node, self.constraints.len());
                self.constraints.push(constraint);
            }
        }
    }

    /// Local nodes of a cell that lie on the face, edge or corner in the direction `offset`.
    fn nodes_facing(&self, offset: &[i32; D]) -> Vec<usize> {
        let faces = |i: &usize| {
            let index = multi_index::<D>(*i, self.degree + 1);
            (0..D).all(|d| match offset[d] {
                -1 => index[d] == 0,
                1 => index[d] == self.degree,
                _ => true,
            })
        };
        (0..self.nodes_per_cell).filter(faces).collect()
    }

    /// The constraint of `node` by the coarse cell it touches; `None` if it is a node of that cell.
    fn constraint(
        &self,
        mesh: &TreeMesh<D>,
        node: u32,
        coarse: usize,
        resolved: &FxHashMap<u32, usize>,
    ) -> Option<Constraint> {
        if self.cell(coarse).contains(&node) {
            return None;
        }
        let local = self.local_coordinates(mesh, node as usize, &mesh.cells()[coarse]);
        let values: [[f64; 3]; D] = std::array::from_fn(|d| values_1d(self.degree, local[d]));
        let mut masters: Vec<(u32, f64)> = Vec::new();
        for (i, &master) in self.cell(coarse).iter().enumerate() {
            let index = multi_index::<D>(i, self.degree + 1);
            let weight: f64 = (0..D).map(|d| values[d][index[d]]).product();
            if weight == 0.0 {
                continue;
            }
            match resolved.get(&master) {
                Some(&k) => masters.extend(self.constraints[k].masters.iter().map(|&(m, w)| (m, w * weight))),
                None => masters.push((master, weight)),
            }
        }
        Some(Constraint { node, masters: merge(masters) })
    }

    /// Coordinates of a node in the unit cube of a cell, the nearest periodic image.
    fn local_coordinates(&self, mesh: &TreeMesh<D>, node: usize, cell: &Cell<D>) -> [f64; D] {
        let step = 1u32 << (mesh.max_level() - cell.level);
        let width = i64::from(self.degree as u32 * step);
        std::array::from_fn(|d| {
            let extent = i64::from(self.lattice_extent[d]);
            let mut shift = i64::from(self.lattice[node][d]) - i64::from(cell.coords[d]) * width;
            if self.periodic[d] && shift < 0 {
                shift += extent;
            }
            if self.periodic[d] && shift > width {
                shift -= extent;
            }
            shift as f64 / width as f64
        })
    }
}

/// The nodes at points of the lattice.
enum PointIndex<const D: usize> {
    /// By the place of a point in the box, [`NOWHERE`] where there is no node: in meshes that are nearly
    /// uniform.
    Dense { nodes: Vec<u32>, extent: [u32; D] },
    /// By the key of a point.
    Sparse(FxHashMap<u64, u32>),
}

/// Stands for no node.
const NOWHERE: u32 = u32::MAX;

impl<const D: usize> PointIndex<D> {
    /// For points of a box with this lattice, dense where that takes no more memory than the nodes of all
    /// cells.
    fn new(extent: [u32; D], most: usize) -> Self {
        let points = extent.iter().try_fold(1usize, |product, &n| product.checked_mul(n as usize + 1));
        match points.filter(|&points| points <= most) {
            Some(points) => Self::Dense { nodes: vec![NOWHERE; points], extent },
            None => Self::Sparse(FxHashMap::default()),
        }
    }

    /// The node at a point, which becomes `next` if there was none.
    fn find_or_insert(&mut self, point: &[u32; D], next: u32) -> u32 {
        match self {
            Self::Dense { nodes, extent } => {
                let along = |place: usize, d: usize| place * (extent[d] as usize + 1) + point[d] as usize;
                let node = &mut nodes[(0..D).rev().fold(0, along)];
                if *node == NOWHERE {
                    *node = next;
                }
                *node
            }
            Self::Sparse(nodes) => *nodes.entry(pack(point)).or_insert(next),
        }
    }
}

/// Lattice point of local node `i` of a cell.
fn lattice_point<const D: usize>(cell: &Cell<D>, degree: usize, i: usize, finest: u8) -> [u32; D] {
    let index = multi_index::<D>(i, degree + 1);
    std::array::from_fn(|d| (cell.coords[d] * degree as u32 + index[d] as u32) << (finest - cell.level))
}

fn pack<const D: usize>(point: &[u32; D]) -> u64 {
    point.iter().rev().fold(0, |key, &x| key << COORD_BITS | u64::from(x))
}

/// The leaf one level coarser that covers the neighbour of `cell` at `offset`.
fn coarser_neighbour<const D: usize>(mesh: &TreeMesh<D>, cell: &Cell<D>, offset: &[i32; D]) -> Option<usize> {
    if cell.level == 0 || offset.iter().all(|&o| o == 0) {
        return None;
    }
    let neighbour = mesh.neighbour(cell, offset)?;
    let parent = Cell { level: cell.level - 1, coords: neighbour.coords.map(|c| c >> 1) };
    mesh.find(&parent)
}

/// Sums the weights of equal masters, sorted by node.
fn merge(mut masters: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
    masters.sort_unstable_by_key(|m| m.0);
    masters.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 += next.1;
        }
        same
    });
    masters.retain(|m| m.1 != 0.0);
    masters
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_geom::Aabb;

    fn graded<const D: usize>(periodic: bool) -> TreeMesh<D> {
        let center = Vector::<D>::repeat(0.13);
        TreeMesh::refine(Aabb::unit(), [1; D], [periodic; D], 5, |lower, h, level| {
            level < 2 || (lower + Vector::repeat(0.5 * h) - center).norm() <= 1.2 * h
        })
        .unwrap()
    }

    /// A polynomial of the element's degree is continuous, so hanging nodes must reproduce it exactly.
    fn constraints_reproduce_polynomials<const D: usize>() {
        let mesh = graded::<D>(false);
        for degree in [1, 2] {
            let nodes = NodeMap::new(&mesh, degree);
            assert!(!nodes.constraints().is_empty());
            let f = |n: usize| {
                let x = nodes.point(n);
                (0..D).map(|d| 0.3 + (1.0 + d as f64) * x[d].powi(degree as i32)).product::<f64>()
            };
            let exact: Vec<f64> = (0..nodes.node_count()).map(f).collect();
            let mut field = exact.clone();
            for c in nodes.constraints() {
                field[c.node as usize] = f64::NAN;
                assert!(c.masters.iter().all(|m| !nodes.is_hanging(m.0 as usize)));
            }
            nodes.distribute(1, |w| w, &mut field);
            for n in 0..nodes.node_count() {
                assert!((field[n] - exact[n]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn hanging_nodes_reproduce_polynomials() {
        constraints_reproduce_polynomials::<2>();
        constraints_reproduce_polynomials::<3>();
    }

    fn condense_is_the_transpose<const D: usize>() {
        let nodes = NodeMap::new(&graded::<D>(true), 2);
        let n = nodes.node_count();
        let wave = |k: f64| (0..n).map(|i| (k * i as f64).sin()).collect::<Vec<f64>>();
        let (mut u, mut f) = (wave(0.7), wave(1.3));
        for c in nodes.constraints() {
            assert!((c.masters.iter().map(|m| m.1).sum::<f64>() - 1.0).abs() < 1e-13);
            u[c.node as usize] = 0.0;
        }
        let (before_u, before_f) = (u.clone(), f.clone());
        nodes.distribute(1, |w| w, &mut u);
        nodes.condense(1, |w| w, &mut f);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        assert!((dot(&u, &before_f) - dot(&before_u, &f)).abs() < 1e-10);
    }

    #[test]
    fn condensing_loads_is_the_transpose_of_distributing() {
        condense_is_the_transpose::<2>();
        condense_is_the_transpose::<3>();
    }

    #[test]
    fn periodic_faces_share_their_nodes() {
        let mesh = TreeMesh::<2>::uniform(Aabb::unit(), [1, 1], [true, false], 3).unwrap();
        let nodes = NodeMap::new(&mesh, 2);
        assert_eq!(nodes.node_count(), 16 * 17);
        assert_eq!((0..nodes.node_count()).filter(|&n| nodes.is_on_boundary(n)).count(), 32);
    }
}
