//! Means of series with their confidence intervals.

use std::fmt;

use gluey_suspension::statistics::Estimate;
use serde::{Deserialize, Serialize};

use crate::number_text::shown_to;

/// Intervals below this part of the mean are rounding.
const ROUNDING: f64 = 1e-12;

/// The mean of a series, and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// Half the width of the interval that holds the true mean with a probability of 95 %; nothing for a
    /// single value.
    pub half_width: Option<f64>,
    /// Whether the series is long enough for this interval, which else is a lower bound.
    pub is_resolved: bool,
}

impl Mean {
    /// Of a series that is correlated; nothing if it is empty.
    pub fn of(series: &[f64]) -> Option<Self> {
        let one = || Some(Self { mean: *series.first()?, half_width: None, is_resolved: false });
        let many = |Estimate { mean, half_width, is_resolved, .. }| Self {
            mean,
            half_width: Some(half_width),
            is_resolved,
        };
        Estimate::of(series).map(many).or_else(one)
    }
}

impl fmt::Display for Mean {
    /// One that is the same all the time has no interval: a width of 0 would say that it is known exactly.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mean, half_width, is_resolved } = *self;
        write!(f, "{:>12}", shown_to(mean, 6))?;
        match half_width {
            None => write!(f, " once"),
            Some(width) if width <= ROUNDING * mean.abs() => write!(f, " always"),
            Some(width) if is_resolved => write!(f, " +- {}", shown_to(width, 2)),
            Some(width) => {
                write!(f, " +- {}   (too short a series for this interval)", shown_to(width, 2))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_have_intervals_where_there_are_any() {
        let told = |series: &[f64]| Mean::of(series).map(|mean| mean.to_string().trim().to_owned());
        assert_eq!(told(&[]), None);
        assert_eq!(told(&[0.25]), Some("0.25 once".to_owned()));
        assert_eq!(told(&[0.1; 20]), Some("0.1 always".to_owned()));
        let noise: Vec<f64> = (0..100).map(|n| f64::from(n * 7919 % 101) / 101.0).collect();
        assert!(told(&noise).is_some_and(|text| text.contains(" +- 0.0") && !text.contains("short")));
        assert!(told(&[1.0, 2.0]).is_some_and(|text| text.contains("too short")));
    }
}
