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

/// What a linear solve took.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveReport {
    /// Krylov iterations, or corrections by a direct solver.
    pub iterations: usize,
    /// Applications of the operator on the finest mesh, in `f64` or `f32`, by the Krylov method, by smoothers and for
    /// residuals. One that leaves cells out counts as its share of the mesh's cells that are not rigid.
    pub fine_operator_applications: f64,
    /// Norm of the residual at the start and after each iteration; the last is the true one.
    pub residuals: Vec<f64>,
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

    /// Solves from the guess in `x` to a true residual of at most `tolerance |b|` and says what it took. The divergences in
    /// `b` sum to zero, as those of [`StokesSystem::residual`] do.
    fn solve(
        &mut self,
        system: &StokesSystem<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<SolveReport, StokesError>;
}
