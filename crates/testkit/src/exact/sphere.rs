//! A rigid sphere, free of force and torque, in a linear flow of space.
//!
//! G. K. Batchelor, An Introduction to Fluid Dynamics (1967), section 4.11; S. Kim and S. J. Karrila,
//! Microhydrodynamics (1991), section 3.3. With the centre as origin, the strain rate `E` (trace-free) and
//! the spin `w`:
//!
//! `u = w x X + E.X - E.X a^5/r^5 - (5/2) X (X.E.X) (a^3/r^5 - a^5/r^7)`, `p = -5 mu a^3 X.E.X / r^5`.

use gluey_geom::{Dim, Matrix, Spin, Vector};

use super::StokesSolution;

/// A rigid sphere at rest in a linear flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidSphere {
    /// Centre of the sphere.
    pub center: Vector<3>,
    /// Its radius `a`.
    pub radius: f64,
    /// Viscosity `mu` around it.
    pub viscosity: f64,
    /// Strain rate `E` far away: symmetric and trace-free.
    pub strain: Matrix<3>,
    /// Spin of the flow far away, and of the sphere.
    pub spin: Spin<3>,
}

impl RigidSphere {
    /// The simple shear `u = rate y e_x` relative to the centre, around a sphere.
    pub fn in_simple_shear(center: Vector<3>, radius: f64, viscosity: f64, rate: f64) -> Self {
        let mut strain = Matrix::<3>::zeros();
        strain[(0, 1)] = 0.5 * rate;
        strain[(1, 0)] = 0.5 * rate;
        Self { center, radius, viscosity, strain, spin: Spin::<3>::new(0.0, 0.0, -0.5 * rate) }
    }
}

impl StokesSolution<3> for RigidSphere {
    fn velocity(&self, x: &Vector<3>) -> Vector<3> {
        let r = x - self.center;
        let rotation = Dim::<3>::cross_spin(&self.spin, &r);
        let ratio = self.radius / r.norm();
        if ratio > 1.0 {
            return rotation;
        }
        let stretch = self.strain * r;
        let radial = r * (r.dot(&stretch) / r.norm_squared());
        rotation + stretch * (1.0 - ratio.powi(5)) - radial * (2.5 * (ratio.powi(3) - ratio.powi(5)))
    }

    /// Zero inside.
    fn pressure(&self, x: &Vector<3>) -> f64 {
        let r = x - self.center;
        let distance = r.norm();
        if distance < self.radius {
            return 0.0;
        }
        -5.0 * self.viscosity * self.radius.powi(3) * r.dot(&(self.strain * r)) / distance.powi(5)
    }

    fn viscosity(&self, x: &Vector<3>) -> f64 {
        if (x - self.center).norm() < self.radius { f64::INFINITY } else { self.viscosity }
    }
}

/// A sphere of another viscosity that is a sphere at this instant, in the flow of a [`RigidSphere`] far away:
/// Eshelby's inclusion (1957, 10.1098/rspa.1957.0133) for incompressible fluids without surface tension.
///
/// With the ratio `r` of the viscosities the strain inside is uniform, `5 / (2 r + 3) E`; outside, the
/// disturbance is that of a rigid sphere times `(2 r - 2) / (2 r + 3)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViscousSphere {
    /// The flow if it were rigid.
    pub rigid: RigidSphere,
    /// Viscosity inside over that around it.
    pub ratio: f64,
}

impl ViscousSphere {
    /// The disturbance in units of that of a rigid sphere.
    pub fn share(&self) -> f64 {
        (2.0 * self.ratio - 2.0) / (2.0 * self.ratio + 3.0)
    }
}

impl StokesSolution<3> for ViscousSphere {
    fn velocity(&self, x: &Vector<3>) -> Vector<3> {
        let r = x - self.rigid.center;
        let undisturbed = self.rigid.strain * r + Dim::<3>::cross_spin(&self.rigid.spin, &r);
        undisturbed + (self.rigid.velocity(x) - undisturbed) * self.share()
    }

    fn pressure(&self, x: &Vector<3>) -> f64 {
        self.rigid.pressure(x) * self.share()
    }

