//! The Stokes operator on cubic cells, matrix-free, in the reduced unknowns of a mesh.
//!
//! A chunk of cells is worked off in a buffer that stays in the cache: its nodal velocities and pressures are
//! read, rigid and hanging nodes set, cells taken as many at a time as a vector has lanes (`simd`), their
//! matrices applied in Legendre products (`legendre`), a viscosity that varies inside by quadrature
//! (`varying`), and the loads of hanging and rigid nodes moved to where they belong before the owned nodes
//! are written. No vector is passed over twice.
//!
//! Kernels are compiled for AVX-512, AVX2 and portably, and chosen at run time. Chunks run in parallel on the
//! current rayon pool; the results have the same bits for any number of threads.

mod buffers;
mod cut;
mod kernel;
mod legendre;
mod output;
mod partition;
mod rigid;
mod scalar;
mod simd;
mod sweep;
#[cfg(test)]
mod tests;
mod varying;

use std::sync::Arc;

pub use cut::{CutOperator, CutPiece};
pub use partition::{CHUNK_CELLS, Chunks};
pub use rigid::RigidNode;
pub use scalar::CellScalar;
pub use sweep::Workspace;

use gluey_linalg::Jagged;

use crate::element::node_count;
use crate::space::NodeMap;
use legendre::Coefficients;
use partition::LocalIndices;
use varying::PointRule;

/// Cells are padded to multiples of this, the largest number of lanes.
const GROUP: usize = 16;

/// A cell of the operator: the viscous matrix `viscous K + K(eta)` and the divergence `divergence B`.
#[derive(Clone, Copy, Debug)]
pub struct CellData<'a> {
    /// Index in the mesh.
    pub cell: usize,
    /// `eta h^(D-2)`.
    pub viscous: f64,
    /// `h^(D-1)`, or zero where the cell takes no part in the divergence.
    pub divergence: f64,
    /// More of `eta h^(D-2)` at each quadrature point, x fastest; empty where there is none.
    pub points: &'a [f64],
}

/// Cells of a chunk in the list of all cells: first those of uniform viscosity, then the others from a new
/// group on.
#[derive(Clone, Copy, Debug)]
struct Span {
    uniform: (u32, u32),
    varying: (u32, u32),
    /// First group of viscosities at points.
    first_points: u32,
}

/// The operator `[A, -B^T; -B, 0]` on some cells of a mesh, for vectors that hold the nodal velocities (`D`
/// interleaved components) and then the twist of each body, and nodal pressures.
#[derive(Clone, Debug)]
pub struct CellOperator<T, const D: usize> {
    chunks: Arc<Chunks<D>>,
    coefficients: Coefficients<T>,
    rule: PointRule<T>,
    spans: Vec<Span>,
    /// Local indices of the nodes of all cells, padded with one that no node has.
    locals: Vec<u16>,
    viscous: Vec<T>,
    divergence: Vec<T>,
    /// Viscosities at quadrature points, times weights: groups of cells, point by point.
    points: Vec<T>,
    /// Rigid nodes of the cells of each chunk; `node` is a local index, `body` the place in the list of
    /// bodies of the chunk.
    rigid_nodes: Jagged<RigidNode<T, D>>,
    bodies: Jagged<u32>,
    body_count: usize,
}

impl Span {
    fn is_empty(&self) -> bool {
        self.uniform.0 == self.uniform.1 && self.varying.0 == self.varying.1
    }
}

impl<T: CellScalar, const D: usize> CellOperator<T, D> {
    /// Unknowns of a body.
    const TWIST: usize = D + D * (D - 1) / 2;

