//! Interpolation from the space of a coarse mesh to that of a finer one whose cells refine it.
//!
//! On a refined coarse cell the fine nodes form a grid of `2 degree + 1` points per direction, and
//! interpolation is the tensor product of one matrix of `2 degree + 1` rows. A fine node belongs to the
//! coarse cell that touches it first. Nodes are numbered in that order, so the nodes of a coarse cell are a
//! range, and all that is stored of a fine node is its place in the grid. On the part of a rank the fine
//! nodes are those that it owns.

use std::ops::Range;
use std::sync::Arc;

use gluey_linalg::{Jagged, parallel};
use rayon::prelude::*;

use super::nodes::NodeMap;
use crate::element::{multi_index, values_1d};
use crate::mesh::{Cell, Part, TreeMesh};

/// Place of a hanging node: its value follows from its masters.
const NOWHERE: u8 = u8::MAX;
/// Most values in the grid of a cell, `5^3` nodes with three components.
const GRID: usize = 375;

/// Interpolation of nodal values between a mesh and the mesh coarsened by one level, and its transpose.
#[derive(Clone, Debug)]
pub struct Interpolation<const D: usize> {
    coarse_nodes: Arc<NodeMap<D>>,
    /// The first coarse cell that fine nodes belong to; those below follow it.
    first_cell: usize,
    /// First fine node of each coarse cell, then their number.
    first: Vec<u32>,
    /// Place of each fine node in the grid of its coarse cell, or among its nodes where that is not refined.
    place: Vec<u8>,
    refined: Vec<bool>,
    line: Line,
    /// Loads on the nodes of each coarse cell, while threads share the restriction.
    loads: Vec<f32>,
    /// See [`incidence`].
    incidence: Jagged<u32>,
}

impl<const D: usize> Interpolation<D> {
    /// Interpolation between the spaces `coarse_nodes` on `coarse` and `fine_nodes` on `fine`.
    ///
    /// # Panics
    /// If `coarse` is not `fine`, [`TreeMesh::coarsened`] by one level.
    pub fn new(
        coarse: &TreeMesh<D>,
        coarse_nodes: impl Into<Arc<NodeMap<D>>>,
        fine: &TreeMesh<D>,
        fine_nodes: &NodeMap<D>,
    ) -> Self {
        let new = Self::on_cells(coarse, coarse_nodes.into(), 0, fine, fine_nodes, 0..fine.cell_count());
        let cell_count = new.refined.len();
        assert_eq!(
            cell_count,
            coarse.cell_count(),
            "every coarse cell is one fine cell or holds its children"
        );
        new
    }

    /// Interpolation between the parts of a rank: from all nodes of the coarse one to those nodes of the fine
    /// one that the rank owns.
    ///
    /// # Panics
    /// If `coarse` is not the part of the same rank on the mesh coarsened by one level.
    pub fn of_parts(
        coarse: &Part<D>,
        coarse_nodes: impl Into<Arc<NodeMap<D>>>,
        fine: &Part<D>,
        fine_nodes: &NodeMap<D>,
    ) -> Self {
        let first_cell = coarse.inner().start;
        Self::on_cells(&coarse.mesh, coarse_nodes.into(), first_cell, &fine.mesh, fine_nodes, fine.own())
    }

    /// To the nodes that `cells` of the fine mesh are the first to touch.
    fn on_cells(
        coarse: &TreeMesh<D>,
        coarse_nodes: Arc<NodeMap<D>>,
        first_cell: usize,
        fine: &TreeMesh<D>,
        fine_nodes: &NodeMap<D>,
        cells: Range<usize>,
    ) -> Self {
        let first_node = fine_nodes.end_of(0..cells.start);
        let mut new = Self {
            first_cell,
            first: Vec::new(),
            place: Vec::with_capacity(fine_nodes.end_of(0..cells.end) - first_node),
            refined: Vec::new(),
            line: Line::new(fine_nodes.degree()),
            loads: Vec::new(),
            incidence: Jagged::default(),
            coarse_nodes,
        };
        let mut covering = None;
        for c in cells {
            let cell = &fine.cells()[c];
            while !covering.is_some_and(|parent: &Cell<D>| parent == cell || is_child(cell, parent)) {
                let parent = &coarse.cells()[first_cell + new.refined.len()];
                new.refined.push(is_child(cell, parent));
                new.first.push(new.place.len() as u32);
                covering = Some(parent);
            }
            new.place_nodes(cell, fine_nodes, fine_nodes.cell(c), first_node);
        }
        new.first.push(new.place.len() as u32);
        new.incidence = incidence(&new.coarse_nodes, first_cell..first_cell + new.refined.len());
        new
    }