    fn viscosity(&self, x: &Vector<3>) -> f64 {
        let is_inside = (x - self.rigid.center).norm() < self.rigid.radius;
        self.rigid.viscosity * if is_inside { self.ratio } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::checks::{points, solves_stokes};
    use super::super::stress;
    use super::*;

    fn sphere() -> RigidSphere {
        RigidSphere {
            center: Vector::<3>::new(0.1, 0.0, -0.2),
            radius: 0.4,
            viscosity: 1.7,
            strain: Matrix::<3>::new(0.5, 0.2, -0.3, 0.2, -0.8, 0.4, -0.3, 0.4, 0.3),
            spin: Spin::<3>::new(0.3, -0.2, 0.6),
        }
    }

    #[test]
    fn the_equations_hold_outside() {
        let flow = sphere();
        let outside = |x: &Vector<3>| (x - flow.center).norm() > flow.radius + 1e-2;
        let points: Vec<_> = points(60).into_iter().filter(outside).collect();
        solves_stokes(&flow, &points, 1e-6);
    }

    #[test]
    fn the_surface_is_rigid_and_the_far_flow_linear() {
        let flow = sphere();
        for direction in points::<3>(20) {
            let n = direction.normalize();
            let spinning = Dim::<3>::cross_spin(&flow.spin, &n);
            let at_surface = flow.velocity(&(flow.center + n * (flow.radius * (1.0 + 1e-15))));
            assert!((at_surface - spinning * flow.radius).norm() < 1e-14);
            assert!((flow.velocity(&(flow.center + n * 0.1)) - spinning * 0.1).norm() < 1e-14);
            let linear = (spinning + flow.strain * n) * 1e4;
            assert!((flow.velocity(&(flow.center + n * 1e4)) - linear).norm() < 1e-7);
        }
    }

    #[test]
    fn force_and_torque_vanish_and_the_stresslet_is_einsteins() {
        let flow = RigidSphere { center: Vector::zeros(), ..sphere() };
        let r = 0.9;
        let (mut force, mut torque, mut moment) =
            (Vector::<3>::zeros(), Vector::<3>::zeros(), Matrix::<3>::zeros());
        for (n, weight) in sphere_rule() {
            let traction = stress(&flow, &(n * r), 1e-3) * n;
            let velocity = flow.velocity(&(n * r));
            force += traction * (weight * r * r);
            torque += n.cross(&traction) * (weight * r.powi(3));
            let first = traction * n.transpose() * r
                - (velocity * n.transpose() + n * velocity.transpose()) * flow.viscosity;
            moment += first * (weight * r * r);
        }
        assert!(force.norm() < 1e-9 && torque.norm() < 1e-9, "{force:?} {torque:?}");
        let stresslet = (moment + moment.transpose()) * 0.5;
        let stresslet = stresslet - Matrix::<3>::identity() * (stresslet.trace() / 3.0);
        let einstein =
            flow.strain * (20.0 / 3.0 * std::f64::consts::PI * flow.viscosity * flow.radius.powi(3));
        assert!((stresslet - einstein).norm() < 1e-9 * einstein.norm(), "{stresslet} {einstein}");
    }

    /// Gauss points in height and equal angles around: exact for polynomials of degree 7.
    fn sphere_rule() -> Vec<(Vector<3>, f64)> {
        let gauss = [
            (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
            (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
        ];
        let heights = gauss.iter().flat_map(|&(z, w)| [(z, w), (-z, w)]);
        heights
            .flat_map(|(z, w)| {
                (0..8).map(move |k| {
                    let (sin, cos) = (std::f64::consts::FRAC_PI_4 * k as f64).sin_cos();
                    let rho = f64::sqrt(1.0 - z * z);
                    (Vector::<3>::new(rho * cos, rho * sin, z), w * std::f64::consts::FRAC_PI_4)
                })
            })
            .collect()
    }

    #[test]
    fn simple_shear_is_a_special_case() {
        let flow = RigidSphere::in_simple_shear(Vector::zeros(), 1e-3, 1.0, 2.0);
        let far = flow.velocity(&Vector::<3>::new(0.3, 0.5, -0.2));
        assert!((far - Vector::<3>::new(1.0, 0.0, 0.0)).norm() < 1e-7);
    }

    /// Velocity and traction are continuous, and inside the strain is uniform.
    #[test]
    fn a_viscous_sphere_matches_the_fluid_around_it() {
        let flow = ViscousSphere {
            rigid: RigidSphere {
                center: Vector::<3>::new(0.1, -0.05, 0.2),
                radius: 0.4,
                viscosity: 1.5,
                strain: Matrix::<3>::new(0.5, 0.2, -0.3, 0.2, -0.8, 0.4, -0.3, 0.4, 0.3),
                spin: Spin::<3>::new(0.3, -0.2, -0.5),
            },
            ratio: 7.0,
        };
        for n in [[1.0, 0.0, 0.0], [0.3, -0.5, 0.8], [-0.2, 0.9, -0.4]] {
            let n = Vector::<3>::from(n).normalize();
            let d = 1e-5;
            let [inside, outside] = [-d, d].map(|d| flow.rigid.center + n * (flow.rigid.radius + d));
            assert!((flow.velocity(&inside) - flow.velocity(&outside)).norm() < 10.0 * d);
            let of = |x: &Vector<3>| super::super::stress(&flow, x, 0.25 * d) * n;
            assert!((of(&inside) - of(&outside)).norm() < 1e-3, "{:?} {:?}", of(&inside), of(&outside));
        }
    }
}
