//! Distributions of radii.

use rand::{RngExt, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use super::PackingError;

/// The distribution of radii, whose mean is set by the fraction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sizes {
    /// All radii are equal.
    #[default]
    Equal,
    /// Two radii.
    Bidisperse {
        /// The larger radius over the smaller one, above 1.
        ratio: f64,
        /// How many large particles there are.
        large: LargeShare,
    },
    /// The logarithm of the radius is normally distributed, cut at three standard deviations.
    Lognormal {
        /// Standard deviation of `ln a`.
        deviation: f64,
    },
}

/// Share of the large particles, between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LargeShare {
    /// Of the number of particles.
    OfNumber(f64),
    /// Of the volume of particles (in 2D: area).
    OfVolume(f64),
}

/// Standard deviations at which normal distributions are cut.
const CUT: f64 = 3.0;

impl Sizes {
    pub(super) fn check(&self) -> Result<(), PackingError> {
        let within = |name, value: f64, is_right, wanted| match is_right && value.is_finite() {
            true => Ok(()),
            false => Err(PackingError::OutOfRange { name, value, wanted }),
        };
        match *self {
            Self::Equal => Ok(()),
            Self::Bidisperse { ratio, large } => {
                let (LargeShare::OfNumber(share) | LargeShare::OfVolume(share)) = large;
                within("the ratio of the radii", ratio, ratio > 1.0 && ratio <= 10.0, "above 1, at most 10")?;
                let is_share = share > 0.0 && share < 1.0;
                within("the share of large particles", share, is_share, "between 0 and 1")
            }
            Self::Lognormal { deviation } => {
                let is_right = deviation > 0.0 && deviation <= 0.5;
                within("the deviation of ln a", deviation, is_right, "above 0, at most 0.5")
            }
        }
    }

    /// Radii in random order, in a unit of their own.
    pub(super) fn sample<const D: usize>(&self, count: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
        match *self {
            Self::Equal => vec![1.0; count],
            Self::Bidisperse { ratio, large } => {
                let large_count = (large.of_number::<D>(ratio) * count as f64).round() as usize;
                let mut radii: Vec<f64> =
                    (0..count).map(|i| if i < large_count { ratio } else { 1.0 }).collect();
                radii.shuffle(random);
                radii
            }
            Self::Lognormal { deviation } => {
                (0..count).map(|_| (deviation * cut_normal(random)).exp()).collect()
            }
        }
    }
}

impl LargeShare {
    /// Share of the number: with the share `s` of the volume and the ratio `r`, `s / (s + (1 - s) r^D)`.
    fn of_number<const D: usize>(self, ratio: f64) -> f64 {
        match self {
            Self::OfNumber(share) => share,
            Self::OfVolume(share) => share / (share + (1.0 - share) * ratio.powi(D as i32)),
        }
    }
}

/// A normal number within [`CUT`] (Box and Muller 1958, DOI 10.1214/aoms/1177706645).
fn cut_normal(random: &mut ChaCha8Rng) -> f64 {
    loop {
        let (u, v): (f64, f64) = (random.random_range(0.0..1.0), random.random_range(0.0..1.0));
        let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
        if normal.abs() <= CUT {
            return normal;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn shares_are_met() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let large = LargeShare::OfVolume(0.5);
        let radii = Sizes::Bidisperse { ratio: 2.0, large }.sample::<3>(900, &mut random);
        assert_eq!(radii.iter().filter(|&&a| a == 2.0).count(), 100);
        assert!(radii[..100].contains(&1.0));
    }

    #[test]
    fn logarithms_have_their_deviation() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let radii = Sizes::Lognormal { deviation: 0.2 }.sample::<2>(20_000, &mut random);
        let logs: Vec<f64> = radii.iter().map(|a| a.ln()).collect();
        let mean = logs.iter().sum::<f64>() / 20_000.0;
        let variance = logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 20_000.0;
        // Cut at three deviations the variance is 0.9733 of the whole.
        assert!(mean.abs() < 0.005 && (variance.sqrt() - 0.2 * 0.9733f64.sqrt()).abs() < 0.003);
        assert!(logs.iter().all(|x| x.abs() <= 0.6));
    }

    #[test]
    fn what_is_no_distribution_is_refused() {
        for sizes in [
            Sizes::Lognormal { deviation: 0.0 },
            Sizes::Lognormal { deviation: f64::NAN },
            Sizes::Bidisperse { ratio: 1.0, large: LargeShare::OfNumber(0.5) },
            Sizes::Bidisperse { ratio: 2.0, large: LargeShare::OfNumber(1.0) },
        ] {
            assert!(matches!(sizes.check(), Err(PackingError::OutOfRange { .. })), "{sizes:?}");
        }
    }
}
