//! Results with error bars beside curves of the literature.

use crate::book;
use gluey_pictures::{Axis, Canvas, Curve, Stroke, stack};

const FRAME_HEIGHT: f64 = 340.0;

/// Points with error bars for what was computed, in colours that stay apart for colour-blind readers.
const COMPUTED: [Stroke; 6] = [
    Stroke { color: "#0b4f9e", width: 1.8, dashes: None },
    Stroke { color: "#c8471b", width: 1.8, dashes: None },
    Stroke { color: "#1b7f4d", width: 1.8, dashes: None },
    Stroke { color: "#8a3ea0", width: 1.8, dashes: None },
    Stroke { color: "#111", width: 1.8, dashes: None },
    Stroke { color: "#b8860b", width: 1.8, dashes: None },
];
/// Thin lines for what is known.
const KNOWN: [Stroke; 4] = [
    Stroke { color: "#111", width: 1.2, dashes: Some("2 2.5") },
    Stroke { color: "#111", width: 1.2, dashes: Some("9 4") },
    Stroke { color: "#111", width: 1.2, dashes: Some("9 3 2 3") },
    Stroke { color: "#111", width: 1.2, dashes: Some("4 2") },
];

/// Known curves with their labels.
pub type Known = Vec<(String, Vec<(f64, f64)>)>;

/// A quantity with its error, at many places.
#[derive(Clone, Debug)]
pub struct StudySeries {
    /// Its name in the legend.
    pub label: String,
    /// Place, mean, and half the length of its error bar.
    pub points: Vec<(f64, f64, f64)>,
}

impl StudySeries {
    /// Without points so far.
    pub fn new(label: &str) -> Self {
        Self { label: label.to_owned(), points: Vec::new() }
    }

    /// Adds a point to the series of this label, if it is one of them.
    pub fn add(all: &mut [Self], label: &str, point: (f64, f64, f64)) {
        all.iter_mut().filter(|series| series.label == label).for_each(|series| series.points.push(point));
    }
}

/// A known curve: a function of fractions up to so many hundredths.
pub fn curve(label: &str, function: fn(f64) -> f64, last: u32) -> (String, Vec<(f64, f64)>) {
    let fractions = (0..=last).map(|k| f64::from(k) / 100.0);
    (label.to_owned(), fractions.map(|phi| (phi, function(phi))).collect())
}

/// Series and known curves over a pair of axes, each logarithmic or not; an upright one that is leaves out
/// what is not positive.
pub fn draw(labels: [&str; 2], is_logarithmic: [bool; 2], series: &[StudySeries], known: Known) -> Canvas {
    let mut curves: Vec<Curve> = Vec::new();
    for ((label, points), stroke) in known.into_iter().zip(KNOWN) {
        curves.push(Curve { label: Some(label), stroke, pieces: vec![points] });
    }
    let is_up = is_logarithmic[1];
    for (series, stroke) in series.iter().zip(COMPUTED) {
        let is_shown = |point: &&(f64, f64, f64)| !is_up || point.1 > 0.0;
        let points: Vec<_> = series.points.iter().filter(is_shown).copied().collect();
        let dots = points.iter().map(|&(x, y, _)| vec![(x, y)]).collect();
        curves.push(Curve { label: Some(series.label.clone()), stroke, pieces: dots });
        let bars = points.iter().filter(|(_, y, error)| *error > 0.0 && (!is_up || error < y));
        let bars = bars.map(|&(x, y, error)| vec![(x, y - error), (x, y + error)]).collect();
        curves.push(Curve { label: None, stroke, pieces: bars });
    }
    let points = || curves.iter().flat_map(|curve| curve.pieces.iter().flatten().copied());
    let axis = |label: &str, is_logarithmic: bool, values: Vec<f64>| match is_logarithmic {
        true => {
            let low = values.iter().copied().reduce(f64::min).unwrap_or(0.1);
            Axis::decades(label, low, values.iter().copied().fold(low, f64::max))
        }
        false => Axis::around(label, values),
    };
    let across = axis(labels[0], is_logarithmic[0], points().map(|point| point.0).collect());
    let up = axis(labels[1], is_up, points().map(|point| point.1).collect());
    stack(&[book::chart(across, up, curves)], |_| FRAME_HEIGHT)
}
