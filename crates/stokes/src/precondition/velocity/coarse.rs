//! The coarsest level of the velocity multigrid.

use gluey_linalg::{DirectSpd, Ordering, Preconditioner, Subset};

use crate::error::StokesError;
use crate::operator::{StokesSystem, assemble_viscous, factorised};
use crate::space::VelocitySpace;

/// Direct solver of the coarsest level.
pub struct CoarseSolver {
    factor: DirectSpd,
    unknowns: Subset,
    b: Vec<f64>,
    x: Vec<f64>,
}

impl CoarseSolver {
    /// The factorised viscous matrix of the velocities of `space`.
    pub fn new<const D: usize>(space: VelocitySpace<D>, viscosity: f64) -> Result<Self, StokesError> {
        let system = StokesSystem::new(space, viscosity);
        let assembled = assemble_viscous(&system)?;
        let factor = factorised(&assembled.matrix, Ordering::Amd)?;
        let count = assembled.unknowns.len();
        Ok(Self { factor, unknowns: assembled.unknowns, b: vec![0.0; count], x: vec![0.0; count] })
    }

    /// `x = A^-1 b`.
    pub fn solve(&mut self, b: &[f32], x: &mut [f32]) {
        for (value, &k) in self.b.iter_mut().zip(self.unknowns.positions()) {
            *value = f64::from(b[k as usize]);
        }
        self.factor.apply(&self.b, &mut self.x);
        x.fill(0.0);
        for (value, &k) in self.x.iter().zip(self.unknowns.positions()) {
            x[k as usize] = *value as f32;
        }
    }
}
