//! The mean velocity, where nothing fixes it.

use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss_cube, multi_index, node_count, value};
use gluey_geom::{Dim, Space, Vector};

use crate::formulation::Problem;
use crate::surface::{CellState, CutCells};

/// Takes from a velocity (nodal values, then twists) its mean over fluid and bodies.
pub fn remove_mean<const D: usize>(problem: &Problem<D>, velocity: &mut [f64])
where
    Dim<D>: Space<D>,
{
    let Some(surfaces) = &problem.system.surfaces else { return };
    let space = &problem.system.space;
    let weights = weights(problem, &surfaces.cut);
    let (mut volume, mut sum) = (weights.iter().sum::<f64>(), Vector::<D>::zeros());
    for (weight, u) in weights.iter().zip(velocity.chunks_exact(D)) {
        sum += Vector::<D>::from_column_slice(u) * *weight;
    }
    // The bodies take what the fluid leaves of the box, in proportion to their volumes.
    let bodies = || problem.bodies.iter().map(gluey_levelset::Body::bounding_radius);
    let rest = problem.discretisation().mesh.domain().extent().product() - volume;
    let all: f64 = bodies().map(|radius| radius.powi(D as i32)).sum();
    for (body, radius) in bodies().enumerate() {
        let share = rest * radius.powi(D as i32) / all;
        sum += space.twist(velocity, body).velocity * share;
        volume += share;
    }
    let mean = sum / volume;
    let nodal = space.full_dim();
    for u in velocity[..nodal].chunks_exact_mut(D) {
        (0..D).for_each(|c| u[c] -= mean[c]);
    }
    for body in 0..problem.bodies.len() {
        let mut twist = space.twist(velocity, body);
        twist.velocity -= mean;
        space.set_twist(velocity, body, &twist);
    }
}

/// Integrals of the velocity functions over the fluid.
fn weights<const D: usize>(problem: &Problem<D>, cut: &CutCells<D>) -> Vec<f64>
where
    Dim<D>: Space<D>,
{
    let discretisation = problem.discretisation();
    let nodes = &discretisation.velocity;
    let mut weights = vec![0.0; nodes.node_count()];
    let simpson = [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0];
    let of_cube: Vec<f64> = (0..node_count::<D>(2))
        .map(|i| multi_index::<D>(i, 3).into_iter().map(|k| simpson[k]).product())
        .collect();
    let shapes: Vec<Vec<f64>> = gauss_cube::<D>(POINTS)
        .iter()
        .map(|(x, _)| (0..node_count::<D>(2)).map(|i| value::<D>(2, i, x)).collect())
        .collect();
    for cell in 0..nodes.cell_count() {
        let volume = discretisation.cell_size(cell).powi(D as i32);
        let of_cell = nodes.cell(cell).iter();
        if let Some(cut) = cut.cut(cell) {
            for (i, &node) in of_cell.enumerate() {
                let terms = cut.moments.volume.iter().zip(&shapes).map(|(weight, shapes)| weight * shapes[i]);
                weights[node as usize] += volume * terms.sum::<f64>();
            }
        } else if cut.states[cell] == CellState::Fluid {
            of_cell.zip(&of_cube).for_each(|(&node, weight)| weights[node as usize] += volume * weight);
        }
    }
    weights
}
