//! Kinds of pictures.

use std::str::FromStr;

/// That of all choices which has a name.
pub(super) fn named<T: Copy, const N: usize>(
    name: &str,
    all: [T; N],
    name_of: fn(T) -> &'static str,
) -> Result<T, String> {
    let found = all.into_iter().find(|one| name_of(*one) == name);
    found.ok_or_else(|| format!("expected one of {}", all.map(name_of).join(", ")))
}

/// What can be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// Gaps against time.
    Gaps,
    /// Paths of the centres.
    Trajectories,
    /// Stress against strain.
    Rheology,
    /// What the steps cost against time.
    Solver,
    /// Contacts, clusters and fabric against strain.
    Contacts,
    /// g(r), g(theta) and S(k).
    Correlations,
    /// Fraction and velocity across the shear.
    Profiles,
    /// Mean squares of the displacements beside the shear.
    Diffusion,
}

impl Figure {
    /// All, in the order in which they are drawn.
    pub const ALL: [Self; 8] = [
        Self::Gaps,
        Self::Trajectories,
        Self::Rheology,
        Self::Solver,
        Self::Contacts,
        Self::Correlations,
        Self::Profiles,
        Self::Diffusion,
    ];

    /// Name in files and options.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Gaps => "gaps",
            Self::Trajectories => "trajectories",
            Self::Rheology => "rheology",
            Self::Solver => "solver",
            Self::Contacts => "contacts",
            Self::Correlations => "correlations",
            Self::Profiles => "profiles",
            Self::Diffusion => "diffusion",
        }
    }

    /// Whether it is drawn of the tables of `gluey analyse`, which has one set of them in a folder.
    pub(super) fn is_of_structure(self) -> bool {
        matches!(self, Self::Contacts | Self::Correlations | Self::Profiles | Self::Diffusion)
    }
}

impl FromStr for Figure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        named(text, Self::ALL, Self::as_str)
    }
}
