//! Kinds of pictures, and choices that are made by name.

/// An enum whose variants have names.
macro_rules! named {
    ($(#[$doc:meta])* $type:ident { $($(#[$variant_doc:meta])* $variant:ident = $name:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $type {
            $($(#[$variant_doc])* $variant),+
        }

        impl $type {
            /// All choices, in their order.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// Name in files and options.
            pub fn as_str(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        impl std::str::FromStr for $type {
            type Err = String;

            fn from_str(text: &str) -> Result<Self, String> {
                let found = Self::ALL.iter().copied().find(|one| one.as_str() == text);
                found.ok_or_else(|| format!("expected one of {}", [$($name),+].join(", ")))
            }
        }
    };
}

pub(super) use named;

named! {
    /// What can be drawn, in the order in which it is.
    Figure {
        /// Gaps against time.
        Gaps = "gaps",
        /// Paths of the centres.
        Trajectories = "trajectories",
        /// Stress against strain.
        Rheology = "rheology",
        /// What the steps cost against time.
        Solver = "solver",
        /// Contacts, clusters and fabric against strain.
        Contacts = "contacts",
        /// g(r), g(theta) and S(k).
        Correlations = "correlations",
        /// Fraction and velocity across the shear.
        Profiles = "profiles",
        /// Mean squares of the displacements beside the shear.
        Diffusion = "diffusion",
    }
}

impl Figure {
    /// Whether it is drawn of the tables of `gluey analyse`, which has one set of them in a folder.
    pub(super) fn is_of_structure(self) -> bool {
        matches!(self, Self::Contacts | Self::Correlations | Self::Profiles | Self::Diffusion)
    }
}
