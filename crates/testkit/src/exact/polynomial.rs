//! Polynomial flows in the unit box that rest on its boundary: manufactured solutions for orders of
//! convergence.
//!
//! With `g(t) = t^2 (1-t)^2`, in 2D `u = (psi_y, -psi_x)`, `psi = g(x) g(y)`, `p = xy - 1/4`; in 3D the curl
//! of `phi (1, 1, 1)`, `u = (phi_y - phi_z, phi_z - phi_x, phi_x - phi_y)`, `phi = g(x) g(y) g(z)`,
//! `p = xyz - 1/8`. Both pressures have mean zero. The forcing is `f = grad p - eta laplace u`.

use std::f64::consts::PI;

use gluey_geom::Vector;

use super::StokesSolution;

/// The polynomial flow of constant viscosity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolynomialFlow {
    /// Viscosity `eta`.
    pub viscosity: f64,
}

/// The derivative of order `n` of `g(t) = t^2 (1-t)^2`.
fn g(n: usize, t: f64) -> f64 {
    match n {
        0 => t * t * (1.0 - t) * (1.0 - t),
        1 => 2.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
        2 => 2.0 - 12.0 * t + 12.0 * t * t,
        3 => 24.0 * t - 12.0,
        4 => 24.0,
        _ => 0.0,
    }
}

/// Derivative of the product `g(x_1) ... g(x_D)` of the order `order[d]` in each direction.
fn product<const D: usize>(x: &Vector<D>, order: [usize; D]) -> f64 {
    (0..D).map(|d| g(order[d], x[d])).product()
}

/// Derivative in direction `j` of the product, or of its Laplacian.
fn derivative<const D: usize>(x: &Vector<D>, j: usize) -> f64 {
    let mut order = [0; D];
    order[j] = 1;
    product(x, order)
}

fn derivative_of_laplacian<const D: usize>(x: &Vector<D>, j: usize) -> f64 {
    (0..D)
        .map(|d| {
            let mut order = [0; D];
            order[j] = 1;
            order[d] += 2;
            product(x, order)
        })
        .sum()
}

/// The curl made of the derivatives `d(j)` of the potential.
fn curl_2d(d: impl Fn(usize) -> f64) -> Vector<2> {
    Vector::<2>::new(d(1), -d(0))
}

fn curl_3d(d: impl Fn(usize) -> f64) -> Vector<3> {
    Vector::<3>::new(d(1) - d(2), d(2) - d(0), d(0) - d(1))
}

impl StokesSolution<2> for PolynomialFlow {
    fn velocity(&self, x: &Vector<2>) -> Vector<2> {
        curl_2d(|j| derivative(x, j))
    }

    fn pressure(&self, x: &Vector<2>) -> f64 {
        x[0] * x[1] - 0.25
    }

    fn viscosity(&self, _x: &Vector<2>) -> f64 {
        self.viscosity
    }

    fn body_force(&self, x: &Vector<2>) -> Vector<2> {
        let pressure_gradient = Vector::<2>::new(x[1], x[0]);
        pressure_gradient - curl_2d(|j| derivative_of_laplacian(x, j)) * self.viscosity
    }
}

impl StokesSolution<3> for PolynomialFlow {
    fn velocity(&self, x: &Vector<3>) -> Vector<3> {
        curl_3d(|j| derivative(x, j))
    }

    fn pressure(&self, x: &Vector<3>) -> f64 {
        x[0] * x[1] * x[2] - 0.125
    }

    fn viscosity(&self, _x: &Vector<3>) -> f64 {
        self.viscosity
    }

    fn body_force(&self, x: &Vector<3>) -> Vector<3> {
        let pressure_gradient = Vector::<3>::new(x[1] * x[2], x[0] * x[2], x[0] * x[1]);
        pressure_gradient - curl_3d(|j| derivative_of_laplacian(x, j)) * self.viscosity
    }
}

/// The polynomial flow with a pressure that bilinear elements do not hold: `p + sum_d cos(pi x_d)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WavyPressure(pub PolynomialFlow);

impl<const D: usize> StokesSolution<D> for WavyPressure
where
    PolynomialFlow: StokesSolution<D>,
{
    fn velocity(&self, x: &Vector<D>) -> Vector<D> {
        self.0.velocity(x)
    }

    fn pressure(&self, x: &Vector<D>) -> f64 {
        self.0.pressure(x) + x.map(|t| (PI * t).cos()).sum()
    }

    fn viscosity(&self, x: &Vector<D>) -> f64 {
        self.0.viscosity(x)
    }

    fn body_force(&self, x: &Vector<D>) -> Vector<D> {
        self.0.body_force(x) - x.map(|t| PI * (PI * t).sin())
    }
}

#[cfg(test)]
mod tests {
    use super::super::checks::{points, solves_stokes};
    use super::*;

    fn in_unit_box<const D: usize>() -> Vec<Vector<D>> {
        points(40).iter().map(|x: &Vector<D>| x.map(|t| 0.5 + 0.5 * t)).collect()
    }

    fn solves_and_rests_on_the_boundary<const D: usize>()
    where
        PolynomialFlow: StokesSolution<D>,
    {
        let flow = PolynomialFlow { viscosity: 2.5 };
        solves_stokes(&flow, &in_unit_box(), 1e-6);
        let mut largest: f64 = 0.0;
        for x in in_unit_box::<D>() {
            largest = largest.max(flow.velocity(&x).norm());
            for d in 0..D {
                for side in [0.0, 1.0] {
                    let mut on_face = x;
                    on_face[d] = side;
                    assert_eq!(flow.velocity(&on_face).norm(), 0.0);
                }
            }
        }
        assert!(largest > 1e-3, "not the trivial flow");
    }

    #[test]
    fn both_flows_solve_the_equations() {
        solves_and_rests_on_the_boundary::<2>();
        solves_and_rests_on_the_boundary::<3>();
        let wavy = WavyPressure(PolynomialFlow { viscosity: 2.5 });
        solves_stokes::<2>(&wavy, &in_unit_box(), 1e-6);
        solves_stokes::<3>(&wavy, &in_unit_box(), 1e-6);
    }

    #[test]
    fn the_forcing_in_the_plane_is_the_published_one() {
        let (x, y, eta) = (0.3, 0.8, 2.0);
        let flow = PolynomialFlow { viscosity: eta };
        let expected = Vector::<2>::new(
            y - eta * (g(2, x) * g(1, y) + g(0, x) * g(3, y)),
            x + eta * (g(3, x) * g(0, y) + g(1, x) * g(2, y)),
        );
        assert!((flow.body_force(&Vector::<2>::new(x, y)) - expected).norm() < 1e-15);
    }

    #[test]
    fn derivatives_of_g_follow_from_each_other() {
        for n in 0..5 {
            let t = 0.37;
            let difference = (g(n, t + 1e-5) - g(n, t - 1e-5)) / 2e-5;
            assert!((difference - g(n + 1, t)).abs() < 1e-8);
        }
    }
}
