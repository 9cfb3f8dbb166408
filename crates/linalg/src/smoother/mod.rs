//! Smoothers: they damp the part of an error that a coarser mesh does not see.

mod chebyshev;
mod modes;
mod schwarz;

pub use chebyshev::{Chebyshev, ChebyshevParams, Guess, SpectralInterval};
pub use modes::{ModesWorkspace, WeakModes, weak_modes};
pub use schwarz::{PatchError, SchwarzPatches};