    /// Places the nodes of a fine cell that no cell before it touches.
    fn place_nodes(&mut self, cell: &Cell<D>, fine_nodes: &NodeMap<D>, nodes: &[u32], first_node: usize) {
        let refined = self.refined.last().is_some_and(|&refined| refined);
        let (degree, points) = (fine_nodes.degree(), self.line.points());
        for (i, &node) in nodes.iter().enumerate() {
            if (node as usize) < first_node + self.place.len() {
                continue;
            }
            debug_assert_eq!(
                node as usize,
                first_node + self.place.len(),
                "cells touch nodes in their order"
            );
            let index = multi_index::<D>(i, degree + 1);
            let along = |d: usize| index[d] + (cell.coords[d] & 1) as usize * degree;
            let in_grid = || (0..D).rev().fold(0, |place, d| place * points + along(d));
            let place = if refined { in_grid() } else { i };
            self.place.push(if fine_nodes.is_hanging(node as usize) { NOWHERE } else { place as u8 });
        }
    }

    /// Number of fine nodes, to which `fine` in [`Self::prolong`] and [`Self::restrict`] belongs.
    pub fn fine_count(&self) -> usize {
        self.place.len()
    }

    /// `fine = P coarse` for fields with `C <= 3` interleaved components; hanging nodes get zero.
    pub fn prolong<const C: usize>(&self, coarse: &[f32], fine: &mut [f32]) {
        self.prolong_cells::<C>(0..self.refined.len(), coarse, &mut fine[..self.fine_count() * C]);
    }

    /// `coarse = P^T fine` for fields with `C <= 3` interleaved components.
    pub fn restrict<const C: usize>(&mut self, fine: &[f32], coarse: &mut [f32]) {
        let coarse = &mut coarse[..self.coarse_nodes.node_count() * C];
        match (parallel::is_shared(fine.len()), self.line.degree) {
            (true, 1) => self.restrict_shared::<C, 1>(fine, coarse),
            (true, _) => self.restrict_shared::<C, 2>(fine, coarse),
            (false, 1) => self.restrict_serially::<C, 1>(fine, coarse),
            (false, _) => self.restrict_serially::<C, 2>(fine, coarse),
        }
    }

    /// The nodes of a range of cells are a range of `fine`: cut both in two until they are not worth sharing.
    fn prolong_cells<const C: usize>(&self, cells: Range<usize>, coarse: &[f32], fine: &mut [f32]) {
        if cells.len() < 2 || !parallel::is_shared(fine.len()) {
            return match self.line.degree {
                1 => self.prolong_serially::<C, 1>(cells, coarse, fine),
                _ => self.prolong_serially::<C, 2>(cells, coarse, fine),
            };
        }
        let middle = cells.start + cells.len() / 2;
        let (left, right) = fine.split_at_mut((self.first[middle] - self.first[cells.start]) as usize * C);
        rayon::join(
            || self.prolong_cells::<C>(cells.start..middle, coarse, left),
            || self.prolong_cells::<C>(middle..cells.end, coarse, right),
        );
    }

    fn prolong_serially<const C: usize, const DEGREE: usize>(
        &self,
        cells: Range<usize>,
        coarse: &[f32],
        fine: &mut [f32],
    ) {
        let start = self.first[cells.start] as usize;
        let (coarse, fine) = (coarse.as_chunks::<C>().0, fine.as_chunks_mut::<C>().0);
        let grids = &mut [[0.0; GRID]; 2];
        for cell in cells {
            for (value, &node) in grids[0].as_chunks_mut::<C>().0.iter_mut().zip(self.coarse_cell(cell)) {
                *value = coarse[node as usize];
            }
            let grid = if self.refined[cell] { self.expand::<C, DEGREE>(grids) } else { &grids[0] };
            let (range, grid) = (self.range(cell), grid.as_chunks::<C>().0);
            let fine = &mut fine[range.start - start..range.end - start];
            for (fine, &place) in fine.iter_mut().zip(&self.place[range]) {
                *fine = if place == NOWHERE { [0.0; C] } else { grid[place as usize] };
            }
        }
    }

