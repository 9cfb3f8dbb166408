//! Repulsion of round particles that decays with the gap of their surfaces, as that of electric double layers
//! does: `F(g) = F0 s exp(-g / d)` along the line of centres.
//!
//! Surfaces of radii `a`, `b` repel each other in proportion to `s = (2 a b / ((a + b) a_0))^((D-1)/2)`
//! (Derjaguin 1934, DOI 10.1007/BF01433225: spheres, and the same sum over strips of parallel cylinders);
//! for spheres this is the law of Mari, Seto, Morris and Denn (2014, DOI 10.1122/1.4890747). A wall is a
//! surface of infinite radius.
//!
//! A step takes it by no explicit scheme, so that it may be as stiff as it likes ([`PairRepulsion`]).

use crate::BodyStep;

/// Forces below this part of the one at contact are left out.
const LEAST: f64 = 1e-6;
/// Rounding of a push, over the largest one.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

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

/// Repulsion of a pair in a step.
///
/// The flow has the force `F(g^n)` of the beginning. The force of the step is
///
/// `f^n = alpha F(g^{n+1}) + (1 - alpha) f^{n-1}`, `alpha = 1/(1 + dt^n / dt^{n-1})`,
///
/// which is `F(g^n)` to second order where the scheme has a history, and the force at the end where it has
/// none. Together with `x^{n+1} = x^n + c u^n + drift` this is of second order and stable for any step: for `g'
/// = -k g` and steps of equal lengths `dt`, `(2 + 3 k dt/2) z^2 - (3 + k dt/2) z + 1 = 0`, whose roots are 1
/// and 1/2 at `k dt = 0`, 0 and 1/3 at `k dt -> inf`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairRepulsion<const D: usize> {
    law: Repulsion,
    radii: [f64; 2],
    /// `alpha` over the rate by which forces count.
    share: f64,
    /// `(1 - alpha) f^{n-1} - F(g^n)`.
    known: f64,
    /// `F(g^n)` over the rate by which forces count.
    pub now: f64,
}

impl<const D: usize> PairRepulsion<D> {
    /// That of surfaces of these radii at this gap, after a step with the force `before`, where forces count by
    /// `rate`.
    pub fn new(
        law: Repulsion,
        radii: [f64; 2],
        gap: f64,
        before: f64,
        rate: f64,
        step: &BodyStep<'_, D>,
    ) -> Self {
        // Of the line through two velocities that is integrated over the step.
        let lengths = 2.0 * (step.velocity_weight / step.dt - 1.0);
        let alpha = 1.0 / (1.0 + lengths.max(0.0));
        let now = if gap < law.reach() { law.at::<D>(gap, radii) / rate } else { 0.0 };
        Self { law, radii, share: alpha / rate, known: (1.0 - alpha) * before - now, now }
    }

    /// Gap from which on it is left out.
    pub fn reach(&self) -> f64 {
        self.law.reach()
    }

    /// The force of the step beyond that of its beginning, where it ends with this gap.
    pub fn excess_at(&self, gap: f64) -> f64 {
        self.share * self.law.at::<D>(gap, self.radii) + self.known
    }

    /// The same where the gap at the end is `gap + yielding * excess`.
    pub fn excess(&self, gap: f64, yielding: f64) -> f64 {
        let [mut low, mut high] = [self.known, self.excess_at(0.0)];
        let allowed = ROUNDING * (self.share * self.law.at::<D>(0.0, self.radii)).max(self.known.abs());
        let mut excess = low;
        while high - low > allowed {
            let end = gap + yielding * excess;
            let there = self.excess_at(end);
            let off = excess - there;
            if off > 0.0 {
                high = excess
            } else {
                low = excess
            }
            let steepness = if end > 0.0 { (there - self.known) / self.law.range } else { 0.0 };
            let next = excess - off / (1.0 + yielding * steepness);
            if (next - excess).abs() <= allowed {
                return next;
            }
            excess = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        excess
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gluey_geom::{Pose, Twist, Vector};

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

    /// Whatever the stiffness, force and gap belong together.
    #[test]
    fn forces_are_those_of_the_gap_that_they_leave() {
        let poses = [0.0, 2.1].map(|x| Pose::at(Vector::<3>::new(x, 0.0, 0.0)));
        let drift = [Twist::default(); 2];
        for (force, range) in [(1.0, 0.1), (1e3, 1e-2), (1e6, 1e-3), (1e9, 1e-3)] {
            for (gap, weight) in [(0.2, 1.5), (0.01, 1.0), (-0.3, 1.5), (1e-5, 2.0)] {
                let step = BodyStep {
                    poses: &poses,
                    radii: &[1.0; 2],
                    drift: &drift,
                    velocity_weight: weight,
                    dt: 1.0,
                };
                let law = Repulsion { force, range, radius: 1.0 };
                let pair = PairRepulsion::new(law, [1.0; 2], 0.05, 0.3, 2.0, &step);
                let yielding = 0.1;
                let excess = pair.excess(gap, yielding);
                let end = gap + yielding * excess;
                let slope = pair.share * law.at::<3>(end, [1.0; 2]) / range * yielding;
                let off = excess - pair.excess_at(end);
                assert!(off.abs() <= 1e-12 * force * (1.0 + slope), "{force} {range} {gap} {excess} {off}");
            }
        }
    }
}
