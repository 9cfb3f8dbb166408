//! Direct solution of the Stokes system: the reference, and the method of choice in 2D.

use std::sync::Arc;

use gluey_linalg::{
    DirectIndefinite, Gcr, GcrParams, IndefiniteParams, KrylovError, Ordering, Preconditioner, Reference,
    Subset, Symbolic,
};

use super::{SaddleSolver, SolveReport};
use crate::error::StokesError;
use crate::film::FilmNetwork;
use crate::formulation::Problem;
use crate::operator::{StokesSystem, SystemOperator, assemble_stokes};

/// Corrections at most; two or three are enough for any tolerance that rounding allows.
const MAX_CORRECTIONS: usize = 12;
/// Corrections between two computations of the true residual, from which the recurrence departs near rounding
/// error.
const RESTART: usize = 4;

/// Sparse `L B L^T` factorisation of the assembled saddle-point matrix, eliminated block by block in order of
/// approximate minimum degree. The symbolic part is kept as long as the pattern of the matrix stands.
///
/// The factorised matrix is a little compressible and has one pressure left out. Generalised conjugate
/// residuals on the true system, with the factor as its preconditioner, corrects both in one to three steps
/// and checks the true residual.
#[derive(Debug)]
pub struct DirectSolver {
    factor: Option<DirectIndefinite>,
    unknowns: Option<Subset>,
    films: Option<FilmNetwork>,
    krylov: Gcr<f64>,
    b: Vec<f64>,
    x: Vec<f64>,
}

impl Default for DirectSolver {
    fn default() -> Self {
        let params = GcrParams { max_iterations: MAX_CORRECTIONS, restart: RESTART, ..GcrParams::default() };
        Self {
            factor: None,
            unknowns: None,
            films: None,
            krylov: Gcr::new(params),
            b: Vec::new(),
            x: Vec::new(),
        }
    }
}

impl DirectSolver {
    /// Factorises the matrix of a system and the block of its films.
    ///
    /// # Errors
    /// If it is singular.
    pub fn factorise<const D: usize>(&mut self, system: &StokesSystem<D>) -> Result<(), StokesError> {
        let assembled = assemble_stokes(system)?;
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
        self.films = system.film_network()?;
        self.b.resize(assembled.unknowns.len(), 0.0);
        self.x.resize(assembled.unknowns.len(), 0.0);
        self.unknowns = Some(assembled.unknowns);
        Ok(())
    }
}

impl<const D: usize> SaddleSolver<D> for DirectSolver {
    fn prepare(&mut self, problem: &Problem<D>) -> Result<(), StokesError> {
        self.factorise(&problem.system)
    }

    fn solve(
        &mut self,
        system: &StokesSystem<D>,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<SolveReport, StokesError> {
        let (Some(factor), Some(unknowns)) = (&mut self.factor, &self.unknowns) else {
            return Err(StokesError::NotPrepared);
        };
        let mut consistent = b.to_vec();
        system.pressure.remove_mean(system.parts_mut(&mut consistent)[1]);
        let films = self.films.as_ref().map(FilmNetwork::correction).transpose()?;
        let mut operator = SystemOperator::new(system).with_films(films);
        let reference = system.fluid_norm(&consistent);
        let mut substitution = Substitution { system, unknowns, factor, b: &mut self.b, x: &mut self.x };
        self.krylov.set_relative_tolerance(tolerance);
        let goal = Reference::Norm(reference);
        let solved = self.krylov.solve(&mut operator, &mut substitution, &consistent, x, goal);
        let residuals = self.krylov.residual_history().to_vec();
        match solved {
            Err(KrylovError::NotConverged { residual_norm, .. })
                if residual_norm <= substitution.rounding_norm(&consistent, x) => {}
            other => drop(other?),
        }
        Ok(SolveReport {
            iterations: residuals.len() - 1,
            fine_operator_applications: operator.applications() as f64,
            residuals,
            reference,
        })
    }
}

/// The factorised matrix, inverted, between reduced vectors.
struct Substitution<'a, const D: usize> {
    system: &'a StokesSystem<D>,
    unknowns: &'a Subset,
    factor: &'a mut DirectIndefinite,
    b: &'a mut [f64],
    x: &'a mut [f64],
}

impl<const D: usize> Substitution<'_, D> {
    /// Norm of the residual that rounding alone leaves.
    fn rounding_norm(&mut self, b: &[f64], x: &[f64]) -> f64 {
        self.unknowns.gather(b, self.b);
        self.unknowns.gather(x, self.x);
        self.factor.rounding_norm(self.b, self.x)
    }
}

impl<const D: usize> Preconditioner<f64> for Substitution<'_, D> {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        self.unknowns.gather(r, self.b);
        self.factor.apply(self.b, self.x);
        self.unknowns.scatter(self.x, z);
        self.system.pressure.remove_mean(self.system.parts_mut(z)[1]);
    }
}
