//! What contact forces do to velocities: `u - u* = M^-1 f`.

use gluey_geom::Vector;

/// A symmetric positive definite mobility `M^-1`, the metric of the projection.
///
/// Forces are in units of `6 pi eta` (length^2/time), so that a lone sphere has `M = a`.
pub trait Mobility<const D: usize> {
    /// Writes into `velocities` the velocity that `forces` give to each particle.
    fn apply(&self, radii: &[f64], forces: &[Vector<D>], velocities: &mut [Vector<D>]);
}

/// `M = diag(a_i)`: every particle feels its own Stokes drag only (Verdon et al. 2010, eq. 29).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StokesDrag;

impl<const D: usize> Mobility<D> for StokesDrag {
    fn apply(&self, radii: &[f64], forces: &[Vector<D>], velocities: &mut [Vector<D>]) {
        for ((velocity, force), radius) in velocities.iter_mut().zip(forces).zip(radii) {
            *velocity = force / *radius;
        }
    }
}
