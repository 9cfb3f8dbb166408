//! A step of a scheme: where it takes particles, and the films between them.

use gluey_geom::{Dim, Particle, Space, Twist, Vector};

use super::film::{Film, memory_reach};

/// The step of a scheme: displacements are `weight u^n + history_weight u^{n-1}`.
pub struct Step<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Weight of `u^n`.
    pub weight: f64,
    /// Weight of `u^{n-1}`.
    pub history_weight: f64,
    /// The particles.
    pub particles: &'a [Particle<D>],
    /// `u^{n-1}`; empty at the first step.
    pub history: &'a [Twist<D>],
}

impl<const D: usize> Step<'_, D>
where
    Dim<D>: Space<D>,
{
    /// The gap up to which films have to be known before a step with these velocities.
    pub fn reach(&self, twists: &[Twist<D>]) -> f64 {
        let farthest = (0..twists.len()).map(|k| self.shift(k, twists).norm()).fold(0.0, f64::max);
        // Two particles approach each other at twice the speed of each.
        self.memory_reach() + 2.0 * farthest
    }

    /// The same where images slide in a simple shear of this rate.
    pub fn reach_in_shear(&self, twists: &[Twist<D>], rate: f64) -> f64 {
        let strain = rate * (self.weight + self.history_weight);
        let rest = |k: usize| {
            let mut shift = self.shift(k, twists);
            shift[0] -= strain * self.particles[k].pose.position[1];
            shift
        };
        let count = twists.len();
        let mean = (0..count).map(rest).sum::<Vector<D>>() / count.max(1) as f64;
        let farthest = (0..count).map(|k| (rest(k) - mean).norm()).fold(0.0, f64::max);
        // Centres at the distance `2 a + reach` approach each other by the strain times that, besides.
        let (strain, diameter) = (strain.abs(), 2.0 * self.largest_radius());
        (self.memory_reach() + 2.0 * farthest + strain * diameter) / (1.0 - strain.min(0.5))
    }

    fn memory_reach(&self) -> f64 {
        memory_reach(self.largest_radius())
    }

    fn largest_radius(&self) -> f64 {
        self.particles.iter().map(|particle| particle.radius).fold(0.0, f64::max)
    }

    /// Displacement of a particle.
    fn shift(&self, k: usize, twists: &[Twist<D>]) -> Vector<D> {
        let old = self.history.get(k).map_or(Vector::zeros(), |twist| twist.velocity);
        twists[k].velocity * self.weight + old * self.history_weight
    }

    /// The particle that one choice of velocities takes farthest from where another does, and how far, in its
    /// radii.
    pub fn largest_push(&self, free: &[Twist<D>], twists: &[Twist<D>]) -> (usize, f64) {
        let push = |k: usize| {
            let moved = (twists[k].velocity - free[k].velocity) * self.weight;
            (k, moved.norm() / self.particles[k].radius)
        };
        (0..twists.len()).map(push).fold((0, 0.0), |most, next| if next.1 > most.1 { next } else { most })
    }

    /// From the centre of the first particle of a film to its partner, or to the wall, after the step.
    pub fn branch_after(&self, film: &Film<D>, twists: &[Twist<D>]) -> Vector<D> {
        let dt = self.weight + self.history_weight;
        film.branch + film.across(|k| self.shift(k, twists), dt)
    }

    /// Gap of a film after the step.
    pub fn gap_after(&self, film: &Film<D>, twists: &[Twist<D>]) -> f64 {
        let (moved, distance) = (self.branch_after(film, twists), film.branch.norm());
        let left = if film.is_flat() { moved.dot(&film.branch) / distance } else { moved.norm() };
        left - distance + film.gap
    }
}
