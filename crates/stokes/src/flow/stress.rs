//! Stresses of a suspension.
//!
//! The mean stress over a periodic box of volume `V`, with the mean strain `E`, is
//!
//! `<sigma> = -<p> 1 + 2 eta E + (1/V) sum_b S_b`, `S_b = sym int (sigma.n) r dA`
//!
//! (Batchelor 1970, 10.1017/S0022112070000745), for rigid bodies on which nothing acts but the fluid. It does
//! the power that the flow dissipates, `<sigma>:E = Phi / V`, which is computed from the strains of the fluid
//! and the forces of films: another route to the viscosity.

use gluey_geom::Matrix;
use rayon::prelude::*;

use super::mean::mean_pressure;
use crate::error::StokesError;
use crate::film::FilmForce;
use crate::formulation::{Problem, symmetric};
use crate::surface::{CutCells, StrainEnergy};

/// The share of the bodies in the stress, and the power that is dissipated.
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

/// The stress of a flow: its velocity, nodal and of bodies, and pressure, and the reduced vector. All ranks
/// call this.
///
/// # Errors
/// [`StokesError::Unsupported`] but around surfaces.
pub fn stress_of<const D: usize>(
    problem: &Problem<D>,
    strain: &Matrix<D>,
    [velocity, pressure]: [&[f64]; 2],
    x: &[f64],
) -> Result<Stress<D>, StokesError> {
    let (system, mesh) = (&problem.system, problem.discretisation());
    let Some(surfaces) = system.surfaces() else {
        return Err(StokesError::Unsupported { what: "stresses of suspensions" });
    };
    let mut pressure = pressure[..system.pressure.dim()].to_vec();
    let mean = mean_pressure(mesh, &surfaces.cut, &pressure);
    pressure.iter_mut().for_each(|p| *p -= mean);
    let moments = mesh.agreed(problem.rigidity.first_moments(problem, [velocity, &pressure], strain))?;
    let of_films = film_moments(&problem.film_forces(x), problem.bodies.len());
    let [moments, of_films] =
        [moments, of_films].map(|near| mesh.sums_of_bodies(near).iter().map(symmetric).collect());
    let of_films_here = system.parts(x)[2].iter().map(|g| g * g).sum::<f64>();
    let mut powers = [dissipation(problem, &surfaces.cut, velocity, strain), of_films_here];
    mesh.sum_over_ranks(&mut powers);
    let [of_fluid, dissipation_of_films] = powers;
    Ok(Stress { moments, of_films, dissipation: of_fluid + dissipation_of_films, dissipation_of_films })
}

/// The first moments of the forces of films on each body.
pub fn film_moments<const D: usize>(films: &[FilmForce<D>], body_count: usize) -> Vec<Matrix<D>> {
    let mut sums = vec![Matrix::zeros(); body_count];
    for force in films {
        for (side, body) in (0..2).filter_map(|side| Some((side, force.film.side(side)?))) {
            sums[body] += force.moment(side);
        }
    }
    sums
}

/// Power that the fluid of the own cells dissipates, `int 2 eta eps:eps`, in a nodal velocity field relative
/// to a linear flow with this strain.
fn dissipation<const D: usize>(
    problem: &Problem<D>,
    cut: &CutCells<D>,
    velocity: &[f64],
    strain: &Matrix<D>,
) -> f64 {
    let energy = StrainEnergy::new(problem.discretisation(), cut);
    let of_cell = |cell: usize| match problem.discretisation().is_own(cell) {
        true => energy.in_cell(cell, velocity, strain),
        false => 0.0,
    };
    let cells: Vec<f64> = (0..cut.states.len()).into_par_iter().with_min_len(256).map(of_cell).collect();
    problem.system.viscosity() * cells.iter().sum::<f64>()
}
