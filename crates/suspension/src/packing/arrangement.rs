//! Kinds of arrangements.

use std::fmt;

/// Sweeps of an [`Arrangement::Equilibrium`] that is asked for without their number.
pub const DEFAULT_SWEEPS: usize = 4000;

/// The arrangement of particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrangement {
    /// Points at random, grown to particles that are pushed apart. Many pairs are left at the smallest gap,
    /// and the statistics are those of the procedure.
    Random,
    /// The same with Monte Carlo moves of hard balls, while they grow and then.
    Equilibrium {
        /// Moves of each particle when it has grown; while it grows there are about half as many.
        sweep_count: usize,
    },
    /// Discs on a square lattice.
    Square,
    /// Discs on a hexagonal lattice with rows along `x`.
    Hexagonal,
    /// Spheres on a simple cubic lattice.
    SimpleCubic,
    /// Spheres on a body-centred cubic lattice.
    BodyCentred,
    /// Spheres on a face-centred cubic lattice.
    FaceCentred,
}

impl Default for Arrangement {
    fn default() -> Self {
        Self::Equilibrium { sweep_count: DEFAULT_SWEEPS }
    }
}

impl Arrangement {
    /// All kinds.
    pub const ALL: [Self; 7] = [
        Self::Equilibrium { sweep_count: DEFAULT_SWEEPS },
        Self::Random,
        Self::Square,
        Self::Hexagonal,
        Self::SimpleCubic,
        Self::BodyCentred,
        Self::FaceCentred,
    ];

    /// The name of the kind.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Equilibrium { .. } => "equilibrium",
            Self::Square => "square",
            Self::Hexagonal => "hexagonal",
            Self::SimpleCubic => "simple-cubic",
            Self::BodyCentred => "bcc",
            Self::FaceCentred => "fcc",
        }
    }

    /// Whether particles are on the sites of a lattice.
    pub fn is_lattice(self) -> bool {
        !matches!(self, Self::Random | Self::Equilibrium { .. })
    }
}

impl fmt::Display for Arrangement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
