//! Stresses of a suspension.
//!
//! The mean stress over a periodic box of volume `V`, with the mean strain `E`, is
//!
//! `<sigma> = -<p> 1 + 2 eta E + (1/V) sum_b S_b`, `S_b = sym int (sigma.n) r dA`
//!
//! (Batchelor 1970, 10.1017/S0022112070000745), for rigid bodies on which nothing acts but the fluid. It does
//! the power that the flow dissipates, `<sigma>:E = Phi / V`, which is computed from the strains of the fluid
//! and the forces of films: another route to the viscosity.

use gluey_geom::{Dim, Matrix, Space};
use rayon::prelude::*;

use super::mean::{fluid_weights, mean_of};
use crate::formulation::Problem;
use crate::surface::StrainEnergy;

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

/// Power that the fluid of the own cells dissipates, `int 2 eta eps:eps`, in a nodal velocity field relative
/// to a linear flow with this strain.
pub fn dissipation<const D: usize>(problem: &Problem<D>, velocity: &[f64], strain: &Matrix<D>) -> f64
where
    Dim<D>: Space<D>,
{
    let Some(surfaces) = problem.system.surfaces() else { return 0.0 };
    let cut = &surfaces.cut;
    let energy = StrainEnergy::new(problem.discretisation(), cut);
    let of_cell = |cell: usize| match problem.discretisation().is_own(cell) {
        true => energy.in_cell(cell, velocity, strain),
        false => 0.0,
    };
    let cells: Vec<f64> = (0..cut.states.len()).into_par_iter().with_min_len(256).map(of_cell).collect();
    problem.system.viscosity() * cells.iter().sum::<f64>()
}

/// The mean pressure of the fluid.
pub fn mean_pressure<const D: usize>(problem: &Problem<D>, pressure: &[f64]) -> f64
where
    Dim<D>: Space<D>,
{
    let Some(surfaces) = problem.system.surfaces() else { return 0.0 };
    let discretisation = problem.discretisation();
    mean_of(&fluid_weights(discretisation, &discretisation.pressure, &surfaces.cut), pressure)
}
