//! Numbers as messages show them.

/// A number without a row of zeros, and without what rounding added to it.
pub(super) fn shown(x: f64) -> String {
    let rounded = format!("{x:.9e}").parse().unwrap_or(x);
    match x.abs() {
        1e-2..1e9 | 0.0 => f64::to_string(&rounded),
        _ => format!("{rounded:e}"),
    }
}
