//! The viscous operator as a sum over cells, and its diagonal.

use gluey_fem::ReferenceMatrices;
use gluey_fem::cells::{CellData, CellOperator, CellScalar};
use gluey_geom::{Dim, Space};
use gluey_linalg::parallel;

use crate::solid::Penalty;
use crate::space::{ActiveCell, Discretisation, VelocitySpace};

/// The diagonal of `A` in nodal velocities, as cells add it up: each with the multiple of the viscous
/// reference matrix and the matrix of its own that it has. Boundary, bodies and hanging nodes are nodes like
/// all others.
pub fn viscous_diagonal<'a, const D: usize>(
    discretisation: &Discretisation<D>,
    cells: impl Iterator<Item = (&'a ActiveCell, f64, Option<&'a [f64]>)>,
) -> Vec<f64>
where
    Dim<D>: Space<D>,
{
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

/// The operator of these cells, with the penalised solid in one pass with the fluid.
pub fn cell_operator<T: CellScalar, const D: usize>(
    space: &VelocitySpace<D>,
    cells: &[ActiveCell],
    penalty: Option<&Penalty<D>>,
) -> CellOperator<T, D>
where
    Dim<D>: Space<D>,
{
    let discretisation = space.discretisation();
    let solid = penalty.map(|p| p.stress.viscosities(p.factor, discretisation.mesh.cell_count()));
    let data = cells.iter().map(|c| {
        let (interior, points) = solid.as_ref().map_or((0.0, &[][..]), |s| s.of(c.cell as usize));
        let viscous = c.viscous + interior;
        CellData { cell: c.cell as usize, viscous, divergence: c.divergence, points }
    });
    let quadrature = penalty.map_or(1, |p| p.stress.quadrature());
    let ties = space.ties();
    CellOperator::new(&discretisation.chunks, space.nodes(), data, quadrature, &ties, space.body_count())
        .sheared(discretisation.mesh.shear())
}
