//! How long the parts of a step may be for the error of the time scheme to stay below a tolerance.

use gluey_geom::{Particle, Twist};
use gluey_motion::{ErrorEstimate, Scheme};

use super::part::Part;
use crate::tally::StepMotion;

/// A part is so many times as long as the one before it at most, where there is a tolerance.
const MOST_GROWTH: f64 = 2.0;

/// Errors of the time scheme, and what they may be.
#[derive(Clone, Debug)]
pub(super) struct Accuracy<const D: usize> {
    pub estimate: ErrorEstimate<D>,
    /// Largest error of a part of a step, in radii; none: steps are done in as few parts as can be.
    pub tolerance: Option<f64>,
}

impl<const D: usize> Accuracy<D> {
    /// Nothing known, no tolerance.
    pub fn new(scheme: Scheme) -> Self {
        Self { estimate: ErrorEstimate::new(scheme), tolerance: None }
    }

    /// `longest` of a step of length `dt`, or less, as the part before it allows.
    pub fn begin(&self, longest: Part, dt: f64, most_halvings: u32) -> Part {
        let before = self.estimate.last_length();
        let mut part = longest;
        if self.tolerance.is_some() && before > 0.0 {
            while dt * part.share() > MOST_GROWTH * (1.0 + 1e-9) * before
                && let Some(half) = part.halved(most_halvings)
            {
                part = half;
            }
        }
        part
    }

    /// The first half of `part` of a step of length `dt`, if the whole part is too long for these velocities.
    pub fn half_of(
        &self,
        part: Part,
        most_halvings: u32,
        dt: f64,
        twists: &[Twist<D>],
        particles: &[Particle<D>],
    ) -> Option<Part> {
        let is_too_long = |tolerance| self.estimate.of_next(twists, particles, dt * part.share()) > tolerance;
        self.tolerance.filter(|tolerance| is_too_long(*tolerance))?;
        part.halved(most_halvings)
    }

    /// Notes the error of the part before, which led `particles` to where they have the velocities `twists`,
    /// and that these are those of a part of this length.
    pub fn note(
        &mut self,
        twists: &[Twist<D>],
        particles: &[Particle<D>],
        length: f64,
        motion: &mut StepMotion,
    ) {
        let error = self.estimate.of_last(twists, particles);
        motion.error = motion.error.max(error);
        motion.is_inaccurate |= self.tolerance.is_some_and(|tolerance| error > tolerance);
        self.estimate.advance(length, twists);
    }
}
