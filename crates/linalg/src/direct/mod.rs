//! Sparse direct solvers with checked results, on the supernodal factorisations of faer. Always one thread.
//!
//! The symbolic part ([`Symbolic`]) depends on the pattern alone and is shared as long as that stands. Every
//! solve computes its true residual `b - A x`, refines, and either meets its tolerance or returns an error: a
//! factorisation that broke down can never pass for a solution.

mod indefinite;
mod ordering;
mod refinement;
mod spd;

pub use indefinite::{DirectIndefinite, FactorReport, IndefiniteParams, Regularise};
pub use refinement::{RefinementParams, RefinementReport};
pub use spd::{DirectSpd, Substitution};

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{MatMut, Par, Side};

use crate::sparse::{Pattern, SparseError};
use crate::vector;

/// Results must not depend on the number of threads, so faer is never given more than this one.
const PAR: Par = Par::Seq;

/// The triangle that faer reads; the matrices are stored whole.
const SIDE: Side = Side::Lower;

/// Order in which the unknowns are eliminated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ordering<'a> {
    /// Approximate minimum degree (Amestoy, Davis and Duff 1996). Good in 2D; in 3D nested dissection fills
    /// less.
    Amd,
    /// Order of the rows.
    Natural,
    /// The unknown eliminated in each place.
    Custom(&'a [usize]),
}

/// Reason why a direct solver refused or failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DirectError {
    /// The pattern is not symmetric or has no complete diagonal.
    #[error("the pattern is not symmetric with a complete diagonal")]
    PatternNotSymmetric,
    /// The custom ordering is not a permutation of all rows.
    #[error("the ordering is not a permutation: place {place}")]
    BadOrdering {
        /// First place with an index that is out of range or has come before; the length, if that is wrong.
        place: usize,
    },
    /// Not enough memory, or more entries in the factor than indices can count.
    #[error("the factor of {dim} unknowns does not fit into memory")]
    OutOfMemory {
        /// Dimension of the matrix.
        dim: usize,
    },
    /// The number of values is not that of the pattern.
    #[error(transparent)]
    Values(#[from] SparseError),
    /// A vector does not have the length of the matrix.
    #[error("matrix of dimension {expected} was given a vector of length {found}")]
    DimensionMismatch {
        /// Dimension of the matrix.
        expected: usize,
        /// Length of the vector.
        found: usize,
    },
    /// The matrix or the right-hand side has an infinite or undefined entry.
    #[error("{what} has an entry that is not finite, at position {position}")]
    NotFinite {
        /// "matrix" or "right-hand side".
        what: &'static str,
        /// Position of the first such entry.
        position: usize,
    },
    /// A pivot of a Cholesky factorisation is not positive.
    #[error("the matrix is not positive definite: pivot {pivot} of the elimination")]
    NotPositiveDefinite {
        /// Place of the pivot in the order of elimination.
        pivot: usize,
    },
    /// The matrix is singular to working precision.
    #[error("the matrix is singular: a test solve leaves the relative residual {probe_residual:e}")]
    Singular {
        /// Relative residual of the solve that tests the factor; infinite where the factor is not finite.
        probe_residual: f64,
    },
    /// Solve before a successful factorisation.
    #[error("there is no factorisation to solve with")]
    NotFactorised,
    /// Refinement did not reach the tolerance.
    #[error("residual {residual_norm:e} after refinement, wanted {target_norm:e}")]
    NotConverged {
        /// Norm of the true residual of the `x` handed back.
        residual_norm: f64,
        /// Norm that was asked for.
        target_norm: f64,
        /// Norms of the true residual, the first before refinement.
        history: Vec<f64>,
    },
}

/// Elimination order and pattern of the factor of symmetric matrices with one pattern.
#[derive(Debug)]
pub struct Symbolic {
    pattern: Arc<Pattern>,
    analysis: SymbolicCholesky<u32>,
}

