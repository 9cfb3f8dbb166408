//! Contact laws and their parameters.

use std::{fmt, str::FromStr};

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::solver::{Accelerated, ActiveSet, Auto, ProjectionSolver, Uzawa};

/// The contact law: the response of particles that would overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum ContactLaw {
    /// Nothing: particles may overlap.
    None,
    /// After the move, each pair closer than a threshold gap is pushed apart along its normal, pair after
    /// pair; the push enters as a correction of the velocities. Neither a projection nor reversible.
    VelocityCorrection,
    /// Projection on the velocities that do not overlap; `gamma = 0` always, contacts never pull.
    Inelastic,
    /// The gluey model (Maury 2007; Lefebvre 2009): projection, with contacts that stay closed until what
    /// pushed them together has been pulled out again.
    Gluey,
}

impl ContactLaw {
    /// All contact laws.
    pub const ALL: [Self; 4] = [Self::None, Self::VelocityCorrection, Self::Inelastic, Self::Gluey];
}

impl fmt::Display for ContactLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::VelocityCorrection => "velocity-correction",
            Self::Inelastic => "inelastic",
            Self::Gluey => "gluey",
        })
    }
}

/// A name of no contact law, or of no solver.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown contact {what} `{name}`: expected {expected}")]
pub struct UnknownName {
    what: &'static str,
    name: String,
    expected: &'static str,
}

impl FromStr for ContactLaw {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        let expected = "`none`, `velocity-correction`, `inelastic` or `gluey`";
        let found = Self::ALL.into_iter().find(|law| law.to_string() == name);
        found.ok_or_else(|| UnknownName { what: "law", name: name.to_owned(), expected })
    }
}

/// The update rule of gamma: how it follows `d gamma / dt = -lambda` (Verdon et al. 2010, eq. 25), and when a
/// contact opens.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum GammaUpdate {
    /// The paper's (eq. 30): `gamma <- min(0, gamma - dt lambda)`; the gap of a pair with `gamma < 0` stays
    /// closed for the whole step. First order: a contact ends at the end of a step. In jammed clusters, with
    /// as many contacts as degrees of freedom, the closed pairs may be infeasible; that ends with an error.
    #[default]
    Paper,
    /// By the scheme that moves the particles, `gamma <- gamma - c lambda^n - (dt - c) lambda^{n-1}`, with
    /// `0 <= gap`, `gamma <= 0` and `gap * gamma = 0` at the end of the step: a contact ends within the step.
    /// Second order for Adams-Bashforth 2, and never infeasible: the pull of a contact is bounded by its
    /// memory.
    Consistent,
}

/// Method that solves the projection; all give the same velocities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum SolverKind {
    /// A closed form for one contact, Uzawa's method for two, the active set for more, and what helps where
    /// that is slow.
    #[default]
    Auto,
    /// Uzawa's (Verdon et al. 2010, eq. 29). A pair takes one iteration, a chain of n contacts some `30 n^2`.
    Uzawa,
    /// Accelerated projected gradients (Nesterov, with restarts). For many contacts and few digits.
    Accelerated,
    /// Conjugate gradients on the active set (MPRGP; Dostal 2009). For many contacts.
    ActiveSet,
}

impl SolverKind {
    /// All solvers.
    pub const ALL: [Self; 4] = [Self::Auto, Self::Uzawa, Self::Accelerated, Self::ActiveSet];
    /// Their names, in the same order.
    pub const NAMES: [&str; 4] = ["auto", "uzawa", "accelerated", "active-set"];

    /// The method of this name.
    pub(crate) fn method(self) -> &'static dyn ProjectionSolver {
        match self {
            Self::Auto => &Auto,
            Self::Uzawa => &Uzawa,
            Self::Accelerated => &Accelerated,
            Self::ActiveSet => &ActiveSet,
        }
    }
}

impl fmt::Display for SolverKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(Self::NAMES[*self as usize])
    }
}

impl FromStr for SolverKind {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        let expected = "`auto`, `uzawa`, `accelerated` or `active-set`";
        let found = Self::ALL.into_iter().find(|solver| solver.to_string() == name);
        found.ok_or_else(|| UnknownName { what: "solver", name: name.to_owned(), expected })
    }
}

/// Tuning of [`crate::PairContact`]. The defaults are the gluey law with the paper's first-order gap.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct ContactParams {
    /// The contact law.
    pub law: ContactLaw,
    /// Whether the constraint is re-linearised until the gap at the *end* of the step is exact to round-off.
    /// Without it a closed pair that turns by `phi` in a step opens by `(a_i + a_j) phi^2 / 2`.
    pub exact_gap: bool,
    /// The update rule of gamma.
    pub gamma_update: GammaUpdate,
    /// Floor of gamma (< 0; unit: length^2), for rough particles: however long they were pressed together,
    /// they separate after this impulse. In lubrication theory `gamma = a^2 ln(gap)` up to a constant,
    /// `a = a_i a_j/(a_i+a_j)`.
    pub gamma_min: Option<f64>,
    /// Gap kept by [`ContactLaw::VelocityCorrection`], relative to the mean radius of the pair.
    pub threshold: f64,
    /// Solver of the projection.
    pub solver: SolverKind,
    /// Residual `max |min(gap, ||A|| (lambda - floor))|` at which the projection has converged, relative to
    /// the larger of the smallest radius and the largest displacement of the step.
    pub tolerance: f64,
    /// Most iterations of one solve.
    pub iteration_limit: usize,
    /// Most linearisations of one step.
    pub pass_limit: usize,
}

impl Default for ContactParams {
    fn default() -> Self {
        Self {
            law: ContactLaw::Gluey,
            exact_gap: false,
            gamma_update: GammaUpdate::Paper,
            gamma_min: None,
            threshold: 1e-4,
            solver: SolverKind::Auto,
            tolerance: 1e-13,
            iteration_limit: 500_000,
            pass_limit: 100,
        }
    }
}

impl ContactParams {
    /// The residual that is asked for, a length: the relative tolerance times a length of the step, but never
    /// below what positions can resolve. For bodies of at least this `radius` that move by `farthest` at
    /// most, no farther than `extent` from the origin.
    pub(crate) fn residual(&self, radius: f64, farthest: f64, extent: f64) -> f64 {
        (self.tolerance * radius.max(farthest)).max(8.0 * f64::EPSILON * (extent + farthest))
    }
}
