//! Numbers as people read them in messages; files keep all digits.

/// A number with at most twelve digits, without a row of zeros, and without what rounding added to it: a time
/// after 51 steps of 0.05 is 2.55, not 2.5500000000000003.
pub fn shown(x: f64) -> String {
    let rounded = format!("{x:.11e}").parse().unwrap_or(x);
    match x.abs() {
        1e-2..1e9 | 0.0 => f64::to_string(&rounded),
        _ => format!("{rounded:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn rounding_is_not_shown() {
        let texts =
            [51.0 * 0.05, 0.1 + 0.2, 3.0 * 1e-3, 0.0, -7.0, 20.0, 1.0 / 3.0, 1e300, f64::NAN].map(shown);
        let expected = ["2.55", "0.3", "3e-3", "0", "-7", "20", "0.333333333333", "1e300", "NaN"];
        assert_eq!(texts, expected);
    }
}
