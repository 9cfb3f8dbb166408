//! Stresses of a suspension.
//!
//! The mean stress over a periodic box of volume `V`, with the mean strain `E`, is
//!
//! `<sigma> = -<p> 1 + 2 eta E + (1/V) sum_b S_b`, `S_b = sym int (sigma.n) r dA`
//!
//! (Batchelor 1970, 10.1017/S0022112070000745), for rigid bodies on which nothing acts but the fluid. It does
//! the power that the flow dissipates, `<sigma>:E = Phi / V`, which is computed from the strains of the fluid
//! and the forces of films: another route to the viscosity.

use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss_cube, node_count};
use gluey_geom::{Dim, Matrix, Space, Vector};
use rayon::prelude::*;

use super::mean::{fluid_weights, mean_of};
use crate::formulation::Problem;
use crate::surface::{CellState, slope};

/// Gauss points per direction for products of strains in whole cells.
const STRAIN_POINTS: usize = 3;

/// What the bodies add to the stress, and the power that is dissipated.
#[derive(Clone, Debug, PartialEq)]
pub struct Stress<const D: usize> {
    /// `S_b` of the whole flow on the mesh, for each body. The pressure is relative to its mean over the
    /// fluid.
    pub moments: Vec<Matrix<D>>,
    /// The same of films too thin for the mesh.
    pub of_films: Vec<Matrix<D>>,
    /// `Phi`: power dissipated in the box.
    pub dissipation: f64,
    /// The share of films in that.
    pub dissipation_of_films: f64,
}

impl<const D: usize> Stress<D> {
    /// What the bodies add to the mean stress over a box of this volume.
    pub fn of_bodies(&self, volume: f64) -> Matrix<D> {
        self.moments.iter().chain(&self.of_films).sum::<Matrix<D>>() / volume
    }
}

/// Power that the fluid dissipates, `int 2 eta eps:eps`, in a nodal velocity field relative to a linear flow
/// with this strain.
pub fn dissipation<const D: usize>(problem: &Problem<D>, velocity: &[f64], strain: &Matrix<D>) -> f64
where
    Dim<D>: Space<D>,
{
    let Some(surfaces) = &problem.system.surfaces else { return 0.0 };
    let (discretisation, cut) = (problem.discretisation(), &surfaces.cut);
    let shear = discretisation.mesh.shear();
    let slopes = |points: usize| -> Vec<(f64, Vec<Vector<D>>)> {
        let of_point = |x: &[f64; D]| (0..node_count::<D>(2)).map(|i| slope(shear, i, x)).collect();
        gauss_cube::<D>(points).iter().map(|(x, weight)| (*weight, of_point(x))).collect()
    };
    let (whole, fine) = (slopes(STRAIN_POINTS), slopes(POINTS));
    let of_cell = |cell: usize| -> f64 {
        let weights = cut.cut(cell).map(|cut| &cut.moments.volume);
        if weights.is_none() && cut.states[cell] != CellState::Fluid {
            return 0.0;
        }
        let points = if weights.is_some() { &fine } else { &whole };
        let h = discretisation.cell_size(cell);
        let nodes = discretisation.velocity.cell(cell);
        let of_point = |(q, (weight, slopes)): (usize, &(f64, Vec<Vector<D>>))| {
            let mut twice = strain * (2.0 * h);
            for (&node, slope) in nodes.iter().zip(slopes) {
                let u = Vector::<D>::from_column_slice(&velocity[node as usize * D..][..D]);
                twice += u * slope.transpose() + slope * u.transpose();
            }
            weights.map_or(*weight, |weights| weights[q]) * twice.norm_squared()
        };
        0.5 * h.powi(D as i32 - 2) * points.iter().enumerate().map(of_point).sum::<f64>()
    };
    let cells: Vec<f64> = (0..cut.states.len()).into_par_iter().with_min_len(256).map(of_cell).collect();
    problem.system.viscosity() * cells.iter().sum::<f64>()
}

/// The mean pressure of the fluid.
pub fn mean_pressure<const D: usize>(problem: &Problem<D>, pressure: &[f64]) -> f64
where
    Dim<D>: Space<D>,
{
    let Some(surfaces) = &problem.system.surfaces else { return 0.0 };
    let discretisation = problem.discretisation();
    mean_of(&fluid_weights(discretisation, &discretisation.pressure, &surfaces.cut), pressure)
}
