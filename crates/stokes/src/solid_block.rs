//! The stiff part of the penalised operator: its diagonal block around the solid.
//!
//! Every velocity is a field that is rigid on the nodes the solid touches, plus a field that vanishes away from them. The
//! first belongs to the hierarchy of rigid levels, which never sees the solid's viscosity. On the second the penalised
//! operator is a block `A_WW` that holds all of the contrast; [`SolidCycle`] answers for it, so that neither the viscosity
//! ratio nor slivers of solid in a cell are felt. The two are combined multiplicatively, block, rigid levels, block, with the
//! cycle or its first half as `C`:
//!
//! `z = E C E^T r`, `z += V (r - A z)`, `z += E C^T E^T (r - A z)`.
//!
//! A rigid motion costs the solid nothing, so what it leaves to the block needs the fluid's stress in the layer of cells
//! around the solid only: rounding errors of the motion are not multiplied by the solid's viscosity.

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_geom::{Dim, Space};
use gluey_linalg::vector;

use crate::assembly::assemble_viscous_on;
use crate::discretisation::{CellKind, Discretisation, cell_kind};
use crate::element::Elements;
use crate::error::StokesError;
use crate::level::nodes_of_cells_with;
use crate::node_matrix::NodeMatrix;
use crate::restricted::{Restricted, acting, add_at, gather};
use crate::solid_cycle::{Numbered, SolidCycle};
use crate::space::VelocitySpace;
use crate::system::{Penalty, StokesSystem, cell_operator, viscous_diagonal};

/// Cells in the radius of the largest body on a level of the cycle that is factorised in 3D, at most.
const FACTORISED_CELLS: f64 = 2.0;

/// The block with the layer of cells that couples it to the rest.
pub struct SolidBlock<const D: usize>
where
    Dim<D>: Space<D>,
{
    space: VelocitySpace<D>,
    cycle: SolidCycle<D>,
    /// The block's unknowns among the reduced velocities.
    positions: Vec<u32>,
    layer: Layer<D>,
    b: Vec<f64>,
    x: Vec<f64>,
    r: Vec<f64>,
    /// Nodal vectors with room for the twists of the rigid levels.
    velocity: Vec<f64>,
    load: Vec<f64>,
}

