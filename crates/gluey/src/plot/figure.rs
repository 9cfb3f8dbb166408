//! Kinds of pictures.

use std::str::FromStr;

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
}

impl Figure {
    /// All, in the order in which they are drawn.
    pub const ALL: [Self; 4] = [Self::Gaps, Self::Trajectories, Self::Rheology, Self::Solver];

    /// Name in files and options.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Gaps => "gaps",
            Self::Trajectories => "trajectories",
            Self::Rheology => "rheology",
            Self::Solver => "solver",
        }
    }
}

impl FromStr for Figure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::as_str).join(", ");
        let found = Self::ALL.into_iter().find(|figure| figure.as_str() == text);
        found.ok_or_else(|| format!("expected one of {}", names()))
    }
}
