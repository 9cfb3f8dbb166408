//! Intervals of wanted values, and whether a number lies in one.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A judgement of a number: whether it is what it should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Judgement {
    /// It is.
    Yes,
    /// It is not.
    No,
    /// It is missing or not finite.
    NotMeasured,
}

/// An interval of wanted values.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wanted {
    /// No smaller than this.
    AtLeast(f64),
    /// No larger than this.
    AtMost(f64),
    /// From the first to the second.
    Between(f64, f64),
}

impl Wanted {
    /// What is to be said of a number; limits are inclusive.
    pub fn outcome(self, value: Option<f64>) -> Judgement {
        match value.filter(|value| value.is_finite()) {
            None => Judgement::NotMeasured,
            Some(value) if self.holds(value) => Judgement::Yes,
            Some(_) => Judgement::No,
        }
    }

    fn holds(self, value: f64) -> bool {
        match self {
            Self::AtLeast(low) => value >= low,
            Self::AtMost(high) => value <= high,
            Self::Between(low, high) => (low..=high).contains(&value),
        }
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::AtLeast(low) => write!(f, "at least {}", short(low)),
            Self::AtMost(high) => write!(f, "at most {}", short(high)),
            Self::Between(low, high) => write!(f, "between {} and {}", short(low), short(high)),
        }
    }
}

/// A number in few characters.
fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:e}") } else { format!("{value}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_inclusive_and_what_is_not_a_number_is_not_measured() {
        assert_eq!(Wanted::AtMost(1.0).outcome(Some(1.0)), Judgement::Yes);
        assert_eq!(Wanted::AtMost(1.0).outcome(Some(1.1)), Judgement::No);
        assert_eq!(Wanted::AtLeast(1.0).outcome(Some(0.9)), Judgement::No);
        assert_eq!(Wanted::Between(0.0, 0.4).outcome(Some(0.5)), Judgement::No);
        for value in [None, Some(f64::NAN), Some(f64::INFINITY)] {
            assert_eq!(Wanted::AtMost(1.0).outcome(value), Judgement::NotMeasured);
        }
    }

    #[test]
    fn wanted_values_read_like_speech() {
        assert_eq!(Wanted::Between(-0.5, 0.5).to_string(), "between -0.5 and 0.5");
        assert_eq!(Wanted::AtMost(2e-7).to_string(), "at most 2e-7");
    }
}