impl Symbolic {
    /// Analyses a symmetric pattern that holds both triangles and the whole diagonal.
    pub fn new(pattern: Arc<Pattern>, ordering: Ordering<'_>) -> Result<Self, DirectError> {
        let dim = pattern.row_count();
        let has_diagonal = (0..dim).all(|row| pattern.position(row, row).is_some());
        if !(has_diagonal && pattern.is_symmetric()) {
            return Err(DirectError::PatternNotSymmetric);
        }
        let analysis = match ordering {
            Ordering::Amd => analyse(&pattern, SymmetricOrdering::Amd),
            Ordering::Natural => analyse(&pattern, SymmetricOrdering::Identity),
            Ordering::Custom(order) => {
                let (forward, inverse) = permutation(dim, order)?;
                analyse(&pattern, SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, dim)))
            }
        }?;
        Ok(Self { pattern, analysis })
    }

    /// The pattern.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Number of unknowns.
    pub fn dim(&self) -> usize {
        self.pattern.row_count()
    }

    /// Numbers stored for the factor (8 bytes each).
    pub fn factor_entry_count(&self) -> usize {
        self.analysis.len_val()
    }

    fn check_solve(&self, factorised: bool, rhs: &[f64], x: &[f64]) -> Result<(), DirectError> {
        if !factorised {
            return Err(DirectError::NotFactorised);
        }
        let expected = self.dim();
        if let Some(found) = [rhs.len(), x.len()].into_iter().find(|&len| len != expected) {
            return Err(DirectError::DimensionMismatch { expected, found });
        }
        check_finite("right-hand side", rhs)
    }

    fn faer_pattern(&self) -> SymbolicSparseColMatRef<'_, u32> {
        faer_pattern(&self.pattern)
    }

    fn faer_matrix<'a>(&'a self, values: &'a [f64]) -> SparseColMatRef<'a, u32, f64> {
        SparseColMatRef::new(self.faer_pattern(), values)
    }
}

fn faer_pattern(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, u32> {
    let dim = pattern.row_count();
    // Rows and columns of a symmetric pattern are the same.
    SymbolicSparseColMatRef::new_checked(dim, dim, pattern.row_start(), None, pattern.columns())
}

fn analyse(
    pattern: &Pattern,
    ordering: SymmetricOrdering<'_, u32>,
) -> Result<SymbolicCholesky<u32>, DirectError> {
    // Only the supernodal factorisation pivots; the simplicial one stops at a zero pivot.
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    factorize_symbolic_cholesky(faer_pattern(pattern), SIDE, ordering, params)
        .map_err(|_| DirectError::OutOfMemory { dim: pattern.row_count() })
}

fn permutation(dim: usize, order: &[usize]) -> Result<(Vec<u32>, Vec<u32>), DirectError> {
    if order.len() != dim {
        return Err(DirectError::BadOrdering { place: order.len() });
    }
    let mut inverse = vec![u32::MAX; dim];
    for (place, &unknown) in order.iter().enumerate() {
        match inverse.get_mut(unknown) {
            Some(slot) if *slot == u32::MAX => *slot = place as u32,
            _ => return Err(DirectError::BadOrdering { place }),
        }
    }
    Ok((order.iter().map(|&unknown| unknown as u32).collect(), inverse))
}

/// Working memory that faer asks for.
struct Scratch(MemBuffer);

impl Scratch {
    fn new(dim: usize, requirement: StackReq) -> Result<Self, DirectError> {
        MemBuffer::try_new(requirement).map(Self).map_err(|_| DirectError::OutOfMemory { dim })
    }

    fn stack(&mut self) -> &mut MemStack {
        MemStack::new(&mut self.0)
    }
}

impl std::fmt::Debug for Scratch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scratch").finish_non_exhaustive()
    }
}

fn check_finite(what: &'static str, values: &[f64]) -> Result<(), DirectError> {
    if vector::all_finite(values) {
        return Ok(());
    }
    let position = values.iter().position(|value| !value.is_finite()).unwrap_or(0);
    Err(DirectError::NotFinite { what, position })
}

/// Vectors of this length, one after the other, as columns of faer's matrix.
fn columns(x: &mut [f64], rows: usize) -> MatMut<'_, f64> {
    let count = x.len().checked_div(rows).unwrap_or(0);
    MatMut::from_column_major_slice_mut(x, rows, count)
}
