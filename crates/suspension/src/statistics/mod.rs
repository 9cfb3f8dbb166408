//! Means of correlated series, with their confidence intervals and without their transients.

mod blocks;
mod transient;

pub use blocks::{BlockLevel, block_levels};
pub use transient::{Transient, mser};

/// The mean of a stationary series, and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Standard error of the mean, correlations included.
    pub standard_error: f64,
    /// Half the width of the interval that holds the true mean with a probability of 95 %.
    pub half_width: f64,
    /// Length of the blocks whose means are taken as independent.
    pub block_length: usize,
    /// Number of such blocks.
    pub block_count: usize,
    /// Whether the series is long enough: whether the means of these blocks look independent.
    pub is_resolved: bool,
}

impl Estimate {
    /// The mean of a series, by block averages (Flyvbjerg and Petersen 1989, DOI 10.1063/1.457480); the
    /// length of the blocks by the test of Jonsson (2018, DOI 10.1103/PhysRevE.98.043304). `None` for fewer
    /// than two values.
    ///
    /// ```
    /// use gluey_suspension::statistics::Estimate;
    /// let estimate = Estimate::of(&[1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 2.0]).expect("eight values");
    /// assert_eq!(estimate.mean, 2.0);
    /// ```
    pub fn of(series: &[f64]) -> Option<Self> {
        let levels = block_levels(series);
        let (level, is_resolved) = blocks::independent(&levels)?;
        let standard_error = level.standard_error();
        Some(Self {
            mean: levels.first()?.mean,
            standard_error,
            half_width: standard_error * student(level.block_count - 1),
            block_length: level.block_length,
            block_count: level.block_count,
            is_resolved,
        })
    }
}

/// Quantile 0.975 of the normal distribution.
const NORMAL: f64 = 1.959_963_985;

/// Quantile 0.975 of Student's distribution, to 0.2 % (Abramowitz and Stegun 1964, 26.7.5).
fn student(freedoms: usize) -> f64 {
    const FEW: [f64; 5] = [f64::INFINITY, 12.706, 4.303, 3.182, 2.776];
    let (z, n) = (NORMAL, freedoms as f64);
    FEW.get(freedoms).copied().unwrap_or_else(|| {
        let first = (z.powi(3) + z) / 4.0;
        let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
        let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
        z + first / n + second / (n * n) + third / (n * n * n)
    })
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// An autoregressive series of variance 1/12 with the correlation `rho` from one value to the next:
    /// the variance of its mean is `(1 + rho) / (1 - rho) / (12 n)`.
    fn autoregressive(count: usize, rho: f64, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut x = 0.0;
        let mut next = || {
            x = rho * x + (1.0 - rho * rho).sqrt() * random.random_range(-0.5..0.5);
            x
        };
        (0..count + 200).map(|_| next()).skip(200).collect()
    }

    fn exact_error(count: usize, rho: f64) -> f64 {
        ((1.0 + rho) / (1.0 - rho) / (12.0 * count as f64)).sqrt()
    }

    #[test]
    fn errors_of_autoregressive_series_are_exact_on_average() {
        for (rho, count) in [(0.0, 5000), (0.5, 8000), (0.9, 20_000), (0.97, 30_001)] {
            let estimates: Vec<_> =
                (0..40).filter_map(|seed| Estimate::of(&autoregressive(count, rho, seed))).collect();
            let mean = estimates.iter().map(|e| e.standard_error).sum::<f64>() / 40.0;
            let exact = exact_error(count, rho);
            assert!((mean / exact - 1.0).abs() < 0.1, "rho {rho}: {mean} against {exact}");
            let covered = estimates.iter().filter(|e| e.mean.abs() <= e.half_width).count();
            assert!((34..=40).contains(&covered), "rho {rho}: {covered} of 40");
            assert!(estimates.iter().filter(|e| e.is_resolved).count() >= 34);
        }
    }

    #[test]
    fn a_series_shorter_than_its_correlation_is_not_resolved() {
        let ramp: Vec<f64> = (0..1000).map(f64::from).collect();
        assert!(!Estimate::of(&ramp).expect("values").is_resolved);
        assert_eq!(Estimate::of(&[1.0]), None);
        let constant = Estimate::of(&[2.0; 20]).expect("values");
        assert_eq!((constant.mean, constant.standard_error, constant.is_resolved), (2.0, 0.0, true));
    }

    #[test]
    fn quantiles_of_student() {
        for (freedoms, exact) in [(5, 2.5706), (10, 2.2281), (30, 2.0423), (1000, 1.9623)] {
            assert!((student(freedoms) / exact - 1.0).abs() < 2e-3);
        }
    }
}
