//! Plots of errors as charts with logarithmic axes.

use gluey_verify::Plot;

use crate::book;
use gluey_pictures::{Axis, Canvas, Chart, Curve, Mark, Stroke, stack};

/// Colours that stay apart for colour-blind readers, one for each formulation.
const COLORS: [&str; 4] = ["#0b4f9e", "#c8471b", "#1b7f4d", "#8a3ea0"];
const DASHES: [Option<&str>; 4] = [None, Some("9 4"), Some("2 2.5"), Some("9 3 2 3")];
const FRAME_HEIGHT: f64 = 340.0;

/// Draws a plot; points that a logarithm does not have are left out.
pub fn draw(plot: &Plot) -> Canvas {
    let curves: Vec<Curve> = plot.curves.iter().map(curve).collect();
    let points = || curves.iter().flat_map(|curve| curve.pieces.iter().flatten().copied());
    let (x, y) = (axis(plot.x, points().map(|p| p.0)), axis(plot.y, points().map(|p| p.1)));
    let marks = points().map(|at| Mark { at, label: String::new() }).collect();
    stack(&[Chart { marks, ..book::chart(x, y, curves) }], |_| FRAME_HEIGHT)
}

fn curve(curve: &gluey_verify::Curve) -> Curve {
    let stroke = Stroke {
        color: COLORS[curve.color % COLORS.len()],
        width: 1.6,
        dashes: DASHES[curve.dashes % DASHES.len()],
    };
    let has_logarithm = |x: f64| x > 0.0 && x.is_finite();
    let points = curve.points.iter().copied().filter(|&(x, y)| has_logarithm(x) && has_logarithm(y));
    Curve { label: Some(curve.label.clone()), stroke, pieces: vec![points.collect()] }
}

/// The axis that holds all values.
fn axis(label: &str, values: impl Iterator<Item = f64> + Clone) -> Axis {
    let (low, high) = (values.clone().reduce(f64::min), values.reduce(f64::max));
    Axis::decades(label, low.unwrap_or(1.0), high.unwrap_or(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_begin_and_end_at_powers_of_ten() {
        let ends = |values: &[f64]| {
            let axis = axis("", values.iter().copied());
            (axis.min.log10().round(), axis.max.log10().round())
        };
        assert_eq!(ends(&[0.05, 1.0]), (-2.0, 0.0));
        assert_eq!(ends(&[1.0]), (0.0, 1.0));
        assert_eq!(ends(&[]), (0.0, 1.0));
    }

    #[test]
    fn points_without_a_logarithm_are_left_out() {
        let points = vec![(1.0, 0.0), (1.0, f64::NAN), (2.0, 1e-3)];
        let drawn = curve(&gluey_verify::Curve { label: "a".into(), color: 9, dashes: 9, points });
        assert_eq!(drawn.pieces, [vec![(2.0, 1e-3)]]);
    }
}
