//! The choices a case file makes by name.

use std::fmt;
use std::str::FromStr;

use gluey_contact::ContactLaw;
use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::suggest::{closest, former};

/// A name that is none of the known ones.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("`{found}` is not a known {what}")]
pub struct UnknownName {
    /// Kind of the name: `strategy`, `formulation`, ...
    pub what: String,
    /// The name as given.
    pub found: String,
    /// All names that would be right.
    pub known: Vec<String>,
}

impl UnknownName {
    /// Hint at the known names, with the nearest one first.
    pub fn hint(&self) -> String {
        let choices = self.known.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        if let Some(instead) = former(&self.found) {
            return format!("{instead}; one of {choices}");
        }
        match closest(&self.found, self.known.iter().map(String::as_str)) {
            Some(near) => format!("did you mean \"{near}\"? One of {choices}"),
            None => format!("one of {choices}"),
        }
    }
}

/// Whether a name can be part of that of a file: letters, digits, `-` and `_`, at most 64 of them.
pub(super) fn is_file_name(name: &str) -> bool {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    !name.is_empty() && name.len() <= 64 && name.chars().all(fits)
}

/// A text that is one of `names`: of a type that other crates have.
pub(super) fn schema_of_names<T: Serialize>(names: &[T]) -> Schema {
    schemars::json_schema!({ "type": "string", "enum": names })
}

/// An enum whose variants have names: `Display`, `FromStr`, serde and the list of all of them.
macro_rules! named {
    ($(#[$doc:meta])* $type:ident, $what:literal { $($(#[$variant_doc:meta])* $variant:ident = $name:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
        pub enum $type {
            $($(#[$variant_doc])* #[serde(rename = $name)] $variant),+
        }

        impl $type {
            /// All choices, in the order of the documentation.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];
            /// Their names, in the same order.
            pub const NAMES: &'static [&'static str] = &[$($name),+];

            /// The name used in case files and on the command line.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.name())
            }
        }

        impl FromStr for $type {
            type Err = UnknownName;

            fn from_str(found: &str) -> Result<Self, UnknownName> {
                Self::ALL.iter().copied().find(|choice| choice.name() == found).ok_or_else(|| UnknownName {
                    what: $what.to_owned(),
                    found: found.to_owned(),
                    known: Self::NAMES.iter().map(|&name| name.to_owned()).collect(),
                })
            }
        }
    };
}

named! {
    /// How rigidity of the particles enters the flow equations.
    Formulation, "formulation" {
        /// Viscosity ratio and Uzawa multiplier, as in the paper: soft near contact.
        Paper = "paper",
        /// The fluid ends at the true surfaces, wherever these cut the mesh.
        #[default]
        Unfitted = "unfitted",
    }
}

named! {
    /// What keeps particles from overlapping.
    Strategy, "strategy" {
        /// Nothing but the flow.
        None = "none",
        /// Pushes after the move, see [`ContactLaw::VelocityCorrection`].
        VelocityCorrection = "velocity-correction",
        /// Contacts that never pull, see [`ContactLaw::Inelastic`].
        Inelastic = "inelastic",
        /// Contacts with a memory, see [`ContactLaw::Gluey`].
        #[default]
        Gluey = "gluey",
        /// Rough surfaces with friction, whose forces act in the flow, see [`gluey_contact::FlowContact`].
        Rough = "rough",
    }
}

named! {
    /// Metric in which contact forces move particles.
    Metric, "metric of contact" {
        /// That of the flow: forces act in it.
        Flow = "flow",
        /// That of the Stokes drag of each particle, after the flow.
        #[default]
        Drag = "drag",
    }
}

impl Strategy {
    /// The law of [`gluey_contact::PairContact`] of this name; `None` for contacts whose forces act in the
    /// flow.
    pub fn law(self) -> Option<ContactLaw> {
        match self {
            Self::None => Some(ContactLaw::None),
            Self::VelocityCorrection => Some(ContactLaw::VelocityCorrection),
            Self::Inelastic => Some(ContactLaw::Inelastic),
            Self::Gluey => Some(ContactLaw::Gluey),
            Self::Rough => None,
        }
    }
}

named! {
    /// What acts in films between particles that are too thin for the mesh.
    Lubrication, "lubrication" {
        /// The resistance that the mesh lacks, by lubrication theory.
        #[default]
        Deficit = "deficit",
        /// Nothing beyond what the mesh resolves.
        None = "none",
    }
}

named! {
    /// Who predicts the velocities of the particles.
    Hydrodynamics, "hydrodynamics" {
        /// Finite-element Stokes flow in the box.
        #[default]
        Stokes = "stokes",
        /// Two equal spheres in unbounded shear flow (Batchelor and Green 1972); 3D only.
        PairMobility = "pair-mobility",
    }
}

named! {
    /// Format of a stream of frames.
    OutputKind, "kind" {
        /// Flow, particles and contacts for ParaView, VTK and meshio.
        #[default]
        Vtk = "vtk",
        /// Particles in extended XYZ, for OVITO and ASE.
        Xyz = "xyz",
    }
}

named! {
    /// Bits of the numbers in files.
    Precision, "precision" {
        /// 32 bits: seven digits, half the size.
        Single = "f32",
        /// 64 bits: the numbers as they were computed.
        #[default]
        Double = "f64",
    }
}

named! {
    /// How the Stokes equations are solved.
    Solver, "solver" {
        /// Direct in 2D, multigrid in 3D.
        #[default]
        Auto = "auto",
        /// Sparse factorisation.
        Direct = "direct",
        /// Krylov iteration with a multigrid preconditioner.
        Multigrid = "multigrid",
    }
}

named! {
    /// How `paper` takes the motion of a particle from the field.
    ParticleVelocity, "velocity" {
        /// The rigid motion closest to the field over the particle.
        #[default]
        Mean = "mean",
        /// Velocity and half the vorticity at the centre: the paper's `u(X_i)`.
        Center = "center",
    }
}

named! {
    /// How generated particles are arranged.
    ArrangementName, "arrangement" {
        /// Hard particles in equilibrium, by Monte Carlo moves.
        #[default]
        Equilibrium = "equilibrium",
        /// Random points, grown and pushed apart.
        Random = "random",
        /// Discs on a square lattice.
        Square = "square",
        /// Discs on a hexagonal lattice.
        Hexagonal = "hexagonal",
        /// Spheres on a simple cubic lattice.
        SimpleCubic = "simple-cubic",
        /// Spheres on a body-centred cubic lattice.
        BodyCentred = "bcc",
        /// Spheres on a face-centred cubic lattice.
        FaceCentred = "fcc",
    }
}

named! {
    /// How the radii of generated particles are distributed.
    RadiiKind, "kind" {
        /// All are equal.
        #[default]
        Equal = "equal",
        /// Two radii.
        Bidisperse = "bidisperse",
        /// The logarithm is normally distributed.
        Lognormal = "lognormal",
    }
}

named! {
    /// Condition on the boundary of the box.
    Boundary, "boundary" {
        /// The velocity of undisturbed shear, `rate (y - y_mid) e_x`, on the whole boundary.
        #[default]
        Couette = "couette",
        /// Moving walls below and above (y), periodic in x (and z).
        Periodic = "periodic",
        /// Simple shear for ever: periodic in all directions, with images that slide along each other.
        Sheared = "sheared",
    }
}
