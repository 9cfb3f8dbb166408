//! Sparse Cholesky factorisation `L L^T` of symmetric positive definite matrices.

use std::sync::Arc;

use faer::Conj;
use faer::linalg::solvers::LltError;
use faer::sparse::linalg::cholesky::LltRef;

use super::refinement::Refinement;
use super::{
    DirectError, PAR, RefinementParams, RefinementReport, SIDE, Scratch, Symbolic, check_finite, columns,
};
use crate::operator::Preconditioner;
use crate::sparse::SparseMatrix;

/// Direct solver for symmetric positive definite matrices with one pattern.
#[derive(Debug)]
pub struct DirectSpd {
    symbolic: Arc<Symbolic>,
    matrix: SparseMatrix,
    factor: Vec<f64>,
    factorised: bool,
    refinement: Refinement,
    numeric_scratch: Scratch,
    solve_scratch: Scratch,
}

impl DirectSpd {
    /// A solver with its memory, without a factorisation.
    pub fn new(symbolic: Arc<Symbolic>, params: RefinementParams) -> Result<Self, DirectError> {
        let dim = symbolic.dim();
        let numeric = symbolic.analysis.factorize_numeric_llt_scratch::<f64>(PAR, Default::default());
        let solve = symbolic.analysis.solve_in_place_scratch::<f64>(1, PAR);
        Ok(Self {
            matrix: SparseMatrix::zeros(symbolic.pattern().clone()),
            factor: vec![0.0; symbolic.factor_entry_count()],
            factorised: false,
            refinement: Refinement::new(dim, params),
            numeric_scratch: Scratch::new(dim, numeric)?,
            solve_scratch: Scratch::new(dim, solve)?,
            symbolic,
        })
    }

    /// The shared symbolic part.
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }

    /// Factorises the matrix with the given values, in the order of the pattern.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), DirectError> {
        self.factorised = false;
        self.matrix.copy_values(values)?;
        check_finite("matrix", values)?;
        let result = self.symbolic.analysis.factorize_numeric_llt(
            &mut self.factor,
            self.symbolic.faer_matrix(self.matrix.values()),
            SIDE,
            Default::default(),
            PAR,
            self.numeric_scratch.stack(),
            Default::default(),
        );
        match result {
            Ok(_) => {
                self.factorised = true;
                Ok(())
            }
            Err(LltError::NonPositivePivot { index }) => {
                Err(DirectError::NotPositiveDefinite { pivot: index })
            }
        }
    }

    /// Solves `A x = rhs` to the tolerance of the parameters. The old content of `x` does not matter.
    pub fn solve(&mut self, rhs: &[f64], x: &mut [f64]) -> Result<RefinementReport, DirectError> {
        self.symbolic.check_solve(self.factorised, rhs, x)?;
        let Self { symbolic, matrix, factor, refinement, solve_scratch, .. } = self;
        refinement.solve(matrix, |x| substitute(symbolic, factor, solve_scratch, x), rhs, x)
    }

    /// Norms of the true residual in the last solve, the first before refinement.
    pub fn residual_history(&self) -> &[f64] {
        self.refinement.history()
    }

    /// Changes the tolerance of later solves.
    pub fn set_relative_tolerance(&mut self, tolerance: f64) {
        self.refinement.set_relative_tolerance(tolerance);
    }
}

/// A factorisation of a [`DirectSpd`] with memory of its own: several threads solve with one factor.
#[derive(Debug)]
pub struct Substitution<'a> {
    solver: &'a DirectSpd,
    scratch: Scratch,
}

impl DirectSpd {
    /// Substitution as by [`Preconditioner::apply`], beside others, for up to so many vectors one after the
    /// other: together they take a fraction of the time of each alone.
    ///
    /// # Errors
    /// [`DirectError::OutOfMemory`].
    pub fn substitution(&self, most_vectors: usize) -> Result<Substitution<'_>, DirectError> {
        let needed = self.symbolic.analysis.solve_in_place_scratch::<f64>(most_vectors, PAR);
        Ok(Substitution { solver: self, scratch: Scratch::new(self.symbolic.dim(), needed)? })
    }
}

impl Preconditioner<f64> for Substitution<'_> {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let DirectSpd { symbolic, factor, factorised, .. } = self.solver;
        answer(symbolic, factorised.then_some(factor), &mut self.scratch, r, z);
    }
}

/// Substitution without a check of the residual, for use inside an iteration that checks its own. Without a
/// factorisation the result is NaN, which every Krylov method here reports.
impl Preconditioner<f64> for DirectSpd {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        let Self { symbolic, factor, factorised, solve_scratch, .. } = self;
        answer(symbolic, factorised.then_some(factor), solve_scratch, r, z);
    }
}

/// `z = (L L^T)^-1 r`, NaN without a factor.
fn answer(symbolic: &Symbolic, factor: Option<&Vec<f64>>, scratch: &mut Scratch, r: &[f64], z: &mut [f64]) {
    match factor {
        None => z.fill(f64::NAN),
        Some(factor) => {
            z.copy_from_slice(r);
            substitute(symbolic, factor, scratch, z);
        }
    }
}

/// `x <- (L L^T)^-1 x` for vectors one after the other.
fn substitute(symbolic: &Symbolic, factor: &[f64], scratch: &mut Scratch, x: &mut [f64]) {
    LltRef::new(&symbolic.analysis, factor).solve_in_place_with_conj(
        Conj::No,
        columns(x, symbolic.dim()),
        PAR,
        scratch.stack(),
    );
}
