//! Repulsion in a simulation: forces on the particles where they are, and their stress.

use gluey_contact::Domain;
use gluey_geom::{Dim, Matrix, Particle, Space, Wrench};
use gluey_suspension::{Repelled, Repulsion};

/// Particles that repel each other, and the walls.
#[derive(Debug)]
pub(super) struct Repelling<const D: usize>
where
    Dim<D>: Space<D>,
{
    law: Repulsion,
    surroundings: Domain<D>,
    /// Minus the mean product of forces and lines between centres at the last prediction.
    pub stress: Matrix<D>,
    /// The forces.
    pub wrenches: Vec<Wrench<D>>,
}

impl<const D: usize> Repelling<D>
where
    Dim<D>: Space<D>,
{
    /// No forces yet.
    pub fn new(law: Repulsion, surroundings: Domain<D>) -> Self {
        Self { law, surroundings, stress: Matrix::zeros(), wrenches: Vec::new() }
    }

    /// Takes the forces between particles where they are now, with a lattice of this tilt.
    pub fn update(&mut self, particles: &[Particle<D>], tilt: f64) {
        self.surroundings.set_sliding(tilt, 0.0);
        let Repelled { forces, moment } = self.law.between(particles, &self.surroundings);
        let volume: f64 = self.surroundings.lattice.periods().iter().flatten().product();
        self.stress = -moment / volume;
        self.wrenches.clear();
        self.wrenches.extend(forces.into_iter().map(|force| Wrench { force, ..Wrench::default() }));
    }
}
