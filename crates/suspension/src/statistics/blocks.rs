//! Block averages: means of pairs, of pairs of pairs, and so on, until they are independent.

/// A series whose values are means of blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockLevel {
    /// Values of the first series in a block.
    pub block_length: usize,
    /// Number of blocks.
    pub block_count: usize,
    /// Mean of the block means.
    pub mean: f64,
    /// Their variance (over their number, not one less).
    pub variance: f64,
    /// Covariance of block means that follow each other (over their number).
    pub covariance: f64,
}

impl BlockLevel {
    fn of(values: &[f64], block_length: usize) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
        let covariance =
            values.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum::<f64>() / count;
        Self { block_length, block_count: values.len(), mean, variance, covariance }
    }

    /// Standard error of the mean if the block means are independent: `sqrt(variance / (n - 1))`.
    pub fn standard_error(&self) -> f64 {
        (self.variance / (self.block_count - 1) as f64).sqrt()
    }

    /// How much the correlation of neighbours tells against independence: about the square of a normal number
    /// if there is none.
    fn evidence(&self) -> f64 {
        if self.variance == 0.0 {
            return 0.0;
        }
        let count = self.block_count as f64;
        // Independent values correlate by -variance / count, since their mean is their own.
        let excess = self.covariance / self.variance + (count - 1.0) / (count * count);
        count * excess * excess
    }
}

/// All levels with at least two blocks, single values first; an odd block at the end is left out.
pub fn block_levels(series: &[f64]) -> Vec<BlockLevel> {
    let mut values = series.to_vec();
    let mut levels = Vec::new();
    while values.len() >= 2 {
        levels.push(BlockLevel::of(&values, 1 << levels.len()));
        values = values.chunks_exact(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    }
    levels
}

/// Fewer block means say too little about their independence.
const FEWEST_BLOCKS: usize = 10;

/// Quantile 0.9 of the normal distribution.
const NORMAL: f64 = 1.281_551_566;

/// The first level from which on nothing tells against independence, and whether there is one; else the last.
/// The evidence of all levels behind is tested together, against the quantile 0.9 of chi squared: a higher
/// one takes errors for 10 % smaller than they are.
pub(super) fn independent(levels: &[BlockLevel]) -> Option<(&BlockLevel, bool)> {
    let mut evidence = 0.0;
    let mut first = None;
    for (behind, level) in levels.iter().rev().enumerate() {
        evidence += level.evidence();
        if evidence >= chi_squared(behind + 1) {
            break;
        }
        first = Some(level);
    }
    let is_resolved = first.is_some_and(|level| level.block_count >= FEWEST_BLOCKS);
    first.or(levels.last()).map(|level| (level, is_resolved))
}

/// Quantile 0.9 of chi squared, to 3 % (Wilson and Hilferty 1931, DOI 10.1073/pnas.17.12.684).
fn chi_squared(freedoms: usize) -> f64 {
    let n = freedoms as f64;
    let ninth = 2.0 / (9.0 * n);
    n * (1.0 - ninth + NORMAL * ninth.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_of_eight_numbers() {
        let levels = block_levels(&[1.0, 3.0, 5.0, 7.0, 5.0, 3.0, 1.0, -1.0, 9.0]);
        assert_eq!(levels.len(), 4 - 1);
        assert_eq!((levels[1].block_length, levels[1].block_count, levels[1].mean), (2, 4, 3.0));
        assert_eq!(levels[2].variance, 1.0);
    }

    #[test]
    fn quantiles_of_chi_squared() {
        for (freedoms, exact) in [(1, 2.706), (5, 9.236), (20, 28.412)] {
            assert!((chi_squared(freedoms) / exact - 1.0).abs() < 0.03);
        }
    }
}
