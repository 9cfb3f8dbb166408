//! The mean velocity, where nothing fixes it.

use gluey_fem::NodeMap;
use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss_cube, multi_index, node_count, value};
use gluey_geom::Vector;
use rayon::prelude::*;

use crate::error::StokesError;
use crate::formulation::Problem;
use crate::space::{Discretisation, VelocitySpace};
use crate::surface::{CellState, CutCell, CutCells, SurfaceCoupling};

/// The mean over fluid and bodies of a velocity (nodal values, then twists) around surfaces. All ranks call
/// this.
pub fn mean_velocity<const D: usize>(
    problem: &Problem<D>,
    surfaces: &SurfaceCoupling<D>,
    velocity: &[f64],
) -> Result<Vector<D>, StokesError> {
    let discretisation = problem.discretisation();
    let weights = fluid_weights(discretisation, &discretisation.velocity, &surfaces.cut);
    let mut sum = Vector::<D>::zeros();
    for (weight, u) in weights.iter().zip(velocity.chunks_exact(D)) {
        sum += Vector::<D>::from_column_slice(u) * *weight;
    }
    let mut sums = vec![weights.iter().sum::<f64>()];
    sums.extend(sum.iter());
    discretisation.sum_over_ranks(&mut sums);
    let (mut volume, mut sum) = (sums[0], Vector::<D>::from_column_slice(&sums[1..]));
    // The bodies take what the fluid leaves of the box, in proportion to their volumes.
    let bodies = || problem.all_bodies.iter().map(gluey_levelset::Body::bounding_radius);
    let rest = discretisation.mesh.domain().extent().product() - volume;
    let all: f64 = bodies().map(|radius| radius.powi(D as i32)).sum();
    for (twist, radius) in problem.twists(velocity)?.iter().zip(bodies()) {
        let share = rest * radius.powi(D as i32) / all;
        sum += twist.velocity * share;
        volume += share;
    }
    Ok(sum / volume)
}

/// Takes `by` from the velocities of all bodies and of the nodes that are `moved`.
pub fn subtract<const D: usize>(
    space: &VelocitySpace<D>,
    velocity: &mut [f64],
    by: &Vector<D>,
    moved: impl Fn(usize) -> bool,
) {
    let (nodal, _) = velocity.split_at_mut(space.full_dim());
    for (_, u) in nodal.chunks_exact_mut(D).enumerate().filter(|(node, _)| moved(*node)) {
        (0..D).for_each(|c| u[c] -= by[c]);
    }
    for body in 0..space.body_count() {
        let mut twist = space.twist(velocity, body);
        twist.velocity -= by;
        space.set_twist(velocity, body, &twist);
    }
}

/// The mean of the pressure over the fluid. All ranks call this.
pub fn mean_pressure<const D: usize>(
    discretisation: &Discretisation<D>,
    cut: &CutCells<D>,
    pressure: &[f64],
) -> f64 {
    let weights = fluid_weights(discretisation, &discretisation.pressure, cut);
    let sum = weights.iter().zip(pressure).map(|(weight, p)| weight * p).sum::<f64>();
    let mut sums = [sum, weights.iter().sum::<f64>()];
    discretisation.sum_over_ranks(&mut sums);
    sums[0] / sums[1]
}

/// Nodes of a cell in 3D.
const MOST_NODES: usize = 27;

/// Integrals over the fluid of a cut cell, of volume one, of the functions with these values at its points.
fn integrals<const D: usize>(cut: &CutCell<D>, shapes: &[Vec<f64>]) -> [f64; MOST_NODES] {
    let mut sums = [0.0; MOST_NODES];
    for (weight, shapes) in cut.moments.volume.iter().zip(shapes) {
        sums.iter_mut().zip(shapes).for_each(|(sum, shape)| *sum += weight * shape);
    }
    sums
}

/// Integrals over the fluid of the own cells of the functions of degree 1 or 2.
fn fluid_weights<const D: usize>(
    discretisation: &Discretisation<D>,
    nodes: &NodeMap<D>,
    cut: &CutCells<D>,
) -> Vec<f64> {
    let degree = nodes.degree();
    let mut weights = vec![0.0; nodes.node_count()];
    let on_line: &[f64] = if degree == 2 { &[1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0] } else { &[0.5, 0.5] };
    let count = node_count::<D>(degree);
    let of_cube: Vec<f64> = (0..count)
        .map(|i| multi_index::<D>(i, degree + 1).into_iter().map(|k| on_line[k]).product())
        .collect();
    let shapes: Vec<Vec<f64>> = gauss_cube::<D>(POINTS)
        .iter()
        .map(|(x, _)| (0..count).map(|i| value::<D>(degree, i, x)).collect())
        .collect();
    let of_cut: Vec<[f64; MOST_NODES]> = cut.cells.par_iter().map(|cut| integrals(cut, &shapes)).collect();
    for cell in (0..nodes.cell_count()).filter(|&cell| discretisation.is_own(cell)) {
        let volume = discretisation.cell_size(cell).powi(D as i32);
        let of_cell = nodes.cell(cell).iter();
        if let Some(integrals) = of_cut.get(cut.place[cell] as usize) {
            of_cell.zip(integrals).for_each(|(&node, weight)| weights[node as usize] += volume * weight);
        } else if cut.states[cell] == CellState::Fluid {
            of_cell.zip(&of_cube).for_each(|(&node, weight)| weights[node as usize] += volume * weight);
        }
    }
    weights
}
