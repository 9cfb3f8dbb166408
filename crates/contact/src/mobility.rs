//! The mobility, by which contact forces change velocities: `u - u* = M^-1 f`.

use std::f64::consts::PI;

use gluey_geom::{Twist, Vector, Wrench};

use crate::PairKey;

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

/// Motions that forces and torques give to particles, symmetric and positive semidefinite: particles that are
/// held have none. Forces are in units of viscosity times length times velocity, per length in 2D.
pub trait TwistMobility<const D: usize> {
    /// Writes the motions that these loads give to the particles.
    fn respond(&mut self, loads: &[Wrench<D>], twists: &mut [Twist<D>]);

    /// Velocity of the partner's surface beyond the particle's, along the line of centres and across it, for
    /// a unit force between the two in the middle of their gap, as if nobody else were there.
    fn of_pair(&self, pair: PairKey) -> [f64; 2];
}

/// Particles each of which feels the drag that it has alone: `6 pi eta a` and `8 pi eta a^3` for spheres,
/// `4 pi eta` and `4 pi eta a^2` for discs, whose drag depends on the logarithm of how far the fluid reaches.
#[derive(Clone, Debug)]
pub struct LoneDrag<'a> {
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// Radii.
    pub radii: &'a [f64],
    /// Whether a particle moves as it is told; no entries where none does.
    pub is_held: &'a [bool],
}

impl LoneDrag<'_> {
    /// Force per velocity, and torque per spin times the square of the radius, of a particle of this radius.
    pub fn of<const D: usize>(viscosity: f64, radius: f64) -> [f64; 2] {
        match D {
            2 => [4.0 * PI * viscosity; 2],
            _ => [6.0 * PI * viscosity * radius, 8.0 * PI * viscosity * radius],
        }
    }

    /// Velocities per force, and per torque over the square of the radius.
    fn mobilities<const D: usize>(&self, particle: usize) -> [f64; 2] {
        match self.is_held.get(particle) {
            Some(true) => [0.0; 2],
            _ => Self::of::<D>(self.viscosity, self.radii[particle]).map(f64::recip),
        }
    }
}

impl<const D: usize> TwistMobility<D> for LoneDrag<'_> {
    fn respond(&mut self, loads: &[Wrench<D>], twists: &mut [Twist<D>]) {
        for (particle, (twist, load)) in twists.iter_mut().zip(loads).enumerate() {
            let [moving, turning] = self.mobilities::<D>(particle);
            let spin = load.torque * (turning / self.radii[particle].powi(2));
            *twist = Twist { velocity: load.force * moving, spin };
        }
    }

    fn of_pair(&self, pair: PairKey) -> [f64; 2] {
        let (first, second) = pair.particles();
        let of_sides = [Some(first), second].into_iter().flatten().map(|k| self.mobilities::<D>(k));
        // The arm is about a radius.
        of_sides
            .fold([0.0; 2], |[along, across], [moving, turning]| [along + moving, across + moving + turning])
    }
}
