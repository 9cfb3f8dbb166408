//! Pictures as data: errors over what they depend on, both axes logarithmic.

use crate::method::FILM_METHODS;

/// A picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// What the horizontal axis shows.
    pub x: &'static str,
    /// What the vertical axis shows.
    pub y: &'static str,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Its name.
    pub label: String,
    /// Number of its colour.
    pub color: usize,
    /// Number of its dashes; zero is a solid line.
    pub dashes: usize,
    /// Its points, in order.
    pub points: Vec<(f64, f64)>,
}

impl Plot {
    /// One curve for each formulation and each of several things, where `points` gives it any.
    pub fn of_methods(
        x: &'static str,
        y: &'static str,
        things: &[&str],
        points: impl Fn(&'static str, usize) -> Vec<(f64, f64)>,
    ) -> Self {
        let curve = |color: usize, dashes: usize| Curve {
            label: format!("{}, {}", FILM_METHODS[color].name, things[dashes]),
            color,
            dashes,
            points: points(FILM_METHODS[color].name, dashes),
        };
        let of_method = |color: usize| (0..things.len()).map(move |thing| (color, thing));
        let curves = (0..FILM_METHODS.len()).flat_map(of_method).map(|(color, thing)| curve(color, thing));
        Self { x, y, curves: curves.filter(|curve| curve.points.iter().any(|p| p.1.is_finite())).collect() }
    }
}
