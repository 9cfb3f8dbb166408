//! What a flow says at the nodes of its quadratic cells, for output, and what it took.

use gluey_fem::element::value;
use gluey_fem::{CellPoint, points_of_cells};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree};
#[cfg(feature = "paper")]
use gluey_levelset::{Ramp, ViscosityLaw};
use gluey_motion::{Fields, FlowStatistics};

use super::{Flow, FlowParams, PhaseTimes, RaisedPenalties};
use crate::formulation::Formulation;

impl<const D: usize> Flow<D> {
    /// Velocity, pressure, viscosity, level set and multiplier at the nodes of the own cells, of a flow with
    /// these parameters around these bodies. Where the box is periodic, the nodes of its far faces become
    /// points of their own. Cells of all ranks, in their order, are those of one process, each once; points
    /// on borders are points of every rank that has a cell there.
    pub fn fields(&self, balls: &[Ball<D>], params: &FlowParams) -> Fields<D> {
        let (mesh, balls) = (&self.discretisation, &BallTree::new(balls));
        let (points, cells) = points_of_cells(&mesh.mesh, &mesh.velocity, mesh.own_cells());
        let mut fields = Fields { cells, ..Fields::default() };
        points.iter().for_each(|point| push_point(&mut fields, self, balls, params, point));
        fields
    }

    /// Size and effort, with how penalties were raised for it.
    pub fn statistics(&self, raised: RaisedPenalties) -> FlowStatistics {
        let PhaseTimes { assembly, preparation, solve } = self.times;
        FlowStatistics {
            cell_count: self.discretisation.cell_count(),
            dof_count: self.discretisation.dof_count(),
            solve_count: self.solve_count,
            iteration_count: self.iteration_count,
            residual: self.residual,
            penalties_doubled: raised.doubled,
            cells_raised: raised.cells,
            solved_again: raised.solved_again,
            phases: vec![("mesh and assembly", assembly), ("solver set-up", preparation), ("solve", solve)],
        }
    }
}

fn push_point<const D: usize>(
    fields: &mut Fields<D>,
    flow: &Flow<D>,
    balls: &BallTree<'_, D>,
    params: &FlowParams,
    at: &CellPoint<D>,
) {
    let &CellPoint { cell, node, x, ref local } = at;
    let at_node = |field: &[f64]| match field.is_empty() {
        true => Vector::zeros(),
        false => Vector::from_fn(|d, _| field[node * D + d]),
    };
    let pressure = flow.discretisation.pressure.cell(cell).iter().enumerate();
    let pressure = pressure.map(|(q, &n)| value::<D>(1, q, local) * flow.pressure[n as usize]).sum();
    let alpha = balls.nearest(&x).map_or(f64::NEG_INFINITY, |b| b.1);
    fields.points.push(x);
    fields.velocity.push(at_node(&flow.velocity));
    fields.multiplier.push(at_node(&flow.multiplier));
    fields.pressure.push(pressure);
    fields.level_set.push(alpha);
    fields.viscosity.push(match params.formulation {
        Formulation::Unfitted { .. } => params.viscosity,
        #[cfg(feature = "paper")]
        Formulation::Paper(paper) => {
            let mesh = &flow.discretisation.mesh;
            let ramp = Ramp::new(paper.ramp * mesh.size(mesh.max_level()));
            let law = ViscosityLaw { fluid: params.viscosity, ratio: paper.viscosity_ratio };
            law.mix(ramp.fraction(alpha))
        }
    });
}
