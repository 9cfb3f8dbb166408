//! Numbers at the ends of scales and in legends.

/// Four digits, without those that are 0 at the end.
pub(super) fn rounded(value: f64) -> String {
    let digits = (3.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if short == "-0" { "0".to_owned() } else { short.replace('-', "\u{2212}") }
}

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn numbers_have_four_digits_at_most() {
        let texts = [0.5, 0.0, -0.00001234567, 12345.6, 0.1 + 0.2].map(rounded);
        assert_eq!(texts, ["0.5", "0", "\u{2212}0.00001235", "12346", "0.3"]);
    }
}
