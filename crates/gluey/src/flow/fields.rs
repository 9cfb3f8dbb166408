//! The fields of a flow at the nodes of its quadratic cells, for output.

use std::collections::BTreeMap;

use gluey_fem::element::{multi_index, value};
use gluey_geom::{Dim, Space, Vector};
use gluey_levelset::{Ball, BallTree, Ramp, ViscosityLaw};
use gluey_motion::Fields;
use gluey_stokes::{Flow, FlowParams, Formulation};

/// Evaluates velocity, pressure, viscosity, level set and multiplier at the nodes. Where the box is periodic,
/// the nodes of its far faces become points of their own.
pub fn fields<const D: usize>(flow: &Flow<D>, balls: &[Ball<D>], params: &FlowParams) -> Fields<D>
where
    Dim<D>: Space<D>,
{
    let mesh = &flow.discretisation.mesh;
    let nodes = &flow.discretisation.velocity;
    let balls = &BallTree::new(balls);
    let mut fields = Fields::default();
    let mut point_of: BTreeMap<(u32, [bool; D]), u32> = BTreeMap::new();
    for (index, cell) in mesh.cells().iter().enumerate() {
        let (lower, h) = (mesh.lower_corner(cell), mesh.size(cell.level));
        for (i, &node) in nodes.cell(index).iter().enumerate() {
            let local = multi_index::<D>(i, 3).map(|k| 0.5 * k as f64);
            let x = lower + Vector::from_fn(|d, _| h * local[d]);
            let wrapped = std::array::from_fn(|d| (x[d] - nodes.point(node as usize)[d]).abs() > 0.25 * h);
            let next = fields.points.len() as u32;
            let point = *point_of.entry((node, wrapped)).or_insert(next);
            if point == next {
                let at = Point { cell: index, node: node as usize, x, local };
                push_point(&mut fields, flow, balls, params, &at);
            }
            fields.cells.push(point);
        }
    }
    fields
}

/// A node of a cell where fields are written.
struct Point<const D: usize> {
    cell: usize,
    node: usize,
    x: Vector<D>,
    /// Its coordinates in the cell, from 0 to 1.
    local: [f64; D],
}

fn push_point<const D: usize>(
    fields: &mut Fields<D>,
    flow: &Flow<D>,
    balls: &BallTree<'_, D>,
    params: &FlowParams,
    at: &Point<D>,
) where
    Dim<D>: Space<D>,
{
    let &Point { cell, node, x, ref local } = at;
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
        Formulation::RigidDofs { .. } | Formulation::Unfitted { .. } => params.viscosity,
        Formulation::Paper(paper) => {
            let mesh = &flow.discretisation.mesh;
            let ramp = Ramp::new(paper.ramp * mesh.size(mesh.max_level()));
            let law = ViscosityLaw { fluid: params.viscosity, ratio: paper.viscosity_ratio };
            law.mix(ramp.fraction(alpha))
        }
    }
}
