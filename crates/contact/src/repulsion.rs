//! Repulsion of round particles that decays with the gap of their surfaces, as that of electric double layers
//! does: `F(g) = F0 s exp(-g / d)` along the line of centres.
//!
//! Surfaces of radii `a`, `b` repel each other in proportion to `s = (2 a b / ((a + b) a_0))^((D-1)/2)`
//! (Derjaguin 1934, DOI 10.1007/BF01433225: spheres, and the same sum over strips of parallel cylinders);
//! for spheres this is the law of Mari, Seto, Morris and Denn (2014, DOI 10.1122/1.4890747). A wall is a
//! surface of infinite radius.

/// Forces below this part of the one at contact are left out.
const LEAST: f64 = 1e-6;

/// The law: a force between surfaces at a distance.
///
/// ```
/// use gluey_contact::Repulsion;
/// let repulsion = Repulsion { force: 2.0, range: 0.1, radius: 1.0 };
/// assert_eq!(repulsion.at::<3>(0.0, [1.0, 1.0]), 2.0);
/// assert!((repulsion.at::<3>(0.1, [1.0, 1.0]) - 2.0 / std::f64::consts::E).abs() < 1e-15);
/// // A wall repels twice as much.
/// assert_eq!(repulsion.at::<3>(0.0, [1.0, f64::INFINITY]), 4.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repulsion {
    /// Force `F0` between two particles of the radius `radius` in contact.
    pub force: f64,
    /// Gap `d` in which the force falls to a share of 1/e; a length.
    pub range: f64,
    /// The radius `a_0` that `force` is for.
    pub radius: f64,
}

impl Repulsion {
    /// The force between surfaces of two radii at a gap. Those that overlap repel each other as in contact.
    pub fn at<const D: usize>(&self, gap: f64, [a, b]: [f64; 2]) -> f64 {
        // The harmonic mean of the radii; that of a radius and an infinite one is twice the first.
        let mean = 2.0 / (1.0 / a + 1.0 / b);
        let size = (mean / self.radius).powf(0.5 * (D as f64 - 1.0));
        self.force * size * (-gap.max(0.0) / self.range).exp()
    }

    /// The gap from which on nothing is left of the force but a millionth, which is left out.
    pub fn reach(&self) -> f64 {
        -self.range * LEAST.ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_count_as_derjaguin_has_it() {
        let law = Repulsion { force: 3.0, range: 0.02, radius: 0.1 };
        let at = |radii| law.at::<3>(0.02, radii) * std::f64::consts::E / law.force;
        assert!((at([0.1, 0.1]) - 1.0).abs() < 1e-15);
        assert!((at([0.1, 0.3]) - 1.5).abs() < 1e-15);
        assert!((law.at::<2>(0.0, [0.1, 0.3]) / law.force - 1.5f64.sqrt()).abs() < 1e-15);
        assert!((law.at::<2>(0.0, [0.1, f64::INFINITY]) / law.force - 2f64.sqrt()).abs() < 1e-15);
        assert_eq!(law.at::<2>(-0.05, [0.1, 0.1]), law.force);
    }
}
