//! Paths of the centres in the x-y plane, both axes to one scale: figures 6, 7b, 10 and 11.

use super::data::{Data, exact_curve, legend, stroke};
use crate::book;
use crate::reproduce::plan::FigureName;
use crate::reproduce::trajectory::Trajectory;
use gluey_pictures::{Axis, Canvas, Chart, Curve, Mark, equal_aspect_height, stack};

/// Figure 6, 7b, 10 or 11: the paths of all particles.
pub fn paths(figure: FigureName, data: &Data) -> Canvas {
    let all =
        |run: &Trajectory| (1..=run.centers.len()).map(|particle| run.path_xy(particle)).collect::<Vec<_>>();
    let mut curves: Vec<Curve> = Vec::new();
    for (approach, run) in data.runs_of(figure) {
        let label = Some(legend(approach).to_owned());
        curves.push(Curve { label, stroke: stroke(approach), pieces: all(run) });
    }
    curves.extend(data.exact.get(&figure.case()).map(|exact| exact_curve("exact", all(exact))));
    let (x, y) = axes(&curves);
    let chart = Chart { x, y, marks: starts(&curves), curves, notes: data.notes(figure) };
    let mut canvas = stack(std::slice::from_ref(&chart), equal_aspect_height);
    if figure == FigureName::Fig6 {
        enlarge_right_edge(&mut canvas, &chart);
    }
    canvas
}

/// Draws into the empty middle of the circles of figure 6 where they cross the x axis on the right, x
/// stretched: the orbits differ by less than a line's width elsewhere.
fn enlarge_right_edge(canvas: &mut Canvas, chart: &Chart) {
    let half_height = 0.01;
    let points = chart.curves.iter().flat_map(|curve| curve.pieces.iter().flatten());
    let edge = points.filter(|(x, y)| (y - 0.5).abs() <= half_height && *x > 0.5).map(|(x, _)| *x);
    let Some((low, high)) = edge.map(|x| (x, x)).reduce(|(low, high), (x, _)| (low.min(x), high.max(x)))
    else {
        return;
    };
    let tick = if high - low > 0.004 { 0.005 } else { 0.001 };
    let pad = 0.3 * tick;
    let x = book::linear("", low - pad, high + pad, tick);
    let y = book::linear("", 0.5 - half_height, 0.5 + half_height, 0.01);
    let inset = book::chart(x, y, chart.curves.clone());
    let size = (300.0, 240.0);
    let (center_x, center_y) = chart.point_in_stack(canvas.height(), (0.5, 0.5));
    let corner = (center_x - 0.5 * size.0 - 20.0, center_y - 0.5 * size.1);
    canvas.embed(&inset.svg(size.0, size.1), corner.0, corner.1);
    canvas.text(center_x, corner.1 - 4.0, 14.0, "middle", "right edge, *x* stretched");
}

/// The numbers of the particles where their paths begin.
fn starts(curves: &[Curve]) -> Vec<Mark> {
    let paths = curves.first().map_or(&[][..], |curve| &curve.pieces);
    let first_points = paths.iter().filter_map(|path| path.first());
    first_points.zip(1..).map(|(&at, number)| Mark { at, label: format!("{number}") }).collect()
}

/// Axes around all points, widened to whole ticks.
fn axes(curves: &[Curve]) -> (Axis, Axis) {
    let points = || curves.iter().flat_map(|curve| curve.pieces.iter().flatten());
    let bounds = |pick: fn(&(f64, f64)) -> f64| {
        let values = || points().map(pick).filter(|value| value.is_finite());
        (values().reduce(f64::min).unwrap_or(0.0), values().reduce(f64::max).unwrap_or(1.0))
    };
    let (x, y) = (bounds(|p| p.0), bounds(|p| p.1));
    (axis("*x*", x.0, x.1), axis("*y*", y.0, y.1))
}

fn axis(label: &str, low: f64, high: f64) -> Axis {
    let tick = [0.2, 0.1, 0.05, 0.02].into_iter().find(|tick| high - low > 3.5 * tick).unwrap_or(0.01);
    let half = 0.5 * tick;
    let (min, max) = ((low / half - 0.2).floor() * half, (high / half + 0.2).ceil() * half);
    book::linear(label, min, max, tick)
}

#[cfg(test)]
mod tests {
    use super::super::data::EXACT_STROKE;
    use super::*;

    #[test]
    fn axes_hold_all_points_with_whole_half_ticks() {
        let curve =
            Curve { label: None, stroke: EXACT_STROKE, pieces: vec![vec![(0.3, 0.45), (0.71, 0.55)]] };
        let (x, y) = axes(&[curve]);
        assert!(x.min <= 0.3 && x.max >= 0.71 && y.min <= 0.45 && y.max >= 0.55);
        assert!(((x.min / (0.5 * x.tick)).fract()).abs() < 1e-9);
    }
}
