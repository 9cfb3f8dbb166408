//! Steps in which no gap closes.
//!
//! Where lubrication resists, the gap `g` of two particles follows `R(g) dg/dt = F` with a force `F` that
//! varies slowly and a resistance `R` that grows without bound as `g -> 0`: like `1/g` between spheres, like
//! `g^(-3/2)` between discs. An explicit scheme for `g` itself is inaccurate once the gap halves in a few
//! steps, and may step over zero. The *impulse*
//!
//! `Phi(g) = int R dg`, `d Phi/dt = F`,
//!
//! is taken by the same scheme instead, at the same order: `Phi(g^{n+1}) = Phi(g^n) + c F^n + (dt - c)
//! F^{n-1}`, and the particles are moved along the line of centres to the gap that this gives. Since `Phi ->
//! -inf` as `g -> 0`, gaps stay positive for any step. In this scheme `Phi` is the memory `gamma` of the
//! gluey contact model (Lefebvre 2009, 10.1051/m2an/2008042), of which it is the version at finite gaps: as
//! the viscosity tends to zero a gap is closed as long as `Phi < 0`.
//!
//! Only the shape of `R` matters, not its scale: `R = 1 + s (rho(g) - rho(G))` for `g < G` and one beyond,
//! with `rho = A/g` for spheres, `(A/g)^(3/2)` for discs, where `2/A = 1/a + 1/b` for radii `a` and `b`.

use gluey_geom::{Dim, Particle, Space, Twist, Vector};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// Two particles, or one and a wall, with a film between them that lubrication keeps open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film<const D: usize> {
    /// Index of the particle.
    pub first: usize,
    /// Index of its partner; `None` for a wall.
    pub second: Option<usize>,
    /// From the centre of the first to that of its partner (the image that is meant), or to the wall.
    pub branch: Vector<D>,
    /// Distance of the surfaces; unit: length.
    pub gap: f64,
    /// `A`, with `2/A = 1/a + 1/b`; unit: length.
    pub curvature_radius: f64,
}
