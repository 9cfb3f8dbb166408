//! Gaps over time on a logarithmic scale: figures 5, 7a and 9.

use super::data::{Data, EXACT_STROKE, exact_curve, legend, stroke};
use crate::book;
use crate::reproduce::plan::{Approach, CaseName, FigureName};
use crate::reproduce::trajectory::Trajectory;
use gluey_pictures::{Axis, Canvas, Chart, Curve, Stroke, stack};

const FRAME_HEIGHT: f64 = 300.0;
const PANEL_HEIGHT: f64 = 170.0;

/// Colour of the parts of a curve where particles overlap and |D| is drawn.
const OVERLAP_COLOR: &str = "#7fc49f";

/// Figure 5 or 7a: |D/a| of a pair.
pub fn pair(figure: FigureName, data: &Data) -> Canvas {
    let floor = if figure == FigureName::Fig5 { 1e-6 } else { 1e-5 };
    let mut chart = panel(figure, data, (1, 2), floor);
    chart.notes = notes(figure, data, std::slice::from_ref(&chart), floor);
    stack(&[chart], |_| FRAME_HEIGHT)
}

/// Figure 9: D/a of the three pairs, positive values only, one panel each.
pub fn trio(data: &Data) -> Canvas {
    let (figure, floor) = (FigureName::Fig9, 1e-6);
    let mut charts = [(1, 2), (1, 3), (2, 3)].map(|pair| panel(figure, data, pair, floor));
    for upper in &mut charts[..2] {
        upper.x.label.clear();
    }
    charts[0].notes = notes(figure, data, &charts, floor);
    stack(&charts, |_| PANEL_HEIGHT)
}

/// The gap of a pair in all runs of a figure.
fn panel(figure: FigureName, data: &Data, pair: (usize, usize), floor: f64) -> Chart {
    let is_pair = figure.case() != CaseName::Trio2d;
    let runs = data.runs_of(figure).into_iter();
    let mut curves: Vec<Curve> =
        runs.flat_map(|(approach, run)| gap_curves(approach, run, pair, floor, is_pair)).collect();
    let exact = data.exact.get(&figure.case()).and_then(|exact| Some((exact, exact.gap(pair)?)));
    curves.extend(exact.map(|(exact, gap)| exact_curve("exact", vec![clipped(&exact.times, gap, floor)])));
    let (i, j) = pair;
    let label = if is_pair { "|*D*/*a*|".to_owned() } else { format!("*D*_{{{i}{j}}}/*a*") };
    let y = gap_axis(&label, &curves, floor);
    book::chart(time_axis(&curves), y, curves)
}

/// Notes of the figure; the last says that values were clipped, if they were.
fn notes(figure: FigureName, data: &Data, charts: &[Chart], floor: f64) -> Vec<String> {
    let mut notes = data.notes(figure);
    if charts.iter().any(|chart| values(&chart.curves).any(|(_, value)| *value <= floor)) {
        let exponent = format!("{:.0}", floor.log10()).replace('-', "\u{2212}");
        notes.push(format!("Contact: gaps below 10^{{{exponent}}} *a* are drawn at 10^{{{exponent}}}."));
    }
    notes
}

/// The curve of a run; where the gap is negative, a second curve shows |D| if `with_overlap`.
fn gap_curves(
    approach: Approach,
    run: &Trajectory,
    pair: (usize, usize),
    floor: f64,
    with_overlap: bool,
) -> Vec<Curve> {
    let Some(gap) = run.gap(pair) else { return Vec::new() };
    let overlaps = |value: f64| value < -floor;
    let pieces = |overlap: bool| -> Vec<Vec<(f64, f64)>> {
        let points: Vec<(f64, f64)> = run.times.iter().copied().zip(gap.iter().copied()).collect();
        let parts = points.chunk_by(|a, b| overlaps(a.1) == overlaps(b.1));
        let wanted = parts.filter(|part| overlaps(part[0].1) == overlap);
        wanted.map(|part| part.iter().map(|&(t, value)| (t, value.abs().max(floor))).collect()).collect()
    };
    let style = stroke(approach);
    let mut curves =
        vec![Curve { label: Some(legend(approach).to_owned()), stroke: style, pieces: pieces(false) }];
    let negative = pieces(true);
    if with_overlap && !negative.is_empty() {
        let label = format!("{}, *D* < 0", legend(approach));
        let stroke = Stroke { color: OVERLAP_COLOR, ..style };
        curves.push(Curve { label: Some(label), stroke, pieces: negative });
    }
    curves
}

fn clipped(times: &[f64], gap: &[f64], floor: f64) -> Vec<(f64, f64)> {
    times.iter().zip(gap).map(|(&t, &value)| (t, value.max(floor))).collect()
}

fn values(curves: &[Curve]) -> impl Iterator<Item = &(f64, f64)> {
    curves.iter().flat_map(|curve| curve.pieces.iter().flatten())
}

/// Times from 0 to the end of the longest curve, in units of 1/shear rate.
fn time_axis(curves: &[Curve]) -> Axis {
    let end = values(curves).map(|(t, _)| *t).fold(1.0, f64::max);
    let runs_end = curves.iter().filter(|c| c.stroke != EXACT_STROKE).flat_map(|c| c.pieces.iter().flatten());
    let end = runs_end.map(|(t, _)| *t).reduce(f64::max).unwrap_or(end);
    let tick = if end > 20.0 { 5.0 } else { 2.0 };
    book::linear("*t* (1/shear rate)", 0.0, (end - 1e-9).ceil(), tick)
}

/// From the floor (or the decade below the smallest value) to the decade above the largest value.
fn gap_axis(label: &str, curves: &[Curve], floor: f64) -> Axis {
    let low = values(curves).map(|(_, value)| *value).fold(1.0, f64::min).max(floor);
    let high = values(curves).map(|(_, value)| *value).fold(low * 10.0, f64::max);
    Axis::decades(label, low, high)
}