    /// The operator on `cells`, in the order of the mesh, whose nodes in `rigid_nodes` move with `body_count`
    /// bodies. Viscosities that vary in a cell are given at `quadrature` Gauss points a direction.
    pub fn new<'a>(
        chunks: &Arc<Chunks<D>>,
        nodes: &NodeMap<D>,
        cells: impl Iterator<Item = CellData<'a>>,
        quadrature: usize,
        rigid_nodes: &[RigidNode<f64, D>],
        body_count: usize,
    ) -> Self {
        let mut new = Self {
            chunks: chunks.clone(),
            coefficients: Coefficients::new::<D>(),
            rule: PointRule::new::<D>(quadrature),
            spans: Vec::with_capacity(chunks.count()),
            locals: Vec::new(),
            viscous: Vec::new(),
            divergence: Vec::new(),
            points: Vec::new(),
            rigid_nodes: Jagged::default(),
            bodies: Jagged::default(),
            body_count,
        };
        let mut rigid_of = vec![u32::MAX; nodes.node_count()];
        for (k, rigid) in rigid_nodes.iter().enumerate() {
            rigid_of[rigid.node as usize] = k as u32;
        }
        let mut locals = LocalIndices::new(nodes.node_count());
        let mut cells = cells.peekable();
        let mut of_chunk = Vec::new();
        for chunk in 0..chunks.count() {
            let range = chunks.cells(chunk);
            of_chunk.clear();
            while let Some(cell) = cells.next_if(|c| range.contains(&c.cell)) {
                of_chunk.push(cell);
            }
            locals.set(&chunks.velocity, chunk);
            new.push_chunk(chunk, nodes, &of_chunk, &locals);
            new.push_rigid_nodes(chunk, if of_chunk.is_empty() { &[] } else { rigid_nodes }, &rigid_of);
        }
        debug_assert!(cells.next().is_none(), "cells come in the order of the mesh");
        new
    }

    /// The operator in cells that are sheared: a point of the unit cube has the place `x + shear y e_1`. Not
    /// for viscosities that vary in a cell.
    #[must_use]
    pub fn sheared(self, shear: f64) -> Self {
        debug_assert!(shear == 0.0 || self.points.is_empty(), "viscosities in sheared cells are uniform");
        Self { coefficients: self.coefficients.sheared::<D>(shear), ..self }
    }

    fn push_chunk(
        &mut self,
        chunk: usize,
        nodes: &NodeMap<D>,
        cells: &[CellData<'_>],
        locals: &LocalIndices,
    ) {
        let first_points = (self.points.len() / (GROUP * self.rule.weights.len())) as u32;
        let padding = self.chunks.local_count(chunk) as u16;
        let mut push = |varying: bool| {
            let start = self.viscous.len() as u32;
            for cell in cells.iter().filter(|c| c.points.is_empty() != varying) {
                self.locals.extend(nodes.cell(cell.cell).iter().map(|&n| locals.of(n)));
                self.viscous.push(T::from_f64(cell.viscous));
                self.divergence.push(T::from_f64(cell.divergence));
            }
            let end = self.viscous.len();
            let padded = end.next_multiple_of(GROUP);
            self.locals.resize(padded * node_count::<D>(2), padding);
            self.viscous.resize(padded, T::ZERO);
            self.divergence.resize(padded, T::ZERO);
            (start, end as u32)
        };
        let span = Span { uniform: push(false), varying: push(true), first_points };
        self.spans.push(span);
        let varying: Vec<&[f64]> = cells.iter().map(|c| c.points).filter(|p| !p.is_empty()).collect();
        for group in varying.chunks(GROUP) {
            for (q, &weight) in self.rule.weights.iter().enumerate() {
                let at = |lane: usize| group.get(lane).map_or(0.0, |points| weight * points[q]);
                self.points.extend((0..GROUP).map(|lane| T::from_f64(at(lane))));
            }
        }
    }

    /// Rigid nodes among those of a chunk.
    fn push_rigid_nodes(&mut self, chunk: usize, rigid_nodes: &[RigidNode<f64, D>], rigid_of: &[u32]) {
        let nodes = self.chunks.velocity.local_nodes(chunk).zip(0u32..);
        let rigid: Vec<(u32, RigidNode<f64, D>)> = nodes
            .filter_map(|(node, local)| {
                rigid_nodes.get(rigid_of[node as usize] as usize).map(|&rigid| (local, rigid))
            })
            .collect();
        let mut bodies: Vec<u32> = rigid.iter().map(|t| t.1.body).collect();
        bodies.sort_unstable();
        bodies.dedup();
        self.rigid_nodes.push(rigid.iter().map(|(local, rigid)| RigidNode {
            node: *local,
            body: bodies.partition_point(|&b| b < rigid.body) as u32,
            arm: rigid.arm.map(T::from_f64),
        }));
        self.bodies.push(bodies);
    }

    /// Length of a velocity vector.
    pub fn velocity_dim(&self) -> usize {
        self.chunks.velocity.node_count() * D + self.body_count * Self::TWIST
    }

    /// Length of a pressure vector.
    pub fn pressure_dim(&self) -> usize {
        self.chunks.pressure.node_count()
    }
}
