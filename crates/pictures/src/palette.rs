//! Strokes that stay apart for colour-blind readers and in grey.

use crate::curve::Stroke;

/// Strokes of curves that belong together, in this order; each has a colour and dashes of its own.
pub const PALETTE: [Stroke; 6] = [
    Stroke { color: "#0b4f9e", width: 1.8, dashes: None },
    Stroke { color: "#c8471b", width: 1.8, dashes: Some("9 4") },
    Stroke { color: "#1b7f4d", width: 1.8, dashes: Some("9 3 2 3") },
    Stroke { color: "#8a3ea0", width: 1.8, dashes: Some("2 2.5") },
    Stroke { color: "#c79a00", width: 1.8, dashes: Some("1.5 1.5 6 1.5") },
    Stroke { color: "#555555", width: 1.8, dashes: Some("14 4") },
];
