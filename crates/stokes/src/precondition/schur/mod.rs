//! Approximate inverse of the pressure Schur complement `S = B A^-1 B^T`.
//!
//! For velocities that vanish on the boundary `int 2 eta eps(u):eps(u) >= 2 eta int (div u)^2`, so
//! `S <= M / (2 eta)` with the pressure mass matrix `M`, and most pressures come close to equality. Hence `S`
//! is taken to be `T = W^1/2 M W^1/2 / (2 eta)`: the eigenvalues then gather at one, where those of the
//! velocity block are. The weights `W` are one but for pressures next to walls and bodies, which act on
//! fewer velocities ([`weights`]). `T^-1` is Chebyshev iteration on the matrix scaled by its
//! diagonal (Wathen and Rees 2009), in `f32`. Pressures as large as the box are still far from `T`: they are
//! corrected on a small mesh ([`coarse`]).

mod cells;
mod coarse;
mod mass;
mod weights;

use gluey_linalg::{Chebyshev, Guess, Jacobi, LinOp, SellMatrix, SpectralInterval, estimate_lambda_max_from};
use gluey_parallel::Halo;

#[cfg(test)]
pub use {cells::PressureMatrices, weights::weights};

use crate::error::StokesError;
use crate::operator::{Elements, OnOwned, Summed};
use crate::space::{Discretisation, PressureSpace};
use coarse::CoarseSchur;
use mass::pressure_matrix;

/// Bound of the relative error of `M^-1`.
const LARGEST_ERROR: f64 = 1.0 / 16.0;
/// Chebyshev steps for it, at most: six in 2D and ten in 3D is usual.
const MOST_STEPS: usize = 32;
/// Lanczos steps for the largest eigenvalue. The bound `(3/2)^D` of a cell does not hold for its matrix in
/// the unknowns: the pressures that an aggregate or a hanging node takes from others add up.
const LANCZOS_STEPS: usize = 15;
/// Factor by which that estimate is raised.
const SAFETY: f64 = 1.1;

/// `T^-1`, up to Chebyshev's error, with the correction for the box.
pub struct SchurInverse<const D: usize> {
    /// `T`.
    mass: SellMatrix<f32>,
    jacobi: Jacobi<f32>,
    chebyshev: Chebyshev<f32>,
    coarse: Option<CoarseSchur<D>>,
    /// Of the pressures.
    halo: Halo,
}

impl<const D: usize> SchurInverse<D> {
    /// For the pressures of the system on the finest of `meshes` (coarsest first). What stayed the same is
    /// taken from `before`. All ranks call this.
    ///
    /// # Errors
    /// If a matrix is too large or not positive, on all ranks.
    pub fn new(
        meshes: &[Discretisation<D>],
        elements: &Elements<'_, D>,
        before: Option<Self>,
    ) -> Result<Self, StokesError> {
        let system = elements.system();
        let (viscosity, mut halo) = (system.viscosity(), system.pressure.halo().clone());
        let mass = pressure_matrix(elements, viscosity)?;
        let before = before.and_then(|before| before.coarse);
        let coarse = CoarseSchur::new(meshes, viscosity, before, &halo)?;
        let mut diagonal: Vec<f32> = mass.diagonal().into_iter().map(|m| m as f32).collect();
        halo.sum(&mut diagonal);
        if !halo.is_empty() {
            // No own cell acts on these.
            diagonal.iter_mut().filter(|entry| **entry == 0.0).for_each(|entry| *entry = 1.0);
        }
        let mut mass = SellMatrix::new(&mass);
        let jacobi = Jacobi::new(&diagonal).map_err(StokesError::PressureMass);
        let mut jacobi = system.discretisation().agreed(jacobi)?;
        let start = system.discretisation().pseudo_random_pressures();
        let mut on_owned = OnOwned::new(&mut mass, &mut halo);
        let largest = estimate_lambda_max_from(start, &mut on_owned, &mut jacobi, LANCZOS_STEPS)?;
        let chebyshev = mass_iteration::<D>(mass.dim(), largest);
        Ok(Self { mass, jacobi, chebyshev, coarse, halo })
    }

    /// `z` close to `S^-1 r`, up to a constant, for vectors that hold the same at ghosts as at their owners.
    /// `r` is zero but at unknowns, where its sum vanishes; so is `z`.
    pub fn apply(&mut self, space: &PressureSpace<D>, r: &[f32], z: &mut [f32]) {
        let mut mass = Summed { operator: &mut self.mass, halo: &mut self.halo };
        self.chebyshev.smooth(&mut mass, &mut self.jacobi, r, z, Guess::Zero);
        if let Some(coarse) = &mut self.coarse {
            coarse.add(r, z);
            space.clear_fixed(z);
        }
    }
}

