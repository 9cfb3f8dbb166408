//! Direct solution of the Stokes system: the reference, and the method of choice in 2D.

use std::sync::Arc;

use gluey_geom::{Dim, Space};
use gluey_linalg::{DirectIndefinite, IndefiniteParams, Ordering, Symbolic};

use crate::assembly::{Unknowns, assemble_stokes};
use crate::discretisation::Discretisation;
use crate::error::StokesError;
use crate::solver::{Preparation, SaddleSolver, SolveReport};
use crate::system::StokesSystem;

/// Sparse `L B L^T` factorisation of the assembled saddle-point matrix, eliminated block by block in order of
/// approximate minimum degree. The symbolic part is kept as long as the pattern of the matrix stands; every solve is
/// checked by its residual.
#[derive(Debug, Default)]
pub struct DirectSolver {
    factor: Option<DirectIndefinite>,
    unknowns: Option<Unknowns>,
    b: Vec<f64>,
    x: Vec<f64>,
}

impl<const D: usize> SaddleSolver<D> for DirectSolver
where
    Dim<D>: Space<D>,
{
    fn prepare(
        &mut self,
        discretisation: &Discretisation<D>,
        system: &StokesSystem<D>,
        _preparation: &Preparation<'_, D>,
    ) -> Result<(), StokesError> {
        let assembled = assemble_stokes(discretisation, system)?;
        let pattern = assembled.matrix.pattern();
        let reusable = self.factor.take().filter(|f| f.symbolic().pattern() == pattern);
        let mut factor = match reusable {
            Some(factor) => factor,
            None => {
                let order = assembled.blocks.minimum_degree()?;
                let symbolic = Symbolic::new(pattern.clone(), Ordering::Custom(&order))?;
                DirectIndefinite::new(Arc::new(symbolic), IndefiniteParams::default())?
            }
        };
        factor.factorise(assembled.matrix.values())?;
        self.factor = Some(factor);
        self.b.resize(assembled.unknowns.positions.len(), 0.0);
        self.x.resize(assembled.unknowns.positions.len(), 0.0);
        self.unknowns = Some(assembled.unknowns);
        Ok(())
    }

    fn solve(
        &mut self,
        _system: &StokesSystem<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<SolveReport, StokesError> {
        let (Some(factor), Some(unknowns)) = (&mut self.factor, &self.unknowns) else {
            return Err(StokesError::NotPrepared);
        };
        unknowns.gather(b, &mut self.b);
        factor.set_relative_tolerance(tolerance);
        let report = factor.solve(&self.b, &mut self.x)?;
        unknowns.scatter(&self.x, x);
        Ok(SolveReport {
            iterations: report.refinements,
            fine_operator_applications: (report.refinements + 1) as f64,
            residuals: factor.residual_history().to_vec(),
        })
    }
}
