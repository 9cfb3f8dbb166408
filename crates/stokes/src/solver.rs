//! The trait behind which the linear solvers stand.

use gluey_geom::{Dim, Space};
use gluey_levelset::Ball;

use crate::discretisation::Discretisation;
use crate::error::StokesError;
use crate::system::StokesSystem;

/// What a solver may want to know about the problem beyond its matrix.
#[derive(Clone, Copy, Debug)]
pub struct Preparation<'a, const D: usize> {
    /// The rigid bodies.
    pub bodies: &'a [Ball<D>],
    /// Offset of the rigid nodes in cells, see [`crate::solid_nodes`].
    pub offset: f64,
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// Nodes of the cells with any penalised solid; `None` where the bodies are eliminated.
    pub touched: Option<&'a [Option<u32>]>,
}

/// Solves `[A, -B^T; -B, 0] x = b` for reduced vectors of a [`StokesSystem`].
pub trait SaddleSolver<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Builds what depends on the system: factors, levels, preconditioners.
    fn prepare(
        &mut self,
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        preparation: &Preparation<'_, D>,
    ) -> Result<(), StokesError>;

    /// Solves from the guess in `x` to a true residual of at most `tolerance |b|` and returns the iterations.
    fn solve(
        &mut self,
        system: &StokesSystem<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<usize, StokesError>;
}