    /// The nodes of a coarse cell.
    fn coarse_cell(&self, cell: usize) -> &[u32] {
        self.coarse_nodes.cell(self.first_cell + cell)
    }

    /// The fine nodes that belong to a coarse cell.
    fn range(&self, cell: usize) -> Range<usize> {
        self.first[cell] as usize..self.first[cell + 1] as usize
    }

    fn restrict_serially<const C: usize, const DEGREE: usize>(&self, fine: &[f32], coarse: &mut [f32]) {
        coarse.fill(0.0);
        let coarse = coarse.as_chunks_mut::<C>().0;
        let grids = &mut [[0.0; GRID]; 2];
        for cell in 0..self.refined.len() {
            let load = self.restrict_cell::<C, DEGREE>(cell, fine, grids).as_chunks::<C>().0;
            for (load, &node) in load.iter().zip(self.coarse_cell(cell)) {
                add(load, &mut coarse[node as usize]);
            }
        }
    }

    /// Loads on the nodes of one coarse cell from the fine nodes that belong to it.
    #[inline(always)]
    fn restrict_cell<'a, const C: usize, const DEGREE: usize>(
        &self,
        cell: usize,
        fine: &[f32],
        grids: &'a mut [[f32; GRID]; 2],
    ) -> &'a [f32; GRID] {
        grids[0][..(2 * DEGREE + 1).pow(D as u32) * C].fill(0.0);
        let (range, grid) = (self.range(cell), grids[0].as_chunks_mut::<C>().0);
        let fine = &fine.as_chunks::<C>().0[range.clone()];
        for (fine, &place) in fine.iter().zip(&self.place[range]) {
            if place != NOWHERE {
                grid[place as usize] = *fine;
            }
        }
        if self.refined[cell] { self.contract::<C, DEGREE>(grids) } else { &grids[0] }
    }

    /// Sums the loads on every node in the order of the cells, as they are without threads.
    fn restrict_shared<const C: usize, const DEGREE: usize>(&mut self, fine: &[f32], coarse: &mut [f32]) {
        let corners = self.coarse_nodes.nodes_per_cell() * C;
        let mut loads = std::mem::take(&mut self.loads);
        loads.resize(self.refined.len() * corners, 0.0);
        loads.par_chunks_exact_mut(corners).enumerate().with_min_len(64).for_each(|(cell, load)| {
            let grids = &mut [[0.0; GRID]; 2];
            load.copy_from_slice(&self.restrict_cell::<C, DEGREE>(cell, fine, grids)[..corners]);
        });
        coarse.par_chunks_exact_mut(C).enumerate().with_min_len(1024).for_each(|(node, sum)| {
            sum.fill(0.0);
            for &k in &self.incidence[node] {
                add(&loads[k as usize * C..][..C], sum);
            }
        });
        self.loads = loads;
    }

    /// From the nodes of a refined coarse cell to its grid.
    #[inline(always)]
    fn expand<'a, const C: usize, const DEGREE: usize>(
        &self,
        grids: &'a mut [[f32; GRID]; 2],
    ) -> &'a [f32; GRID] {
        for d in 0..D {
            let (inner, outer) = ((2 * DEGREE + 1).pow(d as u32) * C, (DEGREE + 1).pow((D - 1 - d) as u32));
            let (coarse, fine) = two(grids, d);
            self.line.expand::<DEGREE>(inner, outer, coarse, fine);
        }
        &grids[D % 2]
    }

    /// The transpose of [`Self::expand`].
    #[inline(always)]
    fn contract<'a, const C: usize, const DEGREE: usize>(
        &self,
        grids: &'a mut [[f32; GRID]; 2],
    ) -> &'a [f32; GRID] {
        for k in 0..D {
            let d = D - 1 - k;
            let (inner, outer) = ((2 * DEGREE + 1).pow(d as u32) * C, (DEGREE + 1).pow((D - 1 - d) as u32));
            let (fine, coarse) = two(grids, k);
            self.line.contract::<DEGREE>(inner, outer, fine, coarse);
        }
        &grids[D % 2]
    }
}

