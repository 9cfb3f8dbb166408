//! The viscous operator as a sum over cells, its diagonal, and what comes to the viscosity of the fluid in
//! them.

use std::fmt::Debug;

use gluey_fem::ReferenceMatrices;
use gluey_fem::cells::{CellData, CellOperator, CellScalar};
use gluey_linalg::{BlockError, Jagged, parallel};

use crate::space::{ActiveCell, Discretisation, VelocitySpace};

/// A function that is called with a cell, a scale and the matrix that it is of, if it has its own.
pub type CellVisitor<'a> = dyn FnMut(u32, f64, Option<&[f64]>) + 'a;

/// A viscosity beside that of the fluid, which may vary inside cells: in one pass with the fluid.
pub trait AddedViscosity<const D: usize>: Debug + Send + Sync {
    /// The largest viscosity over that of the fluid.
    fn contrast(&self) -> f64;

    /// Its values in so many cells of a mesh.
    fn values(&self, cell_count: usize) -> CellViscosities;

    /// Calls `visit(cell, scale, matrix)` for every cell in which it is: its viscous matrix there is `scale`
    /// times the one given, or times that of the reference.
    fn for_each_matrix(&self, visit: &mut CellVisitor<'_>);

    /// What stands for the mass of the pressures over the viscosity in the cells in which that varies. A cell
    /// is given by `viscous`, `divergence` and `own` of its matrices `viscous K + own` and `divergence B`.
    ///
    /// # Errors
    /// [`BlockError`] if the viscosity of a cell is not positive.
    fn pressure_matrices(
        &self,
        cells: &mut dyn Iterator<Item = (f64, f64, Option<&[f64]>)>,
    ) -> Result<Vec<Option<Vec<f64>>>, BlockError>;
}

/// Viscosities in the cells of a mesh, times `h^(D-2)`.
pub struct CellViscosities {
    /// One value per cell.
    pub uniform: Vec<f64>,
    /// Values at the quadrature points of each cell in which they vary.
    pub points: Jagged<f64>,
    /// Gauss points per direction.
    pub quadrature: usize,
}

impl CellViscosities {
    /// The viscosity times `h^(D-2)` in all of a cell, and at its quadrature points if it varies.
    pub fn of(&self, cell: usize) -> (f64, &[f64]) {
        (self.uniform[cell], &self.points[cell])
    }
}

/// The diagonal of `A` in nodal velocities, as cells add it up: each with the multiple of the viscous
/// reference matrix and the matrix of its own that it has. Boundary, bodies and hanging nodes are nodes like
/// all others.
pub fn viscous_diagonal<'a, const D: usize>(
    discretisation: &Discretisation<D>,
    cells: impl Iterator<Item = (&'a ActiveCell, f64, Option<&'a [f64]>)>,
) -> Vec<f64> {
    let nodes = &discretisation.velocity;
    let viscous = discretisation.reference().viscous;
    let n = ReferenceMatrices::<D>::VELOCITY;
    let mut nodal = parallel::filled(0.0, nodes.node_count() * D);
    for (cell, scale, own) in cells {
        for (i, &node) in nodes.cell(cell.cell as usize).iter().enumerate() {
            for c in 0..D {
                let k = (i * D + c) * (n + 1);
                nodal[node as usize * D + c] += scale * viscous[k] + own.map_or(0.0, |own| own[k]);
            }
        }
    }
    nodal
}

/// The operator of these cells with what comes to the viscosity of the fluid.
pub fn cell_operator<T: CellScalar, const D: usize>(
    space: &VelocitySpace<D>,
    cells: &[ActiveCell],
    added: Option<&dyn AddedViscosity<D>>,
) -> CellOperator<T, D> {
    let discretisation = space.discretisation();
    let added = added.map(|added| added.values(discretisation.mesh.cell_count()));
    let data = cells.iter().map(|c| {
        let (uniform, points) = added.as_ref().map_or((0.0, &[][..]), |added| added.of(c.cell as usize));
        let viscous = c.viscous + uniform;
        CellData { cell: c.cell as usize, viscous, divergence: c.divergence, points }
    });
    let quadrature = added.as_ref().map_or(1, |added| added.quadrature);
    let ties = space.ties();
    CellOperator::new(&discretisation.chunks, space.nodes(), data, quadrature, &ties, space.body_count())
        .sheared(discretisation.mesh.shear())
}
