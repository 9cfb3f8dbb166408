//! A curve, and how it is drawn.

/// The style of a curve, which means the same thing in every figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// CSS colour.
    pub color: &'static str,
    /// Width in SVG pixels.
    pub width: f64,
    /// SVG dash pattern; `None` is a solid line.
    pub dashes: Option<&'static str>,
}

/// A curve as pieces of consecutive points (it may be interrupted).
#[derive(Clone, Debug)]
pub struct Curve {
    /// Legend text with the markup of the [crate]; `None` keeps it out of the legend.
    pub label: Option<String>,
    /// How it is drawn.
    pub stroke: Stroke,
    /// Pieces of points `(x, y)`.
    pub pieces: Vec<Vec<(f64, f64)>>,
}
