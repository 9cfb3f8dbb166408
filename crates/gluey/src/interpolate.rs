//! Values between the rows of a table.

/// The value at `t` of the cubic through the four rows around `t` (fewer at short tables); `None` outside the
/// table. `times` ascend.
pub fn cubic(times: &[f64], value: impl Fn(usize) -> f64, t: f64) -> Option<f64> {
    let (first, last) = (*times.first()?, *times.last()?);
    let slack = 1e-12 * first.abs().max(last.abs());
    if !(t >= first - slack && t <= last + slack) {
        return None;
    }
    let above = times.partition_point(|&time| time <= t);
    let start = above.saturating_sub(2).min(times.len().saturating_sub(4));
    let rows = start..(start + 4).min(times.len());
    Some(rows.clone().map(|i| value(i) * lagrange(times, rows.clone(), i, t)).sum())
}

/// The value at `t` on the straight line between the rows before and after it; `None` outside the table.
/// `times` ascend.
pub fn linear(times: &[f64], value: impl Fn(usize) -> f64, t: f64) -> Option<f64> {
    let after = times.partition_point(|&time| time <= t);
    let row = after.checked_sub(1)?;
    let (weight, next) = match times.get(after) {
        Some(next) => ((t - times[row]) / (next - times[row]), after),
        None => (0.0, row),
    };
    let is_inside = after < times.len() || t - times[row] <= 1e-9 * t.abs();
    is_inside.then(|| (1.0 - weight) * value(row) + weight * value(next))
}

/// The Lagrange polynomial that is 1 at row `i` and 0 at the other `rows`.
fn lagrange(times: &[f64], rows: std::ops::Range<usize>, i: usize, t: f64) -> f64 {
    rows.filter(|&j| j != i).map(|j| (t - times[j]) / (times[i] - times[j])).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_reproduced_up_to_the_ends() {
        let f = |t: f64| 0.3 - t + 2.0 * t * t - 0.7 * t * t * t;
        let times = [0.0, 0.4, 0.7, 1.3, 2.0, 2.1];
        for t in [0.0, 0.1, 0.4, 0.65, 1.9, 2.05, 2.1] {
            let found = cubic(&times, |i| f(times[i]), t).expect("inside the table");
            assert!((found - f(t)).abs() < 1e-13, "{t}: {found} {}", f(t));
        }
    }

    #[test]
    fn there_is_nothing_outside_the_table() {
        let times = [0.0, 1.0];
        assert_eq!(cubic(&times, |i| times[i], -0.1), None);
        assert_eq!(cubic(&times, |i| times[i], 1.1), None);
        assert_eq!(cubic(&[], |_| 0.0, 0.0), None);
        assert_eq!(cubic(&times, |i| times[i], 0.25), Some(0.25));
        assert_eq!(linear(&times, |i| times[i], -0.1), None);
        assert_eq!(linear(&times, |i| times[i], 1.1), None);
        assert_eq!(linear(&[], |_| 0.0, 0.0), None);
    }

    #[test]
    fn straight_lines_are_reproduced_up_to_the_ends() {
        let (times, values) = ([0.0, 0.4, 0.7, 1.3], [1.0, 3.0, 3.0, 0.0]);
        for (t, wanted) in [(0.0, 1.0), (0.1, 1.5), (0.4, 3.0), (0.5, 3.0), (1.0, 1.5), (1.3, 0.0)] {
            let found = linear(&times, |i| values[i], t).expect("inside the table");
            assert!((found - wanted).abs() < 1e-15, "{t}: {found}");
        }
    }
}
