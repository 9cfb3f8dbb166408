//! The native part of the Python package `gluey`.
//!
//! Python sees arrays and dictionaries of this module only through the package, which checks and documents
//! them (`python/gluey`); what is done here is to hand them to the crates, on threads that do not hold the
//! interpreter, and to turn errors into exceptions of `gluey.errors` with the text of the command line.

mod arrays;
mod case;
mod contact;
mod errors;
mod pool;
mod run;
mod show;
mod stokes;

/// The native part of gluey.
#[pyo3::pymodule]
mod _gluey {
    #[pymodule_export]
    use crate::case::Case;
    #[pymodule_export]
    use crate::contact::PairContact;
    #[pymodule_export]
    use crate::run::{resume, run};
    #[pymodule_export]
    use crate::show::{analyse, plot, view};
    #[pymodule_export]
    use crate::stokes::Stokes;

    /// Version of gluey.
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
