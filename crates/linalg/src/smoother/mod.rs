//! Smoothers: they damp the part of an error that a coarser mesh does not see.

mod chebyshev;

pub use chebyshev::{Chebyshev, ChebyshevParams, Guess, SpectralInterval};
