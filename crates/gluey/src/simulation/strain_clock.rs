//! Time where steps are those of the strain, because the stress is given and not the shear rate.
//!
//! Stokes flow has no memory: at a given stress a suspension goes through the same states against the strain
//! as at the rate one, if forces between particles count as they do at that rate. Time is `int dgamma / r`
//! with the rates `r` that the stress asks for, by the trapezoidal rule.

use serde::{Deserialize, Serialize};

/// Time at the last prediction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StrainClock {
    time: f64,
    /// Step of the last prediction, the share of it that was done, and time per strain then.
    last: Option<(usize, f64, f64)>,
}

impl StrainClock {
    /// Time at the last prediction.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Goes on to a prediction after so many steps of the strain `step_length` and a share of the next, where
    /// the rate is `rate`.
    pub(super) fn reach(&mut self, step: usize, share: f64, step_length: f64, rate: f64) {
        let now = rate.abs().recip();
        if let Some((last, last_share, before)) = self.last {
            // Shares are powers of two: exactly one after a whole step.
            let steps = step.saturating_sub(last) as f64 + share - last_share;
            self.time += 0.5 * step_length * steps.max(0.0) * (before + now);
        }
        self.last = Some((step, share, now));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_that_of_the_strain_over_the_rate() {
        let mut clock = StrainClock::default();
        for (step, time) in [(0, 0.0), (0, 0.0), (1, 0.3), (1, 0.3), (2, 0.5)] {
            clock.reach(step, 0.0, 0.1, [0.25, 0.5, 0.5][step]);
            assert!((clock.time() - time).abs() < 1e-15, "{step}: {}", clock.time());
        }
        // A step in two parts.
        clock.reach(2, 0.5, 0.1, 1.0);
        clock.reach(3, 0.0, 0.1, 1.0);
        assert!((clock.time() - 0.625).abs() < 1e-15, "{}", clock.time());
    }
}
