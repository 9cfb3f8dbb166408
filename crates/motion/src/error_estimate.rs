//! The error that a time scheme makes in a step, from how velocities bend.
//!
//! Explicit Euler takes velocities for constant over a step, Adams-Bashforth 2 for a line in time through the
//! last two. How far the next ones are from that tells the derivative that is left out (Milne's device:
//! Hairer, Norsett and Wanner 1993, Solving Ordinary Differential Equations I, section III.1).

use gluey_geom::{Particle, Twist, Vector};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::integrator::Scheme;

/// Estimates errors of steps in the positions of particles, over their radii, in root mean square over the
/// particles. What is estimated is the error of one step, not what many add up to.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct ErrorEstimate<const D: usize> {
    scheme: Scheme,
    /// Velocities of the last step; empty before the first.
    last: Vec<Vector<D>>,
    /// Length of the last step, and of the one before; 0 where there was none.
    lengths: [f64; 2],
    /// What the scheme took velocities to become by the end of the last step; empty before the first.
    expected: Vec<Vector<D>>,
}

impl<const D: usize> ErrorEstimate<D> {
    /// An estimate before the first step.
    pub fn new(scheme: Scheme) -> Self {
        Self { scheme, last: Vec::new(), lengths: [0.0; 2], expected: Vec::new() }
    }

    /// Length of the last step; 0 before the first and after a restart.
    pub fn last_length(&self) -> f64 {
        self.lengths[0]
    }

    /// The error that the last step made, from the velocities `twists` where it led `particles`; 0 before the
    /// first.
    pub fn of_last(&self, twists: &[Twist<D>], particles: &[Particle<D>]) -> f64 {
        let [length, before] = self.lengths;
        let surprise = self.surprise(twists, particles);
        match self.scheme {
            Scheme::AdamsBashforth2 if before > 0.0 => {
                surprise * length * (2.0 * length + 3.0 * before) / (6.0 * (length + before))
            }
            _ => 0.5 * length * surprise,
        }
    }

    /// The error that a step of this length would make with the velocities `twists` of `particles`. Before
    /// the first step nothing is known of how velocities change: they are taken to do so by as much as they
    /// are in the time in which a particle moves by its radius.
    pub fn of_next(&self, twists: &[Twist<D>], particles: &[Particle<D>], length: f64) -> f64 {
        let [last, before] = self.lengths;
        if last == 0.0 {
            let radii_in_time = mean_over_radius(twists.iter().map(|twist| twist.velocity), particles);
            return 0.5 * (length * radii_in_time).powi(2);
        }
        let surprise = self.surprise(twists, particles);
        match self.scheme {
            Scheme::Euler => 0.5 * surprise / last * length.powi(2),
            Scheme::AdamsBashforth2 => {
                let bend = 2.0 * surprise / (last * (last + before));
                bend * length.powi(2) * (length / 6.0 + last / 4.0)
            }
        }
    }

    /// Remembers a step of this length with the velocities `twists`.
    pub fn advance(&mut self, length: f64, twists: &[Twist<D>]) {
        let slope = match self.scheme {
            Scheme::Euler => 0.0,
            Scheme::AdamsBashforth2 => length / self.lengths[0],
        };
        let now: Vec<_> = twists.iter().map(|twist| twist.velocity).collect();
        self.expected.clone_from(&now);
        for (expected, before) in self.expected.iter_mut().zip(&self.last) {
            let change = (*expected - before) * slope;
            *expected += change;
        }
        self.last = now;
        self.lengths = [length, self.lengths[0]];
    }

    /// Forgets the velocities, as where the flow jumps or is reversed.
    pub fn restart(&mut self) {
        *self = Self::new(self.scheme);
    }

    /// How far velocities are from those that were expected.
    fn surprise(&self, twists: &[Twist<D>], particles: &[Particle<D>]) -> f64 {
        let changes = twists.iter().zip(&self.expected).map(|(twist, expected)| twist.velocity - expected);
        mean_over_radius(changes, particles)
    }
}

/// Root of the mean square of vectors over the radii of their particles; 0 without any.
fn mean_over_radius<const D: usize>(
    vectors: impl Iterator<Item = Vector<D>>,
    particles: &[Particle<D>],
) -> f64 {
    let squares =
        vectors.zip(particles).map(|(vector, particle)| vector.norm_squared() / particle.radius.powi(2));
    (squares.sum::<f64>() / particles.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::Integrator;

    /// A particle on the path `x = t^k` and its velocity, of radius 0.5.
    fn on_path(time: f64, power: i32) -> (Particle<2>, Twist<2>) {
        let particle = Particle::new(Vector::<2>::new(time.powi(power), 0.0), 0.5);
        let velocity = f64::from(power) * time.powi(power - 1);
        (particle, Twist { velocity: Vector::<2>::new(velocity, 0.0), ..Twist::default() })
    }

    /// Errors of steps from exact places on a path whose first derivative left out is constant, beside their
    /// estimates before and after them.
    fn estimates_are_errors(scheme: Scheme, power: i32) {
        let (mut estimate, mut integrator) = (ErrorEstimate::new(scheme), Integrator::new(scheme));
        let (mut time, mut errors) = (1.0, Vec::new());
        for length in [0.1, 0.1, 0.05, 0.1, 0.2] {
            let (particle, twist) = on_path(time, power);
            let predicted = estimate.of_next(&[twist], &[particle], length);
            let (before, mut particles) = (estimate.of_last(&[twist], &[particle]), [particle]);
            errors.last_mut().into_iter().for_each(|errors: &mut [f64; 3]| errors[2] = before);
            integrator.advance(length, &mut particles, &[twist]);
            estimate.advance(length, &[twist]);
            time += length;
            let error = (particles[0].pose.position - on_path(time, power).0.pose.position).norm() / 0.5;
            errors.push([error, predicted, 0.0]);
        }
        for [error, predicted, found] in &errors[2..4] {
            assert!((predicted - error).abs() < 1e-12 * error + 1e-14, "{predicted:e} for {error:e}");
            assert!((found - error).abs() < 1e-12 * error + 1e-14, "{found:e} for {error:e}");
        }
    }

    #[test]
    fn errors_of_steps_of_unlike_lengths_are_estimated() {
        estimates_are_errors(Scheme::Euler, 2);
        estimates_are_errors(Scheme::AdamsBashforth2, 3);
    }

    #[test]
    fn a_restart_knows_nothing() {
        let (particle, twist) = on_path(1.0, 3);
        let mut estimate = ErrorEstimate::new(Scheme::AdamsBashforth2);
        estimate.advance(0.1, &[twist]);
        assert_eq!(estimate.last_length(), 0.1);
        estimate.restart();
        assert_eq!((estimate.last_length(), estimate.of_last(&[twist], &[particle])), (0.0, 0.0));
        // Three radii over a half in a unit of time: 0.5 (0.1 * 6)^2.
        assert!((estimate.of_next(&[twist], &[particle], 0.1) - 0.18).abs() < 1e-15);
    }
}
