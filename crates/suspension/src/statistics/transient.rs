//! Where a series has forgotten its start: the marginal standard error rule.

/// Values that are averaged before the rule is applied.
const BATCH: usize = 5;

/// The beginning of a series that is not to be averaged over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transient {
    /// Number of values to leave out.
    pub length: usize,
    /// Whether it ends within the first half of the series; a series whose transient does not is too short.
    pub is_over: bool,
}

/// The transient of a series by the rule MSER-5 (White, Cobb and Spratt 2000, DOI 10.1109/WSC.2000.899722):
/// of the means `Y_i` of five values, leave out the first `d` such that
/// `sum_{i > d} (Y_i - mean)^2 / (n - d)^2` is least, with `d` at most half of them.
///
/// ```
/// use gluey_suspension::statistics::mser;
/// let series: Vec<f64> = (0..1000).map(|i| (-f64::from(i) / 20.0).exp() + 0.1 * f64::from(i % 7)).collect();
/// let transient = mser(&series);
/// assert!(transient.is_over && (20..200).contains(&transient.length));
/// ```
pub fn mser(series: &[f64]) -> Transient {
    let batches: Vec<f64> =
        series.chunks_exact(BATCH).map(|batch| batch.iter().sum::<f64>() / BATCH as f64).collect();
    // Relative to a value of the series, so that squares do not cancel.
    let origin = batches.last().copied().unwrap_or(0.0);
    let (mut sum, mut squares) = (0.0, 0.0);
    let mut best = (f64::INFINITY, 0);
    let most = batches.len() / 2;
    for (kept, batch) in (1..).zip(batches.iter().rev()) {
        sum += batch - origin;
        squares += (batch - origin).powi(2);
        let (left_out, count) = (batches.len() - kept, kept as f64);
        let rule = (squares - sum * sum / count).max(0.0) / (count * count);
        if left_out <= most && rule <= best.0 {
            best = (rule, left_out);
        }
    }
    Transient { length: BATCH * best.1, is_over: batches.len() >= 4 && best.1 < most }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stationary_series_has_no_transient_and_a_ramp_does_not_end() {
        let wave: Vec<f64> = (0..1000).map(|i| (0.7 * f64::from(i)).sin()).collect();
        assert!(mser(&wave).length < 100 && mser(&wave).is_over);
        let ramp: Vec<f64> = (0..1000).map(f64::from).collect();
        assert!(!mser(&ramp).is_over);
        assert_eq!(mser(&[]), Transient { length: 0, is_over: false });
    }

    #[test]
    fn a_step_is_cut_where_it_is() {
        let noise = |i: i32| f64::from((i * 7919) % 101) / 1000.0;
        let series: Vec<f64> = (0..500).map(|i| noise(i) + if i < 100 { 1.0 } else { 0.0 }).collect();
        assert!(mser(&series).is_over && (100..=110).contains(&mser(&series).length));
    }
}
