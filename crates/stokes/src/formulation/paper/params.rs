//! Parameters of the `paper` formulation.

use crate::error::StokesError;

/// Parameters of the `paper` formulation.
///
/// The default, r = 100 with two Uzawa steps and a ramp of one cell, is one setting for every mesh and
/// dimension. The paper has r = 1e3 and says neither the number of steps nor the ramp; with that ratio cells
/// cut by two particles lock the pair on meshes of three to six cells per radius
/// (`docs/design/paper.md`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperParams {
    /// `r = eta_s / eta_f`.
    pub viscosity_ratio: f64,
    /// Thickness `e` of the ramp in cells.
    pub ramp: f64,
    /// Step `rho` of the multiplier update, `0 < rho < 4`.
    pub rho: f64,
    /// Number of solves per prediction, each followed by an update of the multiplier. With one the
    /// multiplier, which starts from zero, is never used: the formulation is then a penalty method.
    pub uzawa_steps: usize,
    /// Gauss points per direction in cells near a surface.
    pub quadrature: usize,
    /// How the motion of a particle is taken from the field.
    pub particle_velocity: ParticleVelocity,
}

/// The way in which the motion of a particle is taken from a field that is only nearly rigid inside it.
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

impl PaperParams {
    /// # Errors
    /// [`StokesError::Parameter`] for a value out of range.
    pub fn check(&self) -> Result<(), StokesError> {
        let wrong = |name, value, wanted| Err(StokesError::Parameter { name, value, wanted });
        let Self { viscosity_ratio, ramp, rho, .. } = *self;
        if !(viscosity_ratio > 1.0 && viscosity_ratio.is_finite()) {
            return wrong("viscosity_ratio", viscosity_ratio, "must be larger than 1 and finite");
        }
        if !(rho > 0.0 && rho < 4.0) {
            return wrong("rho", rho, "must lie between 0 and 4");
        }
        if !(ramp > 0.0 && ramp.is_finite()) {
            return wrong("ramp", ramp, "must be positive");
        }
        if self.quadrature == 0 {
            return wrong("quadrature", 0.0, "must be at least 1");
        }
        if self.uzawa_steps == 0 {
            return wrong("uzawa_steps", 0.0, "must be at least 1");
        }
        Ok(())
    }
}
