//! The mobility, by which contact forces change velocities: `u - u* = M^-1 f`.

use gluey_geom::Vector;

/// A symmetric positive semidefinite mobility `M^-1`, the metric of the projection.
///
/// Forces are in units of `6 pi eta` (length^2/time), so that a lone sphere has `M = a`. Fixed bodies have
/// the mobility 0.
pub trait Mobility<const D: usize>: Sync {
    /// Whether a force on one particle moves others: then [`Mobility::apply`] must be written, and contacts
    /// are solved for all at once.
    const COUPLED: bool = false;

    /// Velocity that a unit force on a particle gives to itself; unit: 1/length.
    fn own(&self, particle: usize, radius: f64) -> f64;

    /// Writes into `velocities` the velocity that `forces` give to each particle.
    fn apply(&self, radii: &[f64], forces: &[Vector<D>], velocities: &mut [Vector<D>]) {
        for (particle, (velocity, force)) in velocities.iter_mut().zip(forces).enumerate() {
            *velocity = force * self.own(particle, radii[particle]);
        }
    }
}

/// `M = diag(a_i)`: every particle feels its own Stokes drag only (Verdon et al. 2010, eq. 29).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StokesDrag;

impl<const D: usize> Mobility<D> for StokesDrag {
    fn own(&self, _particle: usize, radius: f64) -> f64 {
        1.0 / radius
    }
}

/// Some particles move only as they are told, the others feel their own Stokes drag: contact does not change
/// the velocities of fixed particles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WithFixed {
    fixed: Vec<bool>,
}

impl WithFixed {
    /// Stokes drag with the particles of these indices fixed.
    pub fn new(particles: impl IntoIterator<Item = usize>) -> Self {
        let mut fixed = Vec::new();
        for particle in particles {
            fixed.resize(fixed.len().max(particle + 1), false);
            fixed[particle] = true;
        }
        Self { fixed }
    }
}

impl<const D: usize> Mobility<D> for WithFixed {
    fn own(&self, particle: usize, radius: f64) -> f64 {
        if self.fixed.get(particle).copied().unwrap_or(false) { 0.0 } else { 1.0 / radius }
    }
}
