//! What pressures and the forces of terms do to velocities, in single precision.

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_linalg::Scalar;

use super::system::StokesSystem;
use crate::term::{Scratch, add_terms};

/// `-B^T p` and the terms' `r^T g`.
#[derive(Clone, Debug)]
pub struct PressureForces<const D: usize> {
    fluid: CellOperator<f32, D>,
    work: Workspace<f32>,
    scratch: Scratch<f32>,
}

impl<const D: usize> PressureForces<D> {
    /// Those of a system.
    pub fn new(system: &StokesSystem<D>) -> Self {
        let (work, scratch) = (Workspace::default(), Scratch::default());
        Self { fluid: system.in_single_precision(), work, scratch }
    }

    /// Writes the loads on reduced velocities of pressures at all nodes and of the forces of terms.
    pub fn set<S: Scalar>(
        &mut self,
        system: &StokesSystem<D>,
        pressure: &[f32],
        forces: &[S],
        load: &mut [f32],
    ) {
        self.fluid.gradient(pressure, load, &mut self.work);
        let y = [&mut *load, &mut [], &mut []];
        add_terms(&system.terms, [&[], pressure, &[]], y, &mut self.scratch);
        for (row, g) in system.rows().zip(forces) {
            for &(k, weight) in row {
                load[k as usize] += f32::from_f64(weight * g.to_f64());
            }
        }
    }
}
