//! Mixing laws (Verdon et al. 2010, eqs. 4 and 5).

/// The smoothed characteristic function `I(alpha) = clamp(alpha / e, 0, 1)` (eq. 4): the ramp of thickness
/// `e` lies inside the solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    thickness: f64,
}

impl Ramp {
    /// A ramp of thickness `e > 0`.
    pub fn new(thickness: f64) -> Self {
        Self { thickness }
    }

    /// Solid fraction at a point with level set `alpha`.
    pub fn fraction(&self, alpha: f64) -> f64 {
        (alpha / self.thickness).clamp(0.0, 1.0)
    }
}

/// `eta = I eta_s + (1 - I) eta_f` with `eta_s = r eta_f` (eq. 5, where the letter E stands for the number
/// 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViscosityLaw {
    /// Viscosity of the fluid, `eta_f`.
    pub fluid: f64,
    /// Ratio `r = eta_s / eta_f`.
    pub ratio: f64,
}

impl ViscosityLaw {
    /// Viscosity at a point with solid fraction `fraction`.
    pub fn mix(&self, fraction: f64) -> f64 {
        self.fluid * (fraction * self.ratio + (1.0 - fraction))
    }

    /// Viscosity of the solid, `eta_s`; `I eta_s` is the weight of the multiplier in the Uzawa method
    /// (eq. 9).
    pub fn solid(&self) -> f64 {
        self.fluid * self.ratio
    }

    /// The factor `1 - 1/r` with which the solid adds to the fluid: `eta = eta_f + (1 - 1/r) I eta_s`.
    pub fn excess(&self) -> f64 {
        1.0 - 1.0 / self.ratio
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_lies_inside_the_solid() {
        let ramp = Ramp::new(0.1);
        assert_eq!([-0.2, 0.0, 0.05, 0.1, 0.3].map(|a| ramp.fraction(a)), [0.0, 0.0, 0.5, 1.0, 1.0]);
        let law = ViscosityLaw { fluid: 2.0, ratio: 1e3 };
        assert_eq!([0.0, 1.0].map(|i| law.mix(i)), [2.0, 2000.0]);
        assert_eq!(law.mix(0.3), 0.3 * law.solid() + 2.0 * 0.7);
        assert!((law.mix(0.3) - (2.0 + law.excess() * 0.3 * law.solid())).abs() < 1e-12 * law.mix(0.3));
    }
}
