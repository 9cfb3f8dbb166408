//! The velocity block of a system in single precision, with the cells that surfaces cut.

use std::sync::Arc;

use gluey_geom::{Dim, Space};
use gluey_linalg::LinOp;

use super::restricted::CountedOperator;
use super::system::StokesSystem;
use crate::surface::{SurfaceCoupling, SurfaceWorkspace};

/// `A` on reduced velocities, which counts its applications.
#[derive(Clone, Debug)]
pub struct ViscousOperator<const D: usize> {
    fluid: CountedOperator<f32, D>,
    surfaces: Option<Arc<SurfaceCoupling<D>>>,
    work: SurfaceWorkspace<f32>,
}

impl<const D: usize> ViscousOperator<D>
where
    Dim<D>: Space<D>,
{
    /// The velocity block of `system`.
    pub fn new(system: &StokesSystem<D>) -> Self {
        let cells = &system.cells;
        Self {
            fluid: CountedOperator::new(&system.space, cells, cells.len(), system.penalty.as_ref()),
            surfaces: system.surfaces.clone(),
            work: SurfaceWorkspace::default(),
        }
    }

    /// Applications since the last call.
    pub fn take_applications(&mut self) -> f64 {
        self.fluid.take_applications()
    }
}

impl<const D: usize> LinOp<f32> for ViscousOperator<D>
where
    Dim<D>: Space<D>,
{
    fn dim(&self) -> usize {
        self.fluid.dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.fluid.apply(x, y);
        if let Some(surfaces) = &self.surfaces {
            surfaces.add_narrow([x, &[]], [y, &mut []], &mut self.work);
        }
    }
}
