//! The stiff part of the penalised operator: its diagonal block around the solid, solved directly.
//!
//! Every velocity is a field that is rigid on the nodes the solid touches, plus a field that vanishes away from them. The
//! first belongs to the hierarchy of rigid levels, which never sees the solid's viscosity. On the second the penalised
//! operator is a block `A_WW` that holds all of the contrast; it is factorised, so that neither the viscosity ratio nor
//! slivers of solid in a cell are felt. The two are combined multiplicatively, block, rigid levels, block:
//!
//! `z = E A_WW^-1 E^T r`, `z += V (r - A z)`, `z += E A_WW^-1 E^T (r - A z)`.
//!
//! A rigid motion costs the solid nothing and the block is solved exactly, so the residuals between the steps need the
//! fluid's stress in the layer of cells around the solid only: no matrix of a solid cell is ever applied.

use std::sync::Arc;

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_geom::{Dim, Space};
use gluey_linalg::{DirectSpd, Ordering, Preconditioner, RefinementParams, Symbolic, vector};

use crate::assembly::{Unknowns, assemble_viscous_on};
use crate::discretisation::{CellKind, Discretisation, cell_kind};
use crate::error::StokesError;
use crate::level::{cells_touching, nodes_of_cells_with};
use crate::space::VelocitySpace;
use crate::system::{StokesSystem, cell_operator};

/// The factorised block with the layer of cells that couples it to the rest.
pub struct SolidBlock<const D: usize>
where
    Dim<D>: Space<D>,
{
    space: VelocitySpace<D>,
    factor: DirectSpd,
    unknowns: Unknowns,
    layer: Layer<D>,
    b: Vec<f64>,
    x: Vec<f64>,
    /// Nodal vectors with room for the twists of the rigid levels.
    velocity: Vec<f64>,
    load: Vec<f64>,
    applications: usize,
}

impl<const D: usize> SolidBlock<D>
where
    Dim<D>: Space<D>,
{
    /// The block around the nodes named in `touched`, which in `rigid` move with their bodies.
    pub fn new(
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        touched: &[Option<u32>],
        rigid: &VelocitySpace<D>,
    ) -> Result<Self, StokesError> {
        let nodes = &discretisation.velocity;
        let mut marked: Vec<bool> = touched.iter().map(Option::is_some).collect();
        if D == 2 {
            // An overlap saves a third of the iterations; in 3D that does not pay for its factorisation.
            marked = nodes_of_cells_with(nodes, &marked);
        }
        let assembled = assemble_viscous_on(discretisation, system, |node| marked[node])?;
        let order = assembled.blocks.minimum_degree()?;
        let symbolic = Symbolic::new(assembled.matrix.pattern().clone(), Ordering::Custom(&order))?;
        let mut factor = DirectSpd::new(Arc::new(symbolic), RefinementParams::default())?;
        factor.factorise(assembled.matrix.values())?;
        let count = assembled.unknowns.positions.len();
        Ok(Self {
            space: system.space.clone(),
            factor,
            unknowns: assembled.unknowns,
            layer: Layer::new(discretisation, system, &marked, rigid),
            b: vec![0.0; count],
            x: vec![0.0; count],
            velocity: vec![0.0; rigid.dim()],
            load: vec![0.0; rigid.dim()],
            applications: 0,
        })
    }

    /// `z = M^-1 r` where `rigid_levels(f, u)` turns the nodal load `f` into the nodal velocities `u` of the rigid levels.
    pub fn apply(&mut self, r: &[f64], z: &mut [f64], mut rigid_levels: impl FnMut(&mut [f64], &mut [f64])) {
        let nodal = self.space.full_dim();
        z.fill(0.0);
        self.unknowns.gather(r, &mut self.b);
        self.solve(z);
        self.velocity[..nodal].copy_from_slice(z);
        self.space.nodes().distribute(D, |w| w, &mut self.velocity);
        self.apply_layer();
        for (load, r) in self.load.iter_mut().zip(r) {
            *load = r - *load;
        }
        self.unknowns.positions.iter().for_each(|&k| self.load[k as usize] = 0.0);

        rigid_levels(&mut self.load, &mut self.velocity);
        vector::axpy(1.0, &self.velocity[..nodal], z);
        self.space.project(z);
        self.apply_layer();
        self.unknowns.gather(&self.load[..nodal], &mut self.b);
        vector::scale(-1.0, &mut self.b);
        self.solve(z);
    }

    /// Applications of the layer since the last call, each as its share of the mesh. Solves with the factor do not count.
    pub fn take_applications(&mut self) -> f64 {
        std::mem::take(&mut self.applications) as f64 * self.layer.share
    }

    /// `z_W += A_WW^-1 b`.
    fn solve(&mut self, z: &mut [f64]) {
        self.factor.apply(&self.b, &mut self.x);
        for (x, &k) in self.x.iter().zip(&self.unknowns.positions) {
            z[k as usize] += x;
        }
    }

    /// The reduced load of the velocity on free nodes.
    fn apply_layer(&mut self) {
        let nodal = self.space.full_dim();
        let Layer { operator, work, .. } = &mut self.layer;
        let (load, twists) = self.load.split_at_mut(nodal);
        operator.viscous_of_field(&self.velocity, load, work);
        twists.fill(0.0);
        self.applications += 1;
    }
}

/// The cells that act on the block's nodes and do not move as one body. Those of them with solid in them are strained by
/// rigid motions, since bodies meet there.
struct Layer<const D: usize> {
    operator: CellOperator<f64, D>,
    work: Workspace<f64>,
    /// Fraction of all cells.
    share: f64,
}

impl<const D: usize> Layer<D>
where
    Dim<D>: Space<D>,
{
    fn new(
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        marked: &[bool],
        rigid: &VelocitySpace<D>,
    ) -> Self {
        let nodes = &discretisation.velocity;
        let acts = cells_touching(nodes, marked);
        let strained = |cell: usize| {
            cell_kind(nodes.cell(cell).iter().map(|&n| rigid.body_of(n as usize))) != CellKind::Rigid
        };
        let mut cells = system.cells.clone();
        cells.retain(|c| acts[c.cell as usize] && strained(c.cell as usize));
        Self {
            share: cells.len() as f64 / system.cells.len().max(1) as f64,
            operator: cell_operator(discretisation, &system.space, &cells, system.penalty.as_ref()),
            work: Workspace::default(),
        }
    }
}
