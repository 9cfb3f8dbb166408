//! Errors of particles that are generated or read from a file.

use std::path::PathBuf;

use gluey_suspension::packing::PackingError;
use thiserror::Error;

use crate::text::{NotText, visible};

/// A reason why particles could not be generated or read.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ParticleProblem {
    /// More than one of the list, the generated ones and the file.
    #[error("particles come from {first} and from {second}")]
    TwoSources {
        /// The one.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// Not two of the three numbers that say how many particles of which size.
    #[error("{given} of `volume_fraction`, `count` and `radius` are given")]
    Amount {
        /// How many are.
        given: usize,
    },
    /// A key that another choice needs, or does not take.
    #[error("`{key}` {} with kind = \"{kind}\"", if *.is_missing { "is missing" } else { "has no meaning" })]
    RadiiKey {
        /// The key.
        key: &'static str,
        /// The kind of radii.
        kind: &'static str,
        /// Whether it is needed and absent.
        is_missing: bool,
    },
    /// The particles do not fit, or a number is out of its range.
    #[error("{0}")]
    Packing(PackingError),
    /// The file of particles could not be read.
    #[error("{}: cannot be read: {reason}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
        /// Whether it is there, but no text.
        is_not_text: bool,
    },
    /// Something in the file of particles is wrong.
    #[error("{}:{line}: {}", path.display(), found_or_nothing(found))]
    File {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The text as written.
        found: String,
        /// What would be right.
        wanted: String,
    },
    /// A case that was made by a program still says how to make its particles.
    #[error("the particles are not made yet")]
    NotFilled,
}

impl ParticleProblem {
    /// Hint at what would be right.
    pub fn hint(&self) -> String {
        match self {
            Self::TwoSources { .. } => "keep one of [[particles]], [suspension] and `particles_file`".into(),
            Self::Amount { .. } => "give two of them: the third follows from the box".into(),
            Self::RadiiKey { key, is_missing: true, .. } => format!("add `{key}`"),
            Self::RadiiKey { key, .. } => format!("leave out `{key}`"),
            Self::Packing(error) => packing_hint(error).into(),
            Self::Unreadable { is_not_text: true, .. } => NotText::HINT.into(),
            Self::Unreadable { .. } => {
                "name a text file with the columns x,y[,z],radius; its path begins in the folder of the case file".into()
            }
            Self::File { wanted, .. } => format!("expected {wanted}"),
            Self::NotFilled => "call `Case::fill_particles`, or read the case by `Case::parse`".into(),
        }
    }
}

fn found_or_nothing(found: &str) -> String {
    if found.is_empty() { "nothing is there".to_owned() } else { format!("found `{}`", visible(found)) }
}

fn packing_hint(error: &PackingError) -> &'static str {
    match error {
        PackingError::TooDense { .. } => "take a lower `volume_fraction` or a smaller `min_gap`",
        PackingError::LatticeTooDense { .. } => "take a lower `volume_fraction` or a denser arrangement",
        PackingError::NoLattice { .. } => "take such a `count`, or a random arrangement",
        PackingError::OtherDimension { .. } => {
            "2D has \"square\" and \"hexagonal\", 3D \"simple-cubic\", \"bcc\" and \"fcc\""
        }
        PackingError::ParticleTooLarge { .. } => "take more particles, a lower fraction or a larger box",
        PackingError::NotSettled { .. } | PackingError::Crowded { .. } => {
            "take a lower `volume_fraction`, a larger box or another seed"
        }
        PackingError::OutOfRange { .. } | PackingError::Tilted { .. } => "see the message",
    }
}
