//! Errors of a contact step.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::projection::Failure;
use crate::solver::{ResidualHistory, SolveFailure};
use crate::{ContactLaw, PairKey, Partner};

/// Failure to correct velocities, which are left as they were.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum ContactError {
    /// The slices of a step disagree.
    #[error(
        "{positions} positions, {radii} radii, {drifts} drifts and {twists} twists: they must be equally many"
    )]
    LengthMismatch {
        /// Number of positions.
        positions: usize,
        /// Number of radii.
        radii: usize,
        /// Number of drifts.
        drifts: usize,
        /// Number of twists.
        twists: usize,
    },
    /// More particles than pair keys can name.
    #[error("{count} particles are more than 2^32 - 1")]
    TooManyParticles {
        /// How many there were.
        count: usize,
    },
    /// The step is not a step.
    #[error("velocity weight {velocity_weight} and dt {dt} must be positive and finite")]
    BadStep {
        /// Factor of the velocity in the displacement.
        velocity_weight: f64,
        /// Length of the step.
        dt: f64,
    },
    /// A radius that is zero, negative or not finite.
    #[error("particle {} has the radius {radius}: it must be positive and finite", .particle + 1)]
    BadRadius {
        /// Index of the particle, from 0; messages count from 1.
        particle: usize,
        /// Its radius.
        radius: f64,
    },
    /// A position, velocity or drift that is infinite or not a number.
    #[error("particle {}: its {quantity} is not finite", .particle + 1)]
    NotFinite {
        /// Index of the particle, from 0; messages count from 1.
        particle: usize,
        /// Which of its quantities.
        quantity: String,
    },
    /// Two centres so close that the line through them has no direction.
    #[error("the centres of {pair} coincide")]
    Coincident {
        /// The particles.
        pair: PairKey,
    },
    /// Two shapes whose cores meet, so that no direction leads them apart.
    #[error("the cores of {pair} meet: they overlap by all of their rounding")]
    Entangled {
        /// The shapes.
        pair: PairKey,
    },
    /// A contact law that is defined for round particles only.
    #[error("the contact law `{law}` is defined for discs and spheres only")]
    NotForShapes {
        /// The contact law.
        law: ContactLaw,
    },
    /// A remembered contact of a particle that is not there.
    #[error("a remembered contact joins {pair}, but there are only {count} particles")]
    UnknownParticle {
        /// The contact.
        pair: PairKey,
        /// Number of particles.
        count: usize,
    },
    /// A remembered contact with a wall that is not there.
    #[error("a remembered contact joins {pair}, but there are only {count} walls")]
    UnknownWall {
        /// The contact.
        pair: PairKey,
        /// Number of walls.
        count: usize,
    },
    /// A remembered contact whose particles are not where the last step left them.
    #[error(
        "the gap of {pair}, which were in contact, is now {gap}: positions must not be wrapped into the period"
    )]
    Wrapped {
        /// The contact.
        pair: PairKey,
        /// Gap at the beginning of the step.
        gap: f64,
    },
    /// A wall whose normal is no unit vector, or that is not finite.
    #[error("wall {} needs a normal of length 1, a finite offset and a finite speed", .wall + 1)]
    BadWall {
        /// Index of the wall, from 0; messages count from 1.
        wall: usize,
    },
    /// A period that is zero, negative, not finite, or tiny beside the positions.
    #[error(
        "the period {period} along {} must be positive, and at least 1e-8 of all positions",
        axis(*.direction)
    )]
    BadPeriod {
        /// Direction, from 0.
        direction: usize,
        /// Its period.
        period: f64,
    },
    /// A tilt that is not finite or huge beside the period in x, or images that slide too fast.
    #[error(
        "the tilt {tilt} must be below 1e8 periods, and its growth {tilt_step} in a step at most half the period in y"
    )]
    BadTilt {
        /// Displacement along x of the image one period up in y.
        tilt: f64,
        /// Its growth in the step.
        tilt_step: f64,
    },
    /// A particle that would meet its own images.
    #[error(
        "particle {} of radius {radius} is too large for the period {period} along {}: \
         its diameter must not exceed half a period",
        .particle + 1,
        axis(*.direction)
    )]
    ParticleTooLarge {
        /// Index of the particle, from 0; messages count from 1.
        particle: usize,
        /// Its radius.
        radius: f64,
        /// Direction, from 0.
        direction: usize,
        /// Its period.
        period: f64,
    },
    /// A particle that crosses half a period in a step, so that contacts could not be told from those of its
    /// images.
    #[error(
        "particle {} moves by {displacement} against the others in a step: more than half the period {period}",
        .particle + 1
    )]
    TooFast {
        /// Index of the particle, from 0; messages count from 1.
        particle: usize,
        /// Displacement less the mean motion.
        displacement: f64,
        /// The period.
        period: f64,
    },
    /// Another rank of those that share the contacts failed.
    #[error("{message} (on another rank)")]
    Elsewhere {
        /// What it says.
        message: String,
    },
    /// Contacts that no velocities can satisfy, such as a particle between walls that are too near.
    #[error("no velocities keep these contacts from overlapping: {}", Names(pairs))]
    Infeasible {
        /// The contacts, sorted.
        pairs: Vec<PairKey>,
    },
    /// Two particles that only move as they are told, and are told to overlap.
    #[error("the motions that {pair} are given make them overlap: gap {gap:e}")]
    Given {
        /// The particles.
        pair: PairKey,
        /// Their gap at the end of the step; unit: length.
        gap: f64,
    },
    /// The projection did not converge in so many iterations.
    #[error(
        "the contact projection stands at a residual of {residual:e} (tolerance {tolerance:e}) after {iterations} \
         iterations; worst contact: {worst}"
    )]
    NotConverged {
        /// `max |min(gap, ||A|| (lambda - floor))|`; unit: length.
        residual: f64,
        /// The residual that was to be reached; unit: length.
        tolerance: f64,
        /// Iterations of the last solve.
        iterations: usize,
        /// Residuals on the way.
        history: ResidualHistory,
        /// The pair with the largest residual.
        worst: PairKey,
    },
    /// The forces of contacts and the flow in which they act do not come to an agreement.
    #[error(
        "the contact forces still change by {} of themselves after {} flows of a step (tolerance {tolerance}); the \
         changes were {changes:?}",
        changes.last().copied().unwrap_or(0.0), changes.len()
    )]
    FlowNotConverged {
        /// Changes by each flow, over the forces.
        changes: Vec<f64>,
        /// The change that was to be reached.
        tolerance: f64,
    },
    /// Re-linearisation did not close a gap.
    #[error("the gap {gap:e} of {pair} is still off after {passes} linearisations")]
    GapNotClosed {
        /// The pair that is farthest off.
        pair: PairKey,
        /// Its gap at the end of the step; unit: length.
        gap: f64,
        /// Linearisations made.
        passes: usize,
    },
}