/// Chebyshev's iteration for the inverse of a pressure mass matrix of so many rows, whose largest eigenvalue,
/// scaled by the diagonal, was estimated in [`LANCZOS_STEPS`].
fn mass_iteration<const D: usize>(dim: usize, largest: f64) -> Chebyshev<f32> {
    let interval = SpectralInterval { lower: 0.5f64.powi(D as i32), upper: SAFETY * largest };
    Chebyshev::new(dim, steps(interval), interval)
}

/// The smallest even number of Chebyshev steps whose error is small enough, or [`MOST_STEPS`]. An odd number
/// would take too much of the smooth pressures, at the upper end of the spectrum, where an even one takes too
/// little (`docs/archive/decisions/0014-relaxation-near-bodies.md`).
fn steps(interval: SpectralInterval) -> usize {
    let error = |steps: usize| Chebyshev::<f32>::new(0, steps, interval).contraction_bound();
    (2..MOST_STEPS).step_by(2).find(|&steps| error(steps) <= LARGEST_ERROR).unwrap_or(MOST_STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::StokesSystem;
    use crate::precondition::schur::weights::without_bodies;
    use crate::solver::{DirectSolver, SaddleSolver};
    use gluey_fem::TreeMesh;
    use gluey_geom::Aabb;

    /// A box without bodies, its coarser meshes and its system.
    fn empty_box<const D: usize>(level: u8) -> (Vec<Discretisation<D>>, StokesSystem<D>) {
        let mesh = TreeMesh::<D>::refine(Aabb::unit(), [1; D], [false; D], level, |lower, _, level| {
            level < 3 || lower[0] < 0.5
        })
        .unwrap();
        let coarser = (2..level).map(|level| Discretisation::new(mesh.coarsened(level)));
        let mut meshes: Vec<_> = coarser.collect();
        meshes.push(Discretisation::new(mesh));
        let system = without_bodies(&meshes[meshes.len() - 1], 1.5);
        (meshes, system)
    }

    /// Relative errors of `S^-1 r` with and without the correction from the coarsest mesh.
    fn errors<const D: usize>(level: u8, load: impl Fn(f64) -> f64) -> [f64; 2] {
        let (meshes, system) = empty_box::<D>(level);
        let fine = &meshes[meshes.len() - 1];
        let product = |q: usize| fine.pressure.point(q).iter().map(|&x| load(x)).product();
        let mut r: Vec<f64> = (0..system.pressure.dim()).map(product).collect();
        system.pressure.clear_fixed(&mut r);
        system.pressure.remove_mean(&mut r);
        let mut b = vec![0.0; system.velocity_dim()];
        b.extend(r.iter().map(|r| -r));
        let mut x = vec![0.0; b.len()];
        let mut direct = DirectSolver::default();
        direct.factorise(&system).unwrap();
        direct.solve(&system, &b, &mut x, 1e-10).unwrap();
        let exact = &x[system.velocity_dim()..];

        let elements = Elements::new(&system, gluey_fem::ReferenceMatrices::<D>::VELOCITY);
        let mut inverse = SchurInverse::new(&meshes, &elements, None).unwrap();
        inverse.chebyshev = Chebyshev::new(r.len(), 30, inverse.chebyshev.interval());
        let r: Vec<f32> = r.iter().map(|&r| r as f32).collect();
        let mut error = || {
            let mut z = vec![0f32; r.len()];
            inverse.apply(&system.pressure, &r, &mut z);
            system.pressure.remove_mean(&mut z);
            inverse.coarse = None;
            let error: f64 = exact.iter().zip(&z).map(|(x, z)| (x - f64::from(*z)).powi(2)).sum();
            (error / exact.iter().map(|x| x.powi(2)).sum::<f64>()).sqrt()
        };
        [error(), error()]
    }

    /// On the coarsest mesh the correction is all there is.
    #[test]
    fn the_coarsest_mesh_is_solved() {
        let wild = |x: f64| (17.0 * x).sin() + x;
        let e = [errors::<2>(2, wild), errors::<3>(2, wild)];
        assert!(e.iter().all(|e| e[0] < 0.01 && e[1] > 0.15), "{e:?}");
    }

    /// Loads as large as the box, with hanging nodes. Four cells per side do not resolve these pressures
    /// better.
    #[test]
    fn pressures_as_large_as_the_box_are_corrected() {
        let smooth = |x: f64| (std::f64::consts::PI * x).cos();
        let e = [errors::<2>(4, smooth), errors::<3>(3, smooth)];
        assert!(e.iter().all(|e| e[0] < 0.28 && e[1] > 1.4 * e[0]), "{e:?}");
    }
}
