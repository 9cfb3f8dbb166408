//! Approximate inverse of the pressure Schur complement `S = B A^-1 B^T`.
//!
//! For velocities that vanish on the boundary `int 2 eta eps(u):eps(u) >= 2 eta int (div u)^2`, so `S <= M / (2 eta)` with the
//! pressure mass matrix `M`, and most pressures come close to equality. Hence `S^-1` is taken to be `2 eta M^-1`: the
//! eigenvalues then gather at one, where those of the velocity block are. `M^-1` is Chebyshev iteration on the matrix scaled by
//! its diagonal (Wathen and Rees 2009), in `f32`. Where that estimate fails, in gaps narrower than a cell, the inverses of small exact
//! Schur complements are added, see [`crate::gap`].

use gluey_geom::{Dim, Space};
use gluey_linalg::{Chebyshev, Guess, Jacobi, LinOp, SlicedMatrix, SpectralInterval, estimate_lambda_max};

use crate::discretisation::Discretisation;
use crate::element::Elements;
use crate::error::StokesError;
use crate::gap::GapInverse;
use crate::system::{StokesSystem, pressure_mass};

/// Bound of the relative error of `M^-1`.
const LARGEST_ERROR: f64 = 1.0 / 16.0;
/// Chebyshev steps for it, at most: six in 2D and ten in 3D is usual.
const MOST_STEPS: usize = 32;
/// Lanczos steps for the largest eigenvalue. The bound `(3/2)^D` of a cell does not hold for its matrix in the unknowns:
/// the pressures that an aggregate or a hanging node takes from others add up.
const LANCZOS_STEPS: usize = 15;
/// Factor by which that estimate is raised.
const SAFETY: f64 = 1.1;

/// `2 eta M^-1`, up to Chebyshev's error, and the gaps.
pub struct SchurInverse {
    /// `M / (2 eta)`, or what takes its place.
    mass: SlicedMatrix<f32>,
    jacobi: Jacobi<f32>,
    chebyshev: Chebyshev<f32>,
    gaps: GapInverse,
}

impl SchurInverse {
    /// For the pressures of `system`.
    pub fn new<const D: usize>(
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        elements: &Elements<'_, D>,
        viscosity: f64,
    ) -> Result<Self, StokesError>
    where
        Dim<D>: Space<D>,
    {
        let mut mass = pressure_mass(discretisation, system, elements, viscosity)?;
        mass.values_mut().iter_mut().for_each(|m| *m *= 0.5);
        let gaps = GapInverse::new(discretisation, system, &mass)?;
        let diagonal: Vec<f32> = mass.diagonal().into_iter().map(|m| m as f32).collect();
        let mut mass = SlicedMatrix::new(&mass);
        let mut jacobi = Jacobi::new(&diagonal)
            .map_err(|e| StokesError::Smoother { level: 0, reason: format!("pressure mass: {e}") })?;
        let upper = SAFETY * estimate_lambda_max(&mut mass, &mut jacobi, LANCZOS_STEPS)?;
        let interval = SpectralInterval { lower: 0.5f64.powi(D as i32), upper };
        let chebyshev = Chebyshev::new(mass.dim(), steps(interval), interval);
        Ok(Self { mass, jacobi, chebyshev, gaps })
    }

    /// `z` close to `S^-1 r`.
    pub fn apply(&mut self, r: &[f32], z: &mut [f32]) {
        self.chebyshev.smooth(&mut self.mass, &mut self.jacobi, r, z, Guess::Zero);
        self.gaps.add(r, z);
    }
}

/// The smallest even number of Chebyshev steps whose error is small enough, or [`MOST_STEPS`]. An odd number would take too much of the smooth
/// pressures, at the upper end of the spectrum, where an even one takes too little: 27 spheres take 33 iterations with three
/// steps, 27 with two and 22 with four.
fn steps(interval: SpectralInterval) -> usize {
    let error = |steps: usize| Chebyshev::<f32>::new(0, steps, interval).contraction_bound();
    (2..MOST_STEPS).step_by(2).find(|&steps| error(steps) <= LARGEST_ERROR).unwrap_or(MOST_STEPS)
}
