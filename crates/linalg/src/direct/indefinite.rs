//! Factorisation `L B L^T` of symmetric indefinite matrices, such as the saddle points of the Stokes
//! equations.
//!
//! faer pivots (Bunch and Kaufman 1977, 10.1090/S0025-5718-1977-0428694-0) inside a supernode only. A
//! pressure whose diagonal is zero and which the ordering eliminates before any of its velocities is a pivot
//! of exactly zero, and the factor fills with NaN in silence. That is the rule, not the exception, beside
//! rigid bodies, where pressures see few free velocities. Therefore each factor is tested by a solve with a
//! known answer. If the test fails the zero diagonal entries are replaced by `-s d_i`, where
//! `d_i = sum_j a_ij^2 / |a_jj|` is the diagonal of the Schur complement with the other unknowns lumped: for
//! Stokes a slight compressibility. The matrix is then quasi-definite and has a factor for *every* ordering
//! (Vanderbei 1995, 10.1137/0805005); refinement with the true matrix removes the error of order `s` within
//! two or three steps.

use std::sync::Arc;

use faer::Conj;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::IntranodeLbltRef;

use super::refinement::{Refinement, rounding_norm};
use super::{
    DirectError, PAR, RefinementParams, RefinementReport, SIDE, Scratch, Symbolic, check_finite, columns,
};
use crate::operator::Preconditioner;
use crate::sparse::SparseMatrix;
use crate::vector;

/// Condition under which [`DirectIndefinite`] regularises zero diagonal entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regularise {
    /// A factor that fails its test is an error.
    Never,
    /// If the plain factor fails its test, which then has cost a factorisation.
    WhenNeeded,
    /// Always. Best where the plain factor is known to fail, as it is with pressures that see few free
    /// velocities: approximate minimum degree eliminates these first. Costs one refinement in each solve.
    Always,
}

/// Tuning of [`DirectIndefinite`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndefiniteParams {
    /// Accuracy of the solves.
    pub refinement: RefinementParams,
    /// When zero diagonal entries are regularised.
    pub regularise: Regularise,
    /// The number `s` they are regularised by.
    pub regularisation: f64,
}

impl Default for IndefiniteParams {
    fn default() -> Self {
        Self {
            refinement: RefinementParams::default(),
            regularise: Regularise::WhenNeeded,
            regularisation: 1e-8,
        }
    }
}

/// Outcome of a factorisation that passed its test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FactorReport {
    /// Whether zero diagonal entries had to be regularised.
    pub regularised: bool,
    /// Relative residual of the test solve, before refinement.
    pub probe_residual: f64,
}

/// A test solve that leaves more than this would not be refined fast.
const PROBE_TOLERANCE: f64 = 1e-3;

/// Direct solver for symmetric indefinite matrices with one pattern.
#[derive(Debug)]
pub struct DirectIndefinite {
    symbolic: Arc<Symbolic>,
    params: IndefiniteParams,
    matrix: SparseMatrix,
    factor: Factor,
    factorised: bool,
    refinement: Refinement,
    /// Right-hand side, then residual, and solution of the test solve; the first also holds the diagonal.
    probe: [Vec<f64>; 2],
}

/// The numbers of `L B L^T`.
#[derive(Debug)]
struct Factor {
    values: Vec<f64>,
    subdiagonal: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    numeric_scratch: Scratch,
    solve_scratch: Scratch,
}

impl DirectIndefinite {
    /// A solver with its memory, without a factorisation.
    pub fn new(symbolic: Arc<Symbolic>, params: IndefiniteParams) -> Result<Self, DirectError> {
        let dim = symbolic.dim();
        Ok(Self {
            params,
            matrix: SparseMatrix::zeros(symbolic.pattern().clone()),
            factor: Factor::new(&symbolic)?,
            factorised: false,
            refinement: Refinement::new(dim, params.refinement),
            probe: [vec![0.0; dim], vec![0.0; dim]],
            symbolic,
        })
    }

