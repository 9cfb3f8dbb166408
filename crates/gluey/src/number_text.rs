//! Numbers as people read them in messages; files keep all digits.

/// A number with at most twelve digits, without a row of zeros, and without what rounding added to it: a time
/// after 51 steps of 0.05 is 2.55, not 2.5500000000000003.
pub fn shown(x: f64) -> String {
    shown_to(x, 12)
}

/// A number with at most so many digits, without a row of zeros.
pub fn shown_to(x: f64, digits: usize) -> String {
    if x.is_subnormal() {
        // The shortest text that reads back as such a number is not near it.
        return format!("{x:.1e}");
    }
    let rounded = format!("{x:.*e}", digits.saturating_sub(1)).parse().unwrap_or(x);
    match x.abs() {
        1e-2..1e9 | 0.0 => f64::to_string(&rounded),
        _ => format!("{rounded:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{shown, shown_to};

    #[test]
    fn rounding_is_not_shown() {
        let texts =
            [51.0 * 0.05, 0.1 + 0.2, 3.0 * 1e-3, 0.0, -7.0, 20.0, 1.0 / 3.0, 1e300, f64::NAN, 4.9e-324];
        let texts = texts.map(shown);
        let expected = ["2.55", "0.3", "3e-3", "0", "-7", "20", "0.333333333333", "1e300", "NaN", "4.9e-324"];
        assert_eq!(texts, expected);
        assert_eq!([0.042456189, 3.6490312e-4, 21.5].map(|x| shown_to(x, 3)), ["0.0425", "3.65e-4", "21.5"]);
    }
}
