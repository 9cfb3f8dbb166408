//! The viscous stress of the penalised solid, `K(I eta_s)`.
//!
//! The mixing law `eta = I eta_s + (1 - I) eta_f` makes the viscous operator of the mixture the sum
//! `K(eta) = K(eta_f) + (1 - 1/r) K(I eta_s)`, so one solid serves the penalty and, as in eq. 9 of Verdon et
//! al. 2010, the multiplier. Cells wholly inside (`I = 1`) are scaled cubes; those with a ramp keep `I` at
//! enough Gauss points to see the surface.

use std::sync::Arc;

use gluey_fem::cells::{CellData, CellOperator, Workspace};
use gluey_fem::{Chunks, NodeMap};
use gluey_linalg::BlockError;

use super::pressures::pressure_matrices;
use super::quadrature::PointMatrices;
use super::region::{SolidCell, SolidRegion};
use crate::operator::{AddedViscosity, CellViscosities, CellVisitor};
use crate::space::Discretisation;

/// The viscous stress of the penalised solid and the factor it enters the operator with.
#[derive(Clone, Debug)]
pub struct Penalty<const D: usize> {
    /// `1 - 1/r`.
    pub factor: f64,
    /// `K(I eta_s)`.
    pub stress: SolidStress<D>,
}

impl<const D: usize> AddedViscosity<D> for Penalty<D> {
    /// The ratio `r` of the viscosities of solid and fluid.
    fn contrast(&self) -> f64 {
        1.0 / (1.0 - self.factor)
    }

    fn values(&self, cell_count: usize) -> CellViscosities {
        self.stress.viscosities(self.factor, cell_count)
    }

    /// Cells wholly inside have a multiple of the reference; for cut ones the matrix is integrated.
    fn for_each_matrix(&self, visit: &mut CellVisitor<'_>) {
        let SolidStress { cells, scales, matrices, .. } = &self.stress;
        for (solid, &scale) in cells.iter().zip(scales.iter()) {
            match solid.fraction.is_empty() {
                true => visit(solid.cell, self.factor * scale, None),
                false => visit(solid.cell, self.factor, Some(&matrices.matrix(scale, &solid.fraction))),
            }
        }
    }

    fn pressure_matrices(
        &self,
        cells: &mut dyn Iterator<Item = (f64, f64, Option<&[f64]>)>,
    ) -> Result<Vec<Option<Vec<f64>>>, BlockError> {
        pressure_matrices::<D>(cells)
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

impl<const D: usize> SolidStress<D> {
    /// `factor I eta_s h^(D-2)` in the cells of a mesh.
    fn viscosities(&self, factor: f64, cell_count: usize) -> CellViscosities {
        let mut uniform = vec![0.0; cell_count];
        let mut solid = self.cells.iter().zip(self.scales.iter()).peekable();
        let points = uniform.iter_mut().enumerate().map(|(cell, uniform)| {
            let here = solid.next_if(|(solid, _)| solid.cell as usize == cell);
            let (fraction, scale) =
                here.map_or((&[][..], 0.0), |(solid, scale)| (solid.fraction.as_slice(), factor * scale));
            if fraction.is_empty() {
                *uniform = scale;
            }
            fraction.iter().map(move |f| scale * f)
        });
        let points = points.collect();
        CellViscosities { uniform, points, quadrature: self.matrices.line() }
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

    /// The operator, ready to be applied.
    pub fn operator(&self, nodes: &NodeMap<D>) -> SolidOperator<D> {
        let viscosities = self.viscosities(1.0, nodes.cell_count());
        let data = self.cells.iter().map(|solid| {
            let (viscous, points) = viscosities.of(solid.cell as usize);
            CellData { cell: solid.cell as usize, viscous, divergence: 0.0, points }
        });
        let operator = CellOperator::new(&self.chunks, nodes, data, viscosities.quadrature, &[], 0);
        SolidOperator { operator, work: Workspace::default() }
    }
}

/// `K(I eta_s)` with the workspace to apply it.
pub struct SolidOperator<const D: usize> {
    operator: CellOperator<f64, D>,
    work: Workspace<f64>,
}

impl<const D: usize> SolidOperator<D> {
    /// `y = K(I eta_s) x` for nodal velocities that fulfil the constraints, with the loads on hanging nodes
    /// moved to their masters.
    pub fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.operator.viscous_of_field(x, y, &mut self.work);
    }
}
