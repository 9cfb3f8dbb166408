//! What can go wrong in a contact step.

use crate::PairKey;
use crate::solver::ResidualHistory;

/// Why velocities could not be corrected. They are left as they were.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    #[error("rate {rate} and dt {dt} must be positive and finite")]
    BadStep {
        /// Factor of the velocity in the displacement.
        rate: f64,
        /// Length of the step.
        dt: f64,
    },
    /// A radius that is zero, negative or not finite.
    #[error("particle {particle} has the radius {radius}: it must be positive and finite")]
    BadRadius {
        /// Index of the particle.
        particle: usize,
        /// Its radius.
        radius: f64,
    },
    /// A position, velocity or drift that is infinite or not a number.
    #[error("particle {particle}: its {quantity} is not finite")]
    NotFinite {
        /// Index of the particle.
        particle: usize,
        /// Which of its vectors.
        quantity: Quantity,
    },
    /// Two centres so close that the line through them has no direction.
    #[error("the centres of particles {} and {} coincide", pair.first, pair.second)]
    Coincident {
        /// The particles.
        pair: PairKey,
    },
    /// A remembered contact of a particle that is not there.
    #[error("a remembered contact joins particles {} and {}, but there are only {count} particles", pair.first, pair.second)]
    UnknownParticle {
        /// The contact.
        pair: PairKey,
        /// Number of particles.
        count: usize,
    },
    /// The projection did not converge: too few iterations, or contacts that contradict each other.
    #[error(
        "the contact projection stands at a residual of {residual:e} (tolerance {tolerance:e}) after {iterations} \
         iterations; worst contact: particles {} and {}", worst.first, worst.second
    )]
    NotConverged {
        /// `max |min(gap, ||A|| (lambda - floor))|`; unit: length.
        residual: f64,
        /// What was asked for; unit: length.
        tolerance: f64,
        /// Iterations of the last solve.
        iterations: usize,
        /// Residuals on the way.
        history: ResidualHistory,
        /// The pair with the largest residual.
        worst: PairKey,
    },
    /// Re-linearisation did not close a gap.
    #[error("the gap {gap:e} of particles {} and {} is still off after {passes} linearisations", pair.first, pair.second)]
    GapNotClosed {
        /// The pair that is farthest off.
        pair: PairKey,
        /// Its gap at the end of the step; unit: length.
        gap: f64,
        /// Linearisations made.
        passes: usize,
    },
}

/// A vector of a particle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Centre.
    Position,
    /// Predicted velocity.
    Velocity,
    /// Displacement known before the velocity.
    Drift,
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Drift => "drift",
        })
    }
}