/// The grid that step `k` reads and the one it writes.
#[inline(always)]
fn two(grids: &mut [[f32; GRID]; 2], k: usize) -> (&[f32; GRID], &mut [f32; GRID]) {
    let [first, second] = grids;
    if k.is_multiple_of(2) { (first, second) } else { (second, first) }
}

fn is_child<const D: usize>(cell: &Cell<D>, parent: &Cell<D>) -> bool {
    cell.level == parent.level + 1 && cell.coords.map(|x| x >> 1) == parent.coords
}

fn add(load: &[f32], sum: &mut [f32]) {
    sum.iter_mut().zip(load).for_each(|(sum, load)| *sum += load);
}

/// Interpolation on a line: points `0, 2, ..` of the fine grid are coarse nodes, the others are weighted sums
/// of them.
#[derive(Clone, Debug)]
struct Line {
    degree: usize,
    /// Weights of the points `1, 3, ..`.
    weights: Vec<[f32; 3]>,
}

impl Line {
    fn new(degree: usize) -> Self {
        let at = |point: usize| values_1d(degree, point as f64 / (2 * degree) as f64).map(|w| w as f32);
        Self { degree, weights: (0..degree).map(|k| at(2 * k + 1)).collect() }
    }

    /// Fine points.
    fn points(&self) -> usize {
        2 * self.degree + 1
    }

    /// From nodes to points along one direction of a grid with `inner` values before it and `outer` after it.
    #[inline(always)]
    fn expand<const DEGREE: usize>(
        &self,
        inner: usize,
        outer: usize,
        coarse: &[f32; GRID],
        fine: &mut [f32; GRID],
    ) {
        let (nodes, points) = (DEGREE + 1, 2 * DEGREE + 1);
        for line in 0..outer {
            let from = &coarse[line * nodes * inner..][..nodes * inner];
            let to = &mut fine[line * points * inner..][..points * inner];
            for k in 0..nodes {
                to[2 * k * inner..][..inner].copy_from_slice(&from[k * inner..][..inner]);
            }
            for (k, weights) in self.weights[..DEGREE].iter().enumerate() {
                combine::<DEGREE>(weights, from, &mut to[(2 * k + 1) * inner..][..inner]);
            }
        }
    }

    /// The transpose of [`Line::expand`].
    #[inline(always)]
    fn contract<const DEGREE: usize>(
        &self,
        inner: usize,
        outer: usize,
        fine: &[f32; GRID],
        coarse: &mut [f32; GRID],
    ) {
        let (nodes, points) = (DEGREE + 1, 2 * DEGREE + 1);
        for line in 0..outer {
            let from = &fine[line * points * inner..][..points * inner];
            let to = &mut coarse[line * nodes * inner..][..nodes * inner];
            for k in 0..nodes {
                let node = &mut to[k * inner..][..inner];
                node.copy_from_slice(&from[2 * k * inner..][..inner]);
                for (point, weights) in self.weights[..DEGREE].iter().enumerate() {
                    let between = &from[(2 * point + 1) * inner..][..inner];
                    for i in 0..inner {
                        node[i] += weights[k] * between[i];
                    }
                }
            }
        }
    }
}

/// `sum = sum_k weights[k] rows[k]` for two or three rows.
#[inline(always)]
fn combine<const DEGREE: usize>(weights: &[f32; 3], rows: &[f32], sum: &mut [f32]) {
    let n = sum.len();
    for i in 0..n {
        sum[i] = weights[0] * rows[i] + weights[1] * rows[n + i];
        if DEGREE == 2 {
            sum[i] += weights[2] * rows[2 * n + i];
        }
    }
}

