//! What pressures and the forces of films do to velocities, in single precision.

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_geom::{Dim, Space};
use gluey_linalg::Scalar;

use super::system::StokesSystem;
use crate::surface::SurfaceWorkspace;

/// `-B^T p` and the films' `s B^T g`.
#[derive(Clone, Debug)]
pub struct PressureForces<const D: usize> {
    fluid: CellOperator<f32, D>,
    work: Workspace<f32>,
    surfaces: SurfaceWorkspace<f32>,
}

impl<const D: usize> PressureForces<D>
where
    Dim<D>: Space<D>,
{
    /// Those of a system.
    pub fn new(system: &StokesSystem<D>) -> Self {
        let (work, surfaces) = (Workspace::default(), SurfaceWorkspace::default());
        Self { fluid: system.in_single_precision(), work, surfaces }
    }

    /// Writes the loads on reduced velocities of pressures at all nodes and the scaled forces of films.
    pub fn set<S: Scalar>(
        &mut self,
        system: &StokesSystem<D>,
        pressure: &[f32],
        films: &[S],
        load: &mut [f32],
    ) {
        self.fluid.gradient(pressure, load, &mut self.work);
        if let Some(cut) = &system.surfaces {
            cut.add_narrow([&[], pressure], [&mut *load, &mut []], &mut self.surfaces);
        }
        if let Some(coupling) = &system.films {
            coupling.add_loads(films, load);
        }
    }
}
