//! The fields of a flow at the nodes of its quadratic cells, for output.

use gluey_fem::element::value;
use gluey_fem::{CellPoint, points_of_cells};
use gluey_geom::{Dim, Space, Vector};
use gluey_levelset::{Ball, BallTree, Ramp, ViscosityLaw};
use gluey_motion::Fields;
use gluey_stokes::{Discretisation, Flow, FlowParams, Formulation};

/// Evaluates velocity, pressure, viscosity, level set and multiplier at the nodes. Where the box is periodic,
/// the nodes of its far faces become points of their own.
pub fn fields<const D: usize>(flow: &Flow<D>, balls: &[Ball<D>], params: &FlowParams) -> Fields<D>
where
    Dim<D>: Space<D>,
{
    let Discretisation { mesh, velocity: nodes, .. } = &flow.discretisation;
    let balls = &BallTree::new(balls);
    let (points, cells) = points_of_cells(mesh, nodes, 0..mesh.cell_count());
    let mut fields = Fields { cells, ..Fields::default() };
    points.iter().for_each(|point| push_point(&mut fields, flow, balls, params, point));
    fields
}

fn push_point<const D: usize>(
    fields: &mut Fields<D>,
    flow: &Flow<D>,
    balls: &BallTree<'_, D>,
    params: &FlowParams,
    at: &CellPoint<D>,
) where
    Dim<D>: Space<D>,
{
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
    fields.viscosity.push(viscosity(flow, params, alpha));
}

fn viscosity<const D: usize>(flow: &Flow<D>, params: &FlowParams, alpha: f64) -> f64
where
    Dim<D>: Space<D>,
{
    match params.formulation {
        Formulation::Unfitted { .. } => params.viscosity,
        Formulation::Paper(paper) => {
            let mesh = &flow.discretisation.mesh;
            let ramp = Ramp::new(paper.ramp * mesh.size(mesh.max_level()));
            let law = ViscosityLaw { fluid: params.viscosity, ratio: paper.viscosity_ratio };
            law.mix(ramp.fraction(alpha))
        }
    }
}
