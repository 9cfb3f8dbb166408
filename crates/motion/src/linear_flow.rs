//! Linear flows `u(x) = L (x - x0)`, and particles that simply follow them.

use gluey_geom::{Dim, Matrix, Spin, Twist, Vector};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::{Configuration, Hydrodynamics, NoForces, Prediction};

/// The flow `u(x) = L (x - x0)`, `L[(i, j)] = d u_i / d x_j` (unit: 1/time).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct LinearFlow<const D: usize> {
    /// Velocity gradient `L`.
    pub gradient: Matrix<D>,
    /// Point `x0` at rest.
    pub origin: Vector<D>,
}

impl<const D: usize> LinearFlow<D> {
    /// Simple shear `u = rate (y - y0) e_x`.
    pub fn shear(rate: f64, y0: f64) -> Self {
        let mut gradient = Matrix::<D>::zeros();
        gradient[(0, 1)] = rate;
        let mut origin = Vector::<D>::zeros();
        origin[1] = y0;
        Self { gradient, origin }
    }

    /// Velocity at `x`.
    pub fn velocity(&self, x: &Vector<D>) -> Vector<D> {
        self.gradient * (x - self.origin)
    }

    /// Velocity and spin at `x`.
    pub fn twist(&self, x: &Vector<D>) -> Twist<D> {
        Twist { velocity: self.velocity(x), spin: self.spin() }
    }

    /// Rate of strain `E = (L + L^T)/2`.
    pub fn strain_rate(&self) -> Matrix<D> {
        (self.gradient + self.gradient.transpose()) * 0.5
    }

    /// Angular velocity `curl u / 2` of the fluid: `-rate/2` in 2D for [`LinearFlow::shear`].
    pub fn spin(&self) -> Spin<D> {
        let mut spin = Dim::<D>::zero_spin();
        for axis in 0..D {
            let along = Vector::<D>::from_fn(|i, _| if i == axis { 0.5 } else { 0.0 });
            spin += Dim::<D>::moment(&along, &self.gradient.column(axis).into_owned());
        }
        spin
    }

    /// The flow with its gradient multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { gradient: self.gradient * factor, origin: self.origin }
    }
}

/// Particles carried by a linear flow, each as if it were alone: `U = u(X)`, spin `curl u / 2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BackgroundFlow<const D: usize> {
    flow: LinearFlow<D>,
}

impl<const D: usize> BackgroundFlow<D> {
    /// Particles in `flow`.
    pub fn new(flow: LinearFlow<D>) -> Self {
        Self { flow }
    }
}

impl<const D: usize> Hydrodynamics<D> for BackgroundFlow<D> {
    type Error = NoForces;

    fn predict(&mut self, configuration: &Configuration<'_, D>) -> Result<Prediction<D>, NoForces> {
        if !configuration.wrenches.is_empty() {
            return Err(NoForces);
        }
        let flow = self.flow.scaled(configuration.shear_factor);
        let twists = configuration.particles.iter().map(|particle| flow.twist(&particle.pose.position));
        Ok(Prediction::of(twists.collect()))
    }
}
