//! Krylov methods, Chebyshev smoothing and checked sparse direct solvers.
//!
//! An operator is anything that can be applied ([`LinOp`]), a preconditioner likewise ([`Preconditioner`]).
//! Methods own their workspace: after the first solve nothing is allocated. Each method has `Params`, a
//! report and a typed error, and a solve that returns `Ok` has a small *true* residual.
//!
//! ```
//! use gluey_linalg::{Gcr, GcrParams, Jacobi, Reference, SparseMatrix};
//!
//! let mut a = SparseMatrix::from_triplets(2, 2, &[(0, 0, 4.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 3.0)])?;
//! let mut jacobi = Jacobi::new(&a.diagonal())?;
//! let mut x = [0.0_f64; 2];
//! Gcr::new(GcrParams::default()).solve(&mut a, &mut jacobi, &[1.0, 2.0], &mut x, Reference::RightHandSide)?;
//! assert!((x[0] - 1.0 / 11.0).abs() < 1e-8 && (x[1] - 7.0 / 11.0).abs() < 1e-8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Long vectors are shared by the threads of the present rayon pool; sums are taken in a fixed order
//! ([`parallel`]), so equal input gives equal bits for any number of threads.
//!
//! The rooms, lowest first; a room knows only those before it: [`mod@parallel`], scalars, [`mod@vector`],
//! jagged arrays, subsets, affine constraints, operators, small dense matrices, sparse matrices, direct
//! solvers, Krylov methods, smoothers.

mod affine;
mod dense;
mod direct;
mod jagged;
mod krylov;
mod operator;
pub mod parallel;
mod scalar;
mod smoother;
mod sparse;
mod subset;
pub mod vector;

pub use affine::AffineConstraints;
pub use dense::{BlockError, DenseSymmetric, invert_spd, vectorised};
pub use direct::{
    DirectError, DirectIndefinite, DirectSpd, FactorReport, IndefiniteParams, Ordering, RefinementParams,
    RefinementReport, Regularise, Substitution, Symbolic,
};
pub use jagged::Jagged;
pub use krylov::{
    Gcr, GcrParams, KrylovError, KrylovReport, Reference, estimate_lambda_max, estimate_lambda_max_from,
    largest_ratio, lowest_modes,
};
pub use operator::{BadDiagonal, FnOp, Identity, Jacobi, LinOp, Preconditioner};
pub use scalar::Scalar;
pub use smoother::{
    Chebyshev, ChebyshevParams, Guess, ModesWorkspace, PatchError, SchwarzPatches, SpectralInterval,
    WeakModes, weak_modes,
};
pub use sparse::{
    BlockGroups, BlockPattern, LocalTerm, Pattern, Prolongation, SellMatrix, SparseError, SparseMatrix,
    SymmetricBlockMatrix,
};
pub use subset::Subset;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
