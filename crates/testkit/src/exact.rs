//! Exact solutions of the Stokes equations `-grad p + div(2 eta eps(u)) + f = 0`, `div u = 0`.

mod inclusion;
mod polynomial;
mod sphere;
mod sphere_pair;

pub use inclusion::{InclusionViscosity, ViscousInclusion};
pub use polynomial::{PolynomialFlow, WavyPressure};
pub use sphere::{RigidSphere, ViscousSphere};
pub use sphere_pair::{PairInStrain, PairStrain, pair_in_strain};

use gluey_geom::{Matrix, Vector};

/// An exact Stokes flow.
pub trait StokesSolution<const D: usize> {
    /// Velocity at `x`.
    fn velocity(&self, x: &Vector<D>) -> Vector<D>;
    /// Pressure at `x`.
    fn pressure(&self, x: &Vector<D>) -> f64;
    /// Viscosity at `x`; infinite where the material is rigid.
    fn viscosity(&self, x: &Vector<D>) -> f64;

    /// Body force `f` at `x`; none by default.
    fn body_force(&self, _x: &Vector<D>) -> Vector<D> {
        Vector::zeros()
    }
}

/// Velocity gradient `L_ij = d u_i / d x_j` by central differences of fourth order and step `h`.
pub fn velocity_gradient<const D: usize>(flow: &impl StokesSolution<D>, x: &Vector<D>, h: f64) -> Matrix<D> {
    let mut gradient = Matrix::<D>::zeros();
    for j in 0..D {
        let derivative = DIFFERENCE.iter().fold(Vector::<D>::zeros(), |sum, (steps, weight)| {
            sum + flow.velocity(&shifted(x, j, steps * h)) * (weight / h)
        });
        gradient.set_column(j, &derivative);
    }
    gradient
}

/// Stress `-p + 2 eta eps(u)` by central differences of fourth order and step `h`.
pub fn stress<const D: usize>(flow: &impl StokesSolution<D>, x: &Vector<D>, h: f64) -> Matrix<D> {
    let gradient = velocity_gradient(flow, x, h);
    (gradient + gradient.transpose()) * flow.viscosity(x) - Matrix::<D>::identity() * flow.pressure(x)
}

/// Divergence of the velocity by central differences of fourth order and step `h`: zero but for their error.
pub fn divergence<const D: usize>(flow: &impl StokesSolution<D>, x: &Vector<D>, h: f64) -> f64 {
    velocity_gradient(flow, x, h).trace()
}

/// `div(stress) + f` by central differences of fourth order and step `h`: zero but for their error.
pub fn momentum_residual<const D: usize>(flow: &impl StokesSolution<D>, x: &Vector<D>, h: f64) -> Vector<D> {
    let mut residual = flow.body_force(x);
    for j in 0..D {
        for (steps, weight) in DIFFERENCE {
            residual += stress(flow, &shifted(x, j, steps * h), h).column(j) * (weight / h);
        }
    }
    residual
}

/// The central difference of fourth order: steps and weights.
const DIFFERENCE: [(f64, f64); 4] =
    [(1.0, 2.0 / 3.0), (-1.0, -2.0 / 3.0), (2.0, -1.0 / 12.0), (-2.0, 1.0 / 12.0)];

fn shifted<const D: usize>(x: &Vector<D>, j: usize, distance: f64) -> Vector<D> {
    let mut shifted = *x;
    shifted[j] += distance;
    shifted
}

#[cfg(test)]
mod checks {
    use super::*;

    /// Divergence and momentum balance at the given points.
    pub fn solves_stokes<const D: usize>(
        flow: &impl StokesSolution<D>,
        points: &[Vector<D>],
        tolerance: f64,
    ) {
        assert!(!points.is_empty());
        for x in points {
            let (divergence, residual) = (divergence(flow, x, 1e-3), momentum_residual(flow, x, 1e-3));
            assert!(divergence.abs() < tolerance, "divergence {divergence:e} at {x:?}");
            assert!(residual.norm() < tolerance, "momentum {residual:?} at {x:?}");
        }
    }

    /// Points spread over the box `[-1, 1]^D`.
    pub fn points<const D: usize>(count: usize) -> Vec<Vector<D>> {
        // Multiples of irrational numbers modulo one fill the box evenly.
        let steps = [0.754_877_666, 0.569_840_291, 0.430_159_709];
        (1..=count).map(|k| Vector::<D>::from_fn(|d, _| 2.0 * (k as f64 * steps[d]).fract() - 1.0)).collect()
    }
}