    /// The shared symbolic part.
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }

    /// Factorises the matrix with the given values, in the order of the pattern, and tests the factor by a
    /// solve.
    pub fn factorise(&mut self, values: &[f64]) -> Result<FactorReport, DirectError> {
        self.factorised = false;
        self.matrix.copy_values(values)?;
        check_finite("matrix", values)?;
        let (mut regularised, mut probe_residual) = match self.params.regularise {
            Regularise::Always => (true, self.factorise_regularised(values)?),
            Regularise::Never | Regularise::WhenNeeded => (false, self.factorise_plain()),
        };
        if !passes(probe_residual) && self.params.regularise == Regularise::WhenNeeded {
            (regularised, probe_residual) = (true, self.factorise_regularised(values)?);
        }
        if !passes(probe_residual) {
            return Err(DirectError::Singular { probe_residual });
        }
        self.factorised = true;
        Ok(FactorReport { regularised, probe_residual })
    }

    /// Factorises and returns the residual of the test solve.
    fn factorise_plain(&mut self) -> f64 {
        self.factor.compute(&self.symbolic, self.matrix.values());
        self.probe()
    }

    /// The same with zero diagonal entries regularised in the factor, not in the matrix that residuals are
    /// taken of.
    fn factorise_regularised(&mut self, values: &[f64]) -> Result<f64, DirectError> {
        self.regularise();
        self.factor.compute(&self.symbolic, self.matrix.values());
        self.matrix.copy_values(values)?;
        Ok(self.probe())
    }

    /// Solves `A x = rhs` to the tolerance of the parameters. The old content of `x` does not matter.
    pub fn solve(&mut self, rhs: &[f64], x: &mut [f64]) -> Result<RefinementReport, DirectError> {
        self.symbolic.check_solve(self.factorised, rhs, x)?;
        let Self { symbolic, matrix, factor, refinement, .. } = self;
        refinement.solve(matrix, |x| factor.substitute(symbolic, x), rhs, x)
    }

    /// Norms of the true residual in the last solve, the first before refinement.
    pub fn residual_history(&self) -> &[f64] {
        self.refinement.history()
    }

    /// Norm of the residual `b - A x` that rounding alone leaves: no solver in this precision does better.
    pub fn rounding_norm(&self, b: &[f64], x: &[f64]) -> f64 {
        rounding_norm(&self.matrix, b, x)
    }

    /// Changes the tolerance of later solves.
    pub fn set_relative_tolerance(&mut self, tolerance: f64) {
        self.refinement.set_relative_tolerance(tolerance);
    }

    /// Relative residual of a solve for a fixed pseudo-random right-hand side in the range of the matrix.
    fn probe(&mut self) -> f64 {
        let [b, x] = &mut self.probe;
        vector::fill_pseudo_random(1, x);
        self.matrix.multiply(x, b);
        x.copy_from_slice(b);
        self.factor.substitute(&self.symbolic, x);
        let size = vector::norm(b);
        self.matrix.multiply_add(-1.0, x, b);
        let residual = vector::norm(b) / size;
        if residual.is_finite() { residual } else { f64::INFINITY }
    }

    /// Replaces the zero diagonal entries `a_ii` by `-s max(d_i, floor)`.
    fn regularise(&mut self) {
        let [diagonal, lumped] = &mut self.probe;
        for (row, entry) in diagonal.iter_mut().enumerate() {
            *entry = self.matrix.get(row, row);
        }
        let mut largest: f64 = 0.0;
        for (row, lumped) in lumped.iter_mut().enumerate().filter(|&(row, _)| diagonal[row] == 0.0) {
            *lumped = lumped_schur_diagonal(&self.matrix, diagonal, row);
            largest = largest.max(*lumped);
        }
        let floor = LUMPED_FLOOR * largest;
        for row in (0..diagonal.len()).filter(|&row| diagonal[row] == 0.0) {
            if let Some(position) = self.symbolic.pattern().position(row, row) {
                self.matrix.values_mut()[position] = -self.params.regularisation * lumped[row].max(floor);
            }
        }
    }
}

/// `d_i` counts for at least this fraction of the largest. A pressure whose couplings are rounding errors
/// would else keep a pivot that is one; and where the system is truly singular, the null vector would be
/// filled with noise.
const LUMPED_FLOOR: f64 = 1e-2;

/// `d_i = sum_j a_ij^2 / |a_jj|` over the `j` with a diagonal.
fn lumped_schur_diagonal(matrix: &SparseMatrix, diagonal: &[f64], row: usize) -> f64 {
    let pattern = matrix.pattern();
    let entries = pattern.columns_of(row).iter().zip(&matrix.values()[pattern.range(row)]);
    entries
        .map(|(&column, value)| (value, diagonal[column as usize].abs()))
        .filter(|&(_, size)| size > 0.0)
        .map(|(value, size)| value * value / size)
        .sum()
}

fn passes(probe_residual: f64) -> bool {
    probe_residual <= PROBE_TOLERANCE
}

/// Substitution without a check of the residual, for use inside an iteration that checks its own. Without a
/// factorisation the result is NaN, which every Krylov method here reports.
impl Preconditioner<f64> for DirectIndefinite {
    fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        if !self.factorised {
            z.fill(f64::NAN);
            return;
        }
        z.copy_from_slice(r);
        self.factor.substitute(&self.symbolic, z);
    }
}

impl Factor {
    fn new(symbolic: &Symbolic) -> Result<Self, DirectError> {
        let (dim, analysis) = (symbolic.dim(), &symbolic.analysis);
        let numeric = analysis.factorize_numeric_intranode_lblt_scratch::<f64>(PAR, Default::default());
        let solve = analysis.solve_in_place_scratch::<f64>(1, PAR);
        Ok(Self {
            values: vec![0.0; symbolic.factor_entry_count()],
            subdiagonal: vec![0.0; dim],
            forward: vec![0; dim],
            inverse: vec![0; dim],
            numeric_scratch: Scratch::new(dim, numeric)?,
            solve_scratch: Scratch::new(dim, solve)?,
        })
    }

    fn compute(&mut self, symbolic: &Symbolic, matrix: &[f64]) {
        self.subdiagonal.fill(0.0);
        symbolic.analysis.factorize_numeric_intranode_lblt(
            &mut self.values,
            &mut self.subdiagonal,
            &mut self.forward,
            &mut self.inverse,
            symbolic.faer_matrix(matrix),
            SIDE,
            PAR,
            self.numeric_scratch.stack(),
            Default::default(),
        );
    }

    /// `x <- (L B L^T)^-1 x`.
    fn substitute(&mut self, symbolic: &Symbolic, x: &mut [f64]) {
        let pivots = PermRef::new_checked(&self.forward, &self.inverse, symbolic.dim());
        IntranodeLbltRef::new(&symbolic.analysis, &self.values, &self.subdiagonal, pivots)
            .solve_in_place_with_conj(Conj::No, columns(x, symbolic.dim()), PAR, self.solve_scratch.stack());
    }
}
