//! Numbers at the ends of scales and in captions.

use gluey::shown_to;

/// Three digits, in any unit.
pub(super) fn told(value: f64) -> String {
    told_to(value, 3)
}

/// At most so many digits, and the sign before them as books have it.
pub(super) fn told_to(value: f64, digits: usize) -> String {
    let text = shown_to(value, digits);
    text.strip_prefix('-').map_or(text.clone(), |size| format!("\u{2212}{size}"))
}

#[cfg(test)]
mod tests {
    use super::told;

    #[test]
    fn numbers_of_any_size_have_three_digits() {
        let texts = [0.5, 0.0, 1.8234e-5, 12345.6, 0.1 + 0.2, -1.0].map(told);
        assert_eq!(texts, ["0.5", "0", "1.82e-5", "12300", "0.3", "\u{2212}1"]);
    }
}
