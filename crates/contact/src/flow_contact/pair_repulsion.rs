//! Repulsion of a pair in a step, which may be as long as it likes.

use crate::{BodyStep, Repulsion};

/// Rounding of a push, over the largest one.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Repulsion of a pair in a step.
///
/// The flow has the force `F(g^n)` of the beginning. The force of the step is
///
/// `f^n = alpha F(g^{n+1}) + (1 - alpha) f^{n-1}`, `alpha = 1/(1 + dt^n / dt^{n-1})`,
///
/// which is `F(g^n)` to second order where the scheme has a history, and the force at the end where it has
/// none. Together with `x^{n+1} = x^n + c u^n + drift` this is of second order and stable for any step: for
/// `g' = -k g` and steps of equal lengths `dt`, `(2 + 3 k dt/2) z^2 - (3 + k dt/2) z + 1 = 0`, whose roots
/// are 1 and 1/2 at `k dt = 0`, 0 and 1/3 at `k dt -> inf`.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairRepulsion<const D: usize> {
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
    /// That of surfaces of these radii at this gap, after a step with the force `before`, where forces count
    /// by `rate`.
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
        // -1 in the step after a reversal, whose weight is `dt / 2`: there the force at its end counts alone.
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
