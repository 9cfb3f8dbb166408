//! Repulsion in a simulation: forces on the particles where they are, and their stress.

use gluey_contact::Domain;
use gluey_geom::{Matrix, Particle, Wrench};
use gluey_suspension::{Repelled, Repulsion};

/// Particles that repel each other, and the walls.
#[derive(Debug)]
pub(super) struct Repelling<const D: usize> {
    law: Repulsion,
    surroundings: Domain<D>,
}

impl<const D: usize> Repelling<D> {
    /// Particles that repel each other by this law, and the walls of their surroundings.
    pub fn new(law: Repulsion, surroundings: Domain<D>) -> Self {
        Self { law, surroundings }
    }

    /// The forces between particles where they are now, with a lattice of this tilt; and their stress, minus
    /// the mean product of forces and lines between centres.
    pub fn between(&mut self, particles: &[Particle<D>], tilt: f64) -> (Vec<Wrench<D>>, Matrix<D>) {
        self.surroundings.set_sliding(tilt, 0.0);
        let Repelled { forces, moment } = self.law.between(particles, &self.surroundings);
        let volume: f64 = self.surroundings.lattice.periods().iter().flatten().product();
        let wrenches = forces.into_iter().map(|force| Wrench { force, ..Wrench::default() }).collect();
        (wrenches, -moment / volume)
    }
}