/// The places where each node occurs in the lists of these cells, ascending.
fn incidence<const D: usize>(nodes: &NodeMap<D>, cells: Range<usize>) -> Jagged<u32> {
    let listed = cells.flat_map(|cell| nodes.cell(cell));
    Jagged::grouped(nodes.node_count(), listed.zip(0u32..).map(|(&node, place)| (node as usize, place)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_geom::{Aabb, Vector};

    fn meshes<const D: usize>(periodic: bool) -> [(TreeMesh<D>, NodeMap<D>); 2] {
        let fine = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [periodic; D], 5, |lower, h, level| {
            level < 4 || (lower + Vector::repeat(0.5 * h) - Vector::repeat(0.3)).norm() <= 2.0 * h
        })
        .unwrap();
        [fine.coarsened(4), fine].map(|mesh| (mesh.clone(), NodeMap::new(&mesh, 2)))
    }

    fn interpolation_is_exact<const D: usize, const DEGREE: usize>() {
        let [coarse, fine] = meshes::<D>(false).map(|m| (NodeMap::new(&m.0, DEGREE), m.0));
        let interpolation = Interpolation::new(&coarse.1, coarse.0.clone(), &fine.1, &fine.0);
        let f = |x: Vector<D>| {
            (0..D).map(|d| 1.0 + x[d].powi(DEGREE as i32) - 0.3 * x[d]).product::<f64>() as f32
        };
        let u: Vec<f32> = (0..coarse.0.node_count()).map(|n| f(coarse.0.point(n))).collect();
        let mut v = vec![f32::NAN; fine.0.node_count()];
        interpolation.prolong::<1>(&u, &mut v);
        for n in 0..v.len() {
            let expected = if fine.0.is_hanging(n) { 0.0 } else { f(fine.0.point(n)) };
            assert!((v[n] - expected).abs() < 1e-5);
        }
    }

    #[test]
    fn interpolation_reproduces_polynomials() {
        interpolation_is_exact::<2, 1>();
        interpolation_is_exact::<2, 2>();
        interpolation_is_exact::<3, 1>();
        interpolation_is_exact::<3, 2>();
    }

    fn restriction_is_the_transpose<const D: usize>(periodic: bool) {
        let [(coarse, coarse_nodes), (fine, fine_nodes)] = meshes::<D>(periodic);
        let mut interpolation = Interpolation::new(&coarse, coarse_nodes.clone(), &fine, &fine_nodes);
        let wave = |n: usize, k: f32| (0..n * D).map(|i| (k * i as f32).sin()).collect::<Vec<f32>>();
        let (u, load) = (wave(coarse_nodes.node_count(), 0.7), wave(fine_nodes.node_count(), 1.1));
        let (mut v, mut collected) = (load.clone(), u.clone());
        interpolation.prolong::<D>(&u, &mut v);
        interpolation.restrict::<D>(&load, &mut collected);
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(&x, &y)| f64::from(x) * f64::from(y)).sum();
        let (one, other): (f64, f64) = (dot(&load, &v), dot(&collected, &u));
        assert!((one - other).abs() < 1e-5 * (v.len() as f64).sqrt(), "{one} {other}");
    }

    #[test]
    fn restriction_is_the_transpose_of_prolongation() {
        for periodic in [false, true] {
            restriction_is_the_transpose::<2>(periodic);
            restriction_is_the_transpose::<3>(periodic);
        }
    }

    #[test]
    fn threads_change_no_bit() {
        let [(coarse, coarse_nodes), (fine, fine_nodes)] = meshes::<3>(false);
        let interpolation = Interpolation::new(&coarse, coarse_nodes.clone(), &fine, &fine_nodes);
        assert!(fine_nodes.node_count() * 3 > 100_000, "long enough to be shared");
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut interpolation = interpolation.clone();
            pool.install(|| {
                let u: Vec<f32> =
                    (0..coarse_nodes.node_count() * 3).map(|i| (0.7 * i as f32).sin()).collect();
                let (mut v, mut back) = (vec![0.0; fine_nodes.node_count() * 3], vec![0.0; u.len()]);
                interpolation.prolong::<3>(&u, &mut v);
                interpolation.restrict::<3>(&v, &mut back);
                (v, back)
            })
        };
        let one = run(1);
        assert!(run(2) == one && run(4) == one);
    }
}
