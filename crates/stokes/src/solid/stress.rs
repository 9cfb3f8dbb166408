//! The viscous stress of the penalised solid, `K(I eta_s)`.
//!
//! The mixing law `eta = I eta_s + (1 - I) eta_f` makes the viscous operator of the mixture the sum
//! `K(eta) = K(eta_f) + (1 - 1/r) K(I eta_s)`, so one solid serves the penalty and, as in eq. 9 of Verdon et
//! al. 2010, the multiplier. Cells wholly inside (`I = 1`) are scaled cubes; those with a ramp keep `I` at
//! enough Gauss points to see the surface.

use std::sync::Arc;

use gluey_fem::cells::{CellData, CellOperator, Workspace};
use gluey_fem::{Chunks, NodeMap};

use super::quadrature::PointMatrices;
use super::region::{SolidCell, SolidRegion};
use crate::space::Discretisation;

/// The viscous stress of the penalised solid and the factor it enters the operator with.
#[derive(Clone, Debug)]
pub struct Penalty<const D: usize> {
    /// `1 - 1/r`.
    pub factor: f64,
    /// `K(I eta_s)`.
    pub stress: SolidStress<D>,
}

impl<const D: usize> Penalty<D> {
    /// The ratio `r` of the viscosities of solid and fluid.
    pub fn contrast(&self) -> f64 {
        1.0 / (1.0 - self.factor)
    }
}

/// The operator `K(I eta_s)` on the velocity nodes of a mesh.
#[derive(Clone, Debug)]
pub struct SolidStress<const D: usize> {
    chunks: Arc<Chunks<D>>,
    cells: Arc<Vec<SolidCell>>,
    /// `eta_s h^(D-2)` of each cell.
    scales: Arc<Vec<f64>>,
    matrices: Arc<PointMatrices<D>>,
}

/// What the solid adds to the viscosities of cells.
pub struct SolidViscosities {
    uniform: Vec<f64>,
    /// Where the viscosities at the points of a cell start; `u32::MAX` for none.
    start: Vec<u32>,
    points: Vec<f64>,
    point_count: usize,
}

impl SolidViscosities {
    /// The viscosity times `h^(D-2)` that the solid adds in all of a cell, and at its quadrature points if it
    /// varies.
    pub fn of(&self, cell: usize) -> (f64, &[f64]) {
        let points = match self.start[cell] {
            u32::MAX => &[],
            start => &self.points[start as usize..][..self.point_count],
        };
        (self.uniform[cell], points)
    }
}

impl<const D: usize> SolidStress<D> {
    /// Gauss points a direction.
    pub fn quadrature(&self) -> usize {
        self.matrices.line()
    }

    /// `factor I eta_s h^(D-2)` in the cells of a mesh.
    pub fn viscosities(&self, factor: f64, cell_count: usize) -> SolidViscosities {
        let mut new = SolidViscosities {
            uniform: vec![0.0; cell_count],
            start: vec![u32::MAX; cell_count],
            points: Vec::new(),
            point_count: self.matrices.points().len(),
        };
        for (solid, scale) in self.cells.iter().zip(self.scales.iter()) {
            let scale = factor * scale;
            if solid.fraction.is_empty() {
                new.uniform[solid.cell as usize] = scale;
            } else {
                new.start[solid.cell as usize] = new.points.len() as u32;
                new.points.extend(solid.fraction.iter().map(|f| scale * f));
            }
        }
        new
    }

    /// Takes `K(I eta_s)` for `eta_s = solid_viscosity`.
    pub fn new(
        discretisation: &Discretisation<D>,
        region: &SolidRegion<D>,
        matrices: &Arc<PointMatrices<D>>,
        solid_viscosity: f64,
    ) -> Self {
        let scale =
            |c: &SolidCell| solid_viscosity * discretisation.cell_size(c.cell as usize).powi(D as i32 - 2);
        Self {
            chunks: discretisation.chunks.clone(),
            scales: Arc::new(region.cells.iter().map(scale).collect()),
            cells: region.cells.clone(),
            matrices: matrices.clone(),
        }
    }

    /// Number of solid cells that are not wholly inside.
    pub fn cut_cell_count(&self) -> usize {
        self.cells.iter().filter(|solid| !solid.fraction.is_empty()).count()
    }

    /// Calls `visit(cell, scale, matrix)` for every solid cell: interior ones have the matrix `scale * K`,
    /// cut ones their own, which is integrated for the visit.
    pub fn for_each_cell(&self, mut visit: impl FnMut(u32, f64, Option<&[f64]>)) {
        for (solid, &scale) in self.cells.iter().zip(self.scales.iter()) {
            match solid.fraction.is_empty() {
                true => visit(solid.cell, scale, None),
                false => visit(solid.cell, 1.0, Some(&self.matrices.matrix(scale, &solid.fraction))),
            }
        }
    }

    /// `y += K(I eta_s) x` for nodal velocities that fulfil the constraints, with the loads on hanging nodes
    /// moved to their masters.
    pub fn apply(&self, nodes: &NodeMap<D>, x: &[f64], y: &mut [f64]) {
        let viscosities = self.viscosities(1.0, nodes.cell_count());
        let data = self.cells.iter().map(|solid| {
            let (viscous, points) = viscosities.of(solid.cell as usize);
            CellData { cell: solid.cell as usize, viscous, divergence: 0.0, points }
        });
        let operator = CellOperator::<f64, D>::new(&self.chunks, nodes, data, self.quadrature(), &[], 0);
        let mut load = vec![0.0; operator.velocity_dim()];
        operator.viscous_of_field(x, &mut load, &mut Workspace::default());
        gluey_linalg::vector::axpy(1.0, &load, &mut y[..load.len()]);
    }
}
