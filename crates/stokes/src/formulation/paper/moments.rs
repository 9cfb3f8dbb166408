//! The rigid motion closest to a velocity field in a weighted mean.

use gluey_geom::{Dim, Matrix, Spin, Twist, Vector, Wrench};

/// Weighted sums over a body.
#[derive(Clone, Debug)]
pub struct BodyMoments<const D: usize> {
    mass: f64,
    momentum: Vector<D>,
    first: Vector<D>,
    second: Matrix<D>,
    angular: Spin<D>,
}

impl<const D: usize> BodyMoments<D> {
    /// No weight.
    pub fn new() -> Self {
        Self {
            mass: 0.0,
            momentum: Vector::zeros(),
            first: Vector::zeros(),
            second: Matrix::zeros(),
            angular: Dim::<D>::zero_spin(),
        }
    }

    /// Adds a point with this arm and velocity.
    pub fn add(&mut self, weight: f64, arm: &Vector<D>, u: &Vector<D>) {
        self.mass += weight;
        self.momentum += u * weight;
        self.first += arm * weight;
        self.second += arm * arm.transpose() * weight;
        self.angular += Dim::<D>::moment(arm, u) * weight;
    }

    /// Velocity and spin about the centroid of the weights, the velocity then moved to the reference point;
    /// `None` where the weights do not fix them.
    pub fn twist(&self) -> Option<Twist<D>> {
        self.accelerated(&self.momentum, &self.angular)
    }

    /// The rigid field `f(r) = A + B x r` of forces per weight that add up to a force and a torque about the
    /// reference point, as [`Twist`]; `None` where the weights do not fix it. By it the force does the work
    /// of the wrench on the motion that [`BodyMoments::twist`] finds, in any velocity field.
    pub fn force_density(&self, wrench: &Wrench<D>) -> Option<Twist<D>> {
        self.accelerated(&wrench.force, &wrench.torque)
    }

    /// The rigid field with this linear and angular momentum.
    fn accelerated(&self, momentum: &Vector<D>, angular: &Spin<D>) -> Option<Twist<D>> {
        if self.mass <= 0.0 {
            return None;
        }
        let (mean, centroid) = (momentum / self.mass, self.first / self.mass);
        let second = self.second - centroid * centroid.transpose() * self.mass;
        let mut angular = *angular;
        angular += -(Dim::<D>::moment(&centroid, &mean) * self.mass);
        let spin = solve_inertia::<D>(&second, &angular)?;
        Some(Twist { velocity: mean - Dim::<D>::cross_spin(&spin, &centroid), spin })
    }
}

/// Solves `J w = l` with `J = tr(S) 1 - S`, if that is positive definite.
fn solve_inertia<const D: usize>(second: &Matrix<D>, angular: &Spin<D>) -> Option<Spin<D>> {
    let rot = Dim::<D>::ROT;
    let inertia = nalgebra::DMatrix::from_fn(rot, rot, |i, j| {
        let diagonal = if i == j { second.trace() } else { 0.0 };
        diagonal - if rot == 1 { 0.0 } else { second[(i, j)] }
    });
    let load = nalgebra::DVector::from_fn(rot, |i, _| angular[i]);
    let solution = inertia.cholesky()?.solve(&load);
    let mut spin = Dim::<D>::zero_spin();
    (0..rot).for_each(|k| spin[k] = solution[k]);
    Some(spin)
}
