//! How rigidity is imposed.
//!
//! `rigid-dofs`: every velocity node with `alpha >= offset h` gets the rigid motion of its body; viscosity is constant,
//! force and torque on a free body vanish because they are the residual of its own unknowns.
//!
//! `paper` (Verdon et al. 2010): viscosity `eta = I eta_s + (1-I) eta_f` (eq. 5) and the augmented Lagrangian of
//! eqs. 9 and 10: `K(eta) u^k - B^T p^k = -1/2 K(I eta_s) lambda^(k-1)`, `B u^k = 0`, `lambda^k = lambda^(k-1) + rho u^k`,
//! where `K(eta)` is the matrix of `int 2 eta eps(u):eps(v)`. The bilinear form carries `2 eta_s` and the update steps with
//! `eta_s`, so it converges for `0 < rho < 4`. Each prediction starts cold (`lambda = 0`) and makes a fixed number of steps:
//! the softness this leaves is part of the formulation. One step alone never uses the multiplier: a penalty method.

use crate::error::StokesError;
use crate::pressure::WeakPressures;

/// How rigidity is imposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Formulation {
    /// Elimination of the solid degrees of freedom.
    RigidDofs {
        /// Nodes with `alpha >= offset h` are rigid; slightly negative is best, see `docs/theory`.
        offset: f64,
        /// Treatment of the pressures in cut cells.
        weak_pressures: WeakPressures,
    },
    /// Penalty and Uzawa multiplier of the paper.
    Paper(PaperParams),
}

/// Parameters of the `paper` formulation.
///
/// The default, r = 100 with two Uzawa steps and a ramp of one cell, is one setting for every mesh and dimension. The paper has
/// r = 1e3 and says neither the number of steps nor the ramp; with that ratio cells cut by two particles lock the pair on meshes
/// of three to six cells per radius (`docs/decisions/0019-one-setting-of-paper.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperParams {
    /// `r = eta_s / eta_f`.
    pub viscosity_ratio: f64,
    /// Thickness `e` of the ramp in cells.
    pub ramp: f64,
    /// Step `rho` of the multiplier update, `0 < rho < 4`.
    pub rho: f64,
    /// Number of solves per prediction, each followed by an update of the multiplier. With one the multiplier, which starts
    /// from zero, is never used: the formulation is then a penalty method.
    pub uzawa_steps: usize,
    /// Gauss points a direction in cells near a surface.
    pub quadrature: usize,
    /// How the motion of a particle is taken from the field.
    pub particle_velocity: ParticleVelocity,
}

/// How the motion of a particle is taken from a field that is only nearly rigid inside it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ParticleVelocity {
    /// The rigid motion closest to the field over the particle, weighted with the solid fraction.
    #[default]
    WeightedMean,
    /// The velocity at the centre, `u(X_i)` (eq. 11), and half the vorticity there.
    Center,
}

impl Default for PaperParams {
    fn default() -> Self {
        Self {
            viscosity_ratio: 1e2,
            ramp: 1.0,
            rho: 1.0,
            uzawa_steps: 2,
            quadrature: 4,
            particle_velocity: ParticleVelocity::WeightedMean,
        }
    }
}

/// Offset of the rigid nodes in cells that suits a dimension. In 3D, where films are not resolved, a larger one makes up for the
/// resistance of the film.
pub fn default_offset(dimension: usize) -> f64 {
    if dimension == 2 { -0.1 } else { -0.2 }
}

impl Formulation {
    /// Gauss points a direction with which the solid is integrated.
    pub fn quadrature(&self) -> usize {
        match self {
            Self::Paper(paper) => paper.quadrature,
            Self::RigidDofs { .. } => 1,
        }
    }

    /// # Errors
    /// [`StokesError::Parameter`] for a value out of range.
    pub fn check(&self) -> Result<(), StokesError> {
        let wrong = |name, value, wanted| Err(StokesError::Parameter { name, value, wanted });
        match *self {
            Self::RigidDofs { offset, .. } if !(-1.0..=1.0).contains(&offset) => {
                wrong("offset", offset, "must lie between -1 and 1 cells")
            }
            Self::Paper(p) if !(p.viscosity_ratio > 1.0 && p.viscosity_ratio.is_finite()) => {
                wrong("viscosity_ratio", p.viscosity_ratio, "must be larger than 1 and finite")
            }
            Self::Paper(p) if !(p.rho > 0.0 && p.rho < 4.0) => {
                wrong("rho", p.rho, "must lie between 0 and 4")
            }
            Self::Paper(p) if !(p.ramp > 0.0 && p.ramp.is_finite()) => {
                wrong("ramp", p.ramp, "must be positive")
            }
            Self::Paper(p) if p.quadrature == 0 => wrong("quadrature", 0.0, "must be at least 1"),
            Self::Paper(p) if p.uzawa_steps == 0 => wrong("uzawa_steps", 0.0, "must be at least 1"),
            _ => Ok(()),
        }
    }
}
