//! A viscous or rigid disc in a linear flow of the plane.
//!
//! D. W. Schmid and Y. Y. Podladchikov, Analytical solutions for deformable elliptical inclusions in general
//! shear, Geophys. J. Int. 155 (2003) 269, 10.1046/j.1365-246X.2003.02042.x, for a circle. With `z = x + iy`,
//! the far strain `E = e + i g/2` and `K = E R^2 (mu_m - mu_i)/(mu_m + mu_i)`:
//!
//! - outside `u + iv = E conj(z) + K conj(z)/|z|^2 + conj(K) z^3/|z|^4 (1 - R^2/|z|^2)`,
//!   `p = 4 mu_m Re(K/z^2)`;
//! - inside `u + iv = 2 mu_m/(mu_m + mu_i) E conj(z)`, `p = 0`.

use gluey_geom::Vector;
use nalgebra::Complex;

use super::StokesSolution;

/// Material of the inclusion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InclusionViscosity {
    /// A viscous fluid.
    Finite(f64),
    /// A rigid body.
    Rigid,
}

/// A disc at rest at `center`, free of force and torque, in the flow
/// `u = (e x + g y / 2 - w y, g x / 2 - e y + w x)` relative to its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViscousInclusion {
    /// Centre of the disc.
    pub center: Vector<2>,
    /// Its radius `R`.
    pub radius: f64,
    /// Viscosity `mu_m` around it.
    pub matrix_viscosity: f64,
    /// Viscosity `mu_i` inside.
    pub inclusion_viscosity: InclusionViscosity,
    /// Rate `e` of pure shear, stretching along x.
    pub pure_shear: f64,
    /// Rate `g` of the strain of a simple shear.
    pub simple_shear: f64,
    /// Rate `w` of rotation of the flow far away, and of the disc; simple shear `u = g y` has `w = -g/2`.
    pub spin: f64,
}

impl ViscousInclusion {
    fn strain(&self) -> Complex<f64> {
        Complex::new(self.pure_shear, 0.5 * self.simple_shear)
    }

    /// `(mu_m - mu_i) / (mu_m + mu_i)`.
    fn contrast(&self) -> f64 {
        match self.inclusion_viscosity {
            InclusionViscosity::Finite(mu) => (self.matrix_viscosity - mu) / (self.matrix_viscosity + mu),
            InclusionViscosity::Rigid => -1.0,
        }
    }

    fn k(&self) -> Complex<f64> {
        self.strain() * (self.radius * self.radius * self.contrast())
    }

    fn relative(&self, x: &Vector<2>) -> Complex<f64> {
        Complex::new(x[0] - self.center[0], x[1] - self.center[1])
    }

    fn is_inside(&self, z: Complex<f64>) -> bool {
        z.norm() < self.radius
    }

    fn straining(&self, z: Complex<f64>) -> Complex<f64> {
        let far = self.strain() * z.conj();
        if self.is_inside(z) {
            return far * (1.0 + self.contrast());
        }
        let (k, square) = (self.k(), z.norm_sqr());
        let shell = (1.0 - self.radius * self.radius / square) / (square * square);
        far + k * z.conj() / square + k.conj() * z.powi(3) * shell
    }
}

impl StokesSolution<2> for ViscousInclusion {
    fn velocity(&self, x: &Vector<2>) -> Vector<2> {
        let z = self.relative(x);
        let velocity = self.straining(z) + Complex::new(0.0, self.spin) * z;
        Vector::<2>::new(velocity.re, velocity.im)
    }

    fn pressure(&self, x: &Vector<2>) -> f64 {
        let z = self.relative(x);
        if self.is_inside(z) { 0.0 } else { 4.0 * self.matrix_viscosity * (self.k() / (z * z)).re }
    }

    fn viscosity(&self, x: &Vector<2>) -> f64 {
        match self.inclusion_viscosity {
            _ if !self.is_inside(self.relative(x)) => self.matrix_viscosity,
            InclusionViscosity::Finite(mu) => mu,
            InclusionViscosity::Rigid => f64::INFINITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::checks::{points, solves_stokes};
    use super::super::stress;
    use super::*;

    fn inclusion(inclusion_viscosity: InclusionViscosity) -> ViscousInclusion {
        ViscousInclusion {
            center: Vector::<2>::new(0.1, -0.05),
            radius: 0.4,
            matrix_viscosity: 1.5,
            inclusion_viscosity,
            pure_shear: 0.7,
            simple_shear: -1.1,
            spin: 0.3,
        }
    }

    fn rim(flow: &ViscousInclusion) -> impl Iterator<Item = (Vector<2>, Vector<2>)> {
        let (center, radius) = (flow.center, flow.radius);
        (0..12).map(move |k| {
            let (sin, cos) = (0.5 * k as f64).sin_cos();
            let normal = Vector::<2>::new(cos, sin);
            (center + normal * radius, normal)
        })
    }

    #[test]
    fn the_equations_hold_on_both_sides() {
        let flow = inclusion(InclusionViscosity::Finite(20.0));
        let away_from_rim = |x: &Vector<2>| ((x - flow.center).norm() - flow.radius).abs() > 1e-2;
        let points: Vec<_> = points(60).into_iter().filter(away_from_rim).collect();
        solves_stokes(&flow, &points, 1e-6);
    }

    #[test]
    fn velocity_and_traction_are_continuous() {
        let flow = inclusion(InclusionViscosity::Finite(20.0));
        for (x, n) in rim(&flow) {
            let d = 1e-5;
            let (inside, outside) = (x - n * d, x + n * d);
            assert!((flow.velocity(&inside) - flow.velocity(&outside)).norm() < 10.0 * d);
            let jump = (stress(&flow, &inside, 0.25 * d) - stress(&flow, &outside, 0.25 * d)) * n;
            assert!(jump.norm() < 1e-3, "{jump:?}");
        }
    }
    #[test]
    fn a_rigid_disc_turns_with_the_flow_and_the_far_flow_is_linear() {
        let flow = inclusion(InclusionViscosity::Rigid);
        for (x, n) in rim(&flow) {
            let rigid = Vector::<2>::new(-n[1], n[0]) * (flow.spin * flow.radius);
            assert!((flow.velocity(&x) - rigid).norm() < 1e-14);
            assert!((flow.velocity(&(x - n * 0.1)) - rigid * 0.75).norm() < 1e-14);
            let far = n * 4e4;
            let linear = Vector::<2>::new(
                0.7 * far[0] + (-0.55 - 0.3) * far[1],
                (-0.55 + 0.3) * far[0] - 0.7 * far[1],
            );
            assert!((flow.velocity(&(flow.center + far)) - linear).norm() < 1e-5);
        }
    }

    #[test]
    fn without_contrast_the_flow_is_not_disturbed() {
        let flow = inclusion(InclusionViscosity::Finite(1.5));
        let bare = ViscousInclusion { radius: 1e-300, ..flow };
        for x in points(20) {
            assert!((flow.velocity(&x) - bare.velocity(&x)).norm() < 1e-15);
            assert_eq!(flow.pressure(&x), 0.0);
        }
    }
}
