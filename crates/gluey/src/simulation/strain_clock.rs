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
    /// Step of the last prediction, and time per strain then.
    last: Option<(usize, f64)>,
}

impl StrainClock {
    /// Time at the last prediction.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Goes on to a prediction after so many steps of the strain `step_length`, where the rate is `rate`.
    pub(super) fn reach(&mut self, step: usize, step_length: f64, rate: f64) {
        let now = rate.abs().recip();
        if let Some((_, before)) = self.last.filter(|(last, _)| *last < step) {
            self.time += 0.5 * step_length * (before + now);
        }
        self.last = Some((step, now));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_that_of_the_strain_over_the_rate() {
        let mut clock = StrainClock::default();
        for (step, time) in [(0, 0.0), (0, 0.0), (1, 0.3), (1, 0.3), (2, 0.5)] {
            clock.reach(step, 0.1, [0.25, 0.5, 0.5][step]);
            assert!((clock.time() - time).abs() < 1e-15, "{step}: {}", clock.time());
        }
    }
}