impl<const D: usize> SolidBlock<D>
where
    Dim<D>: Space<D>,
{
    /// The block around the nodes named in `touched`, which in `rigid` move with their bodies, the largest of which has the
    /// given radius. `meshes` are those of the coarser levels, coarsest first.
    pub fn new(
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        elements: &Elements<'_, D>,
        touched: &[Option<u32>],
        rigid: &VelocitySpace<D>,
        (radius, meshes): (f64, &[Discretisation<D>]),
    ) -> Result<Self, StokesError> {
        let nodes = &discretisation.velocity;
        let touched: Vec<bool> = touched.iter().map(Option::is_some).collect();
        // A ring of cells around the solid saves a third of the iterations; in 3D that does not pay for its factorisation.
        let around = nodes_of_cells_with(nodes, &touched);
        let is_factorised = |mesh: &Discretisation<D>| {
            D == 2 || radius <= FACTORISED_CELLS * mesh.mesh.size(mesh.mesh.max_level())
        };
        let (block, positions, cycle);
        if is_factorised(discretisation) || meshes.is_empty() {
            block = if D == 2 { around } else { touched };
            let assembled = assemble_viscous_on(discretisation, system, elements, |node| block[node])?;
            cycle = SolidCycle::factorised(&assembled.matrix, &assembled.blocks.minimum_degree()?)?;
            positions = assembled.unknowns.positions;
        } else {
            let is_free = |node: usize| system.space.is_free(node);
            let solid = Numbered::new(discretisation, |node| is_free(node) && touched[node]);
            let matrix = NodeMatrix::assembled(&solid, elements)?;
            let inside = (0..touched.len()).filter(|&n| is_free(n) && touched[n]);
            let ring = (0..touched.len()).filter(|&n| is_free(n) && around[n] && !touched[n]);
            let components = |n: usize| (n * D..(n + 1) * D).map(|k| k as u32);
            positions = inside.chain(ring).flat_map(components).collect();
            let acting = acting(discretisation, &system.cells, &around);
            // That of the fluid, which is all of it on nodes that the solid does not touch.
            let mut nodal = viscous_diagonal(discretisation, &acting);
            nodes.collect(D, |w| w * w, &mut nodal);
            let diagonal: Vec<f64> = positions.iter().map(|&k| nodal[k as usize]).collect();
            let cells = (&acting[..], system.cells.len());
            let penalty = system.penalty.as_ref();
            let operator = Restricted::new(discretisation, &system.space, cells, penalty, positions.clone());
            let smoothed = meshes.iter().rev().take_while(|mesh| !is_factorised(mesh)).count();
            let coarser = meshes.iter().rev().take(smoothed + 1);
            let contrast = penalty.map_or(1.0, Penalty::contrast);
            cycle = SolidCycle::new((operator, &diagonal), (solid, matrix), coarser, contrast)?;
            block = around;
        }
        let zeros = || vec![0.0; positions.len()];
        Ok(Self {
            space: system.space.clone(),
            layer: Layer::new(discretisation, system, &block, rigid),
            b: zeros(),
            x: zeros(),
            r: zeros(),
            cycle,
            positions,
            velocity: vec![0.0; rigid.dim()],
            load: vec![0.0; rigid.dim()],
        })
    }

    /// `z = M^-1 r` where `rigid_levels(f, u)` turns the nodal load `f` into the nodal velocities `u` of the rigid levels.
    pub fn apply(&mut self, r: &[f64], z: &mut [f64], mut rigid_levels: impl FnMut(&mut [f64], &mut [f64])) {
        let nodal = self.space.full_dim();
        gather(&self.positions, r, &mut self.b);
        self.cycle.descend(&self.b, &mut self.x);
        self.cycle.residual(&self.b, &self.x, &mut self.r);
        z.fill(0.0);
        add_at(&self.positions, &self.x, z);
        self.velocity[..nodal].copy_from_slice(z);
        self.space.nodes().distribute(D, |w| w, &mut self.velocity);
        self.layer.apply(&self.velocity, &mut self.load[..nodal]);
        vector::residual_from_product(&r[..nodal], &mut self.load[..nodal]);
        self.load[nodal..].fill(0.0);
        for (&k, &r) in self.positions.iter().zip(&self.r) {
            self.load[k as usize] = r;
        }

        rigid_levels(&mut self.load, &mut self.velocity);
        vector::axpy(1.0, &self.velocity[..nodal], z);
        self.space.project(z);
        self.layer.apply(&self.velocity, &mut self.load[..nodal]);
        gather(&self.positions, &self.load, &mut self.b);
        vector::residual_from_product(&self.r, &mut self.b);
        self.cycle.ascend(&self.b, &mut self.x);
        add_at(&self.positions, &self.x, z);
    }

    /// Applications of operators since the last call, each as its share of the mesh. Solves with factors and smoothing by
    /// patches do not count.
    pub fn take_applications(&mut self) -> f64 {
        self.cycle.take_applications()
            + std::mem::take(&mut self.layer.applications) as f64 * self.layer.share
    }
}

/// The cells that act on the block's nodes and do not move as one body. Those of them with solid in them are strained by
/// rigid motions, since bodies meet there.
struct Layer<const D: usize> {
    operator: CellOperator<f64, D>,
    work: Workspace<f64>,
    /// Fraction of all cells.
    share: f64,
    applications: usize,
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
        let strained = |cell: usize| {
            cell_kind(nodes.cell(cell).iter().map(|&n| rigid.body_of(n as usize))) != CellKind::Rigid
        };
        let mut cells = acting(discretisation, &system.cells, marked);
        cells.retain(|c| strained(c.cell as usize));
        Self {
            share: cells.len() as f64 / system.cells.len().max(1) as f64,
            operator: cell_operator(discretisation, &system.space, &cells, system.penalty.as_ref()),
            work: Workspace::default(),
            applications: 0,
        }
    }

    /// The reduced load of a velocity that fulfils the constraints, on free nodes.
    fn apply(&mut self, velocity: &[f64], load: &mut [f64]) {
        self.applications += 1;
        self.operator.viscous_of_field(velocity, load, &mut self.work);
    }
}