impl ContactError {
    /// Whether contacts were looked for as they should be, and no forces were found: those of the same step
    /// will not be found again.
    pub fn is_unsolved(&self) -> bool {
        matches!(self, Self::NotConverged { .. } | Self::FlowNotConverged { .. } | Self::GapNotClosed { .. })
    }

    /// Refuses a pair of particles or walls that are not there.
    pub(crate) fn unless_known(pair: PairKey, count: usize, wall_count: usize) -> Result<(), Self> {
        let (first, second) = pair.particles();
        if first.max(second.unwrap_or(0)) >= count {
            return Err(Self::UnknownParticle { pair, count });
        }
        match pair.second {
            Partner::Wall(wall) if wall as usize >= wall_count => {
                Err(Self::UnknownWall { pair, count: wall_count })
            }
            _ => Ok(()),
        }
    }

    /// The error that the failure of a projection means; `contact_key` and `row_key` name its contacts and
    /// its rows.
    pub(crate) fn of_projection(
        failure: &Failure,
        tolerance: f64,
        contact_key: impl Fn(usize) -> PairKey,
        row_key: impl Fn(usize) -> PairKey,
    ) -> Self {
        match failure {
            Failure::Gap { contact, gap, passes } => {
                Self::GapNotClosed { pair: contact_key(*contact), gap: *gap, passes: *passes }
            }
            Failure::Solve(failure) => Self::of_solve(failure, tolerance, row_key),
        }
    }

    /// The error that the failure of a solver means; `key` names its rows.
    pub(crate) fn of_solve(failure: &SolveFailure, tolerance: f64, key: impl Fn(usize) -> PairKey) -> Self {
        match &failure.infeasible {
            Some(rows) => {
                let mut pairs: Vec<_> = rows.iter().map(|&row| key(row)).collect();
                pairs.sort_unstable();
                pairs.dedup();
                Self::Infeasible { pairs }
            }
            None => Self::NotConverged {
                residual: failure.report.residual,
                tolerance,
                iterations: failure.report.iterations,
                history: failure.history.clone(),
                worst: key(failure.worst),
            },
        }
    }
}

/// Name of a direction.
fn axis(direction: usize) -> char {
    ['x', 'y', 'z'].get(direction).copied().unwrap_or('?')
}

/// The first few contacts of a list.
struct Names<'a>(&'a [PairKey]);

impl std::fmt::Display for Names<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const SHOWN: usize = 6;
        for (k, pair) in self.0.iter().take(SHOWN).enumerate() {
            write!(f, "{}{pair}", if k == 0 { "" } else { "; " })?;
        }
        match self.0.len().checked_sub(SHOWN) {
            Some(more) if more > 0 => write!(f, "; and {more} more"),
            _ => Ok(()),
        }
    }
}
