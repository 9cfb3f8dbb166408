//! One chart: styled curves over linear or logarithmic axes, drawn by kuva, with a legend above the frame.

use kuva::backend::svg::SvgBackend;
use kuva::plot::LinePlot;
use kuva::plot::line::LineStyle;
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot;
use kuva::render::render::render_multiple;
use std::sync::Arc;

use crate::canvas::{Canvas, FONT_FAMILY};

/// Width of a figure, in SVG pixels.
pub const WIDTH: f64 = 600.0;
const MARGIN_LEFT: f64 = 66.0;
const MARGIN_RIGHT: f64 = 18.0;
const MARGIN_BOTTOM: f64 = 48.0;
const MARGIN_TOP: f64 = 8.0;
const LEGEND_ROW: f64 = 19.0;
const LEGEND_SAMPLE: f64 = 40.0;

/// How a curve is drawn; one style means the same thing in every figure.
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

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Label with the markup of the [crate].
    pub label: String,
    /// Smallest value shown.
    pub min: f64,
    /// Largest value shown.
    pub max: f64,
    /// Distance of ticks (ignored on a logarithmic axis).
    pub tick: f64,
    /// Logarithmic (base 10).
    pub log: bool,
}

/// A chart: curves over a pair of axes.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, the first at the bottom.
    pub curves: Vec<Curve>,
    /// Remarks in small print, one line each, above the frame.
    pub notes: Vec<String>,
    /// Dots with labels.
    pub marks: Vec<Mark>,
}

/// A dot with a label.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Where, in data coordinates.
    pub at: (f64, f64),
    /// Text with the markup of the [crate]; may be empty.
    pub label: String,
}

impl Axis {
    /// A logarithmic axis around these values, from a whole power of ten to a whole power of ten.
    pub fn decades(label: &str, low: f64, high: f64) -> Self {
        let (first, last) = ((low.log10() + 1e-9).floor(), (high.log10() - 1e-9).ceil());
        let decade = |exponent: f64| 10f64.powf(exponent);
        let max = decade(last.max(first + 1.0));
        Self { label: label.to_owned(), min: decade(first), max, tick: 1.0, log: true }
    }

    /// A linear axis around these values, with ticks at round numbers; without finite values from 0 to 1.
    pub fn around(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let ends = finite.fold(None, |ends: Option<(f64, f64)>, value| match ends {
            None => Some((value, value)),
            Some((low, high)) => Some((low.min(value), high.max(value))),
        });
        let (low, high) = ends.unwrap_or((0.0, 1.0));
        // A constant has room around it.
        let room = if high - low > 1e-9 * high.abs().max(low.abs()) {
            0.0
        } else {
            0.5 * high.abs().max(f64::MIN_POSITIVE.sqrt())
        };
        let (low, high) = (low - room, high + room);
        let tick = round_step((high - low) / 5.0);
        let half = 0.5 * tick;
        let (min, max) = ((low / half + 1e-6).floor() * half, (high / half - 1e-6).ceil() * half);
        Self { label: label.to_owned(), min, max, tick, log: false }
    }

    /// Whether a value lies between the ends, which [`Axis::around`] rounds a little.
    fn shows(&self, value: f64) -> bool {
        let slack = if self.log { 0.0 } else { 1e-6 * (self.max - self.min) };
        (self.min - slack..=self.max + slack).contains(&value)
    }

    /// Where a value lies, from 0 at the smallest value shown to 1 at the largest.
    fn fraction(&self, value: f64) -> f64 {
        let scale = |x: f64| if self.log { x.log10() } else { x };
        (scale(value) - scale(self.min)) / (scale(self.max) - scale(self.min))
    }
}

/// The smallest of 1, 2, 5, 10, ... times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let decade = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0]
        .map(|digit| digit * decade)
        .into_iter()
        .find(|round| *round >= 0.999 * step)
        .unwrap_or(10.0 * decade)
}

/// Stacks charts of the usual width, the legend of all of them on top, into one SVG canvas.
pub fn stack(charts: &[Chart], frame_height: impl Fn(&Chart) -> f64) -> Canvas {
    stack_to_width(charts, WIDTH, frame_height)
}

/// Stacks charts of this width, the legend of all of them on top, into one SVG canvas.
pub fn stack_to_width(charts: &[Chart], width: f64, frame_height: impl Fn(&Chart) -> f64) -> Canvas {
    let entries = legend_entries(charts);
    let notes: Vec<&String> = charts.iter().flat_map(|chart| &chart.notes).collect();
    let rows = entries.len().div_ceil(legend_columns(width)) + notes.len();
    let mut y = 6.0 + LEGEND_ROW * rows as f64;
    let heights: Vec<f64> = charts.iter().map(|c| frame_height(c) + MARGIN_TOP + c.margin_bottom()).collect();
    let mut canvas = Canvas::new(width, y + heights.iter().sum::<f64>());
    draw_legend(&mut canvas, width, &entries, &notes);
    for (chart, height) in charts.iter().zip(heights) {
        canvas.embed(&chart.svg(width, height), 0.0, y);
        chart.draw_marks(&mut canvas, y + MARGIN_TOP, (width, frame_height(chart)));
        y += height;
    }
    canvas
}

/// Height of the frame that gives both axes of `chart` the same scale.
pub fn equal_aspect_height(chart: &Chart) -> f64 {
    let width = WIDTH - MARGIN_LEFT - MARGIN_RIGHT;
    width * (chart.y.max - chart.y.min) / (chart.x.max - chart.x.min)
}

impl Chart {
    /// The chart alone, of this size with its margins.
    pub fn svg(&self, width: f64, height: f64) -> String {
        let plots: Vec<Plot> = self.curves.iter().flat_map(|curve| self.plots(curve)).collect();
        let mut layout = Layout::new((self.x.min, self.x.max), (self.y.min, self.y.max))
            .with_width(width)
            .with_height(height)
            .with_force_margins(MARGIN_LEFT, MARGIN_RIGHT)
            .with_force_margins_y(MARGIN_TOP, self.margin_bottom())
            .with_x_axis_min(self.x.min)
            .with_x_axis_max(self.x.max)
            .with_y_axis_min(self.y.min)
            .with_y_axis_max(self.y.max)
            .with_x_label(&*self.x.label)
            .with_y_label(&*self.y.label)
            .with_font_family(FONT_FAMILY)
            .with_label_size(17)
            .with_tick_size(14)
            .with_show_grid(false)
            .with_box_axes()
            .with_tick_align("inside")
            .with_tick_pos("both")
            .with_x_tick_format(if few_decades(&self.x) { plain() } else { tick_format(&self.x) })
            .with_y_tick_format(tick_format(&self.y));
        layout = if self.x.log { layout.with_log_x() } else { layout.with_x_tick_step(self.x.tick) };
        layout = if self.y.log { layout.with_log_y() } else { layout.with_y_tick_step(self.y.tick) };
        SvgBackend::new().render_scene(&render_multiple(plots, layout))
    }

    /// Room for tick labels and, if there is one, the axis label.
    fn margin_bottom(&self) -> f64 {
        if self.x.label.is_empty() { 0.5 * MARGIN_BOTTOM } else { MARGIN_BOTTOM }
    }

    /// Where a point lies on a canvas of this height that has only this chart, with equal scales.
    pub fn point_in_stack(&self, canvas_height: f64, at: (f64, f64)) -> (f64, f64) {
        let frame_height = equal_aspect_height(self);
        self.point(canvas_height - self.margin_bottom() - frame_height, (WIDTH, frame_height), at)
    }

    /// A point in a frame of this height whose upper edge is at `top`, on a canvas of this width.
    fn point(&self, top: f64, (width, frame_height): (f64, f64), at: (f64, f64)) -> (f64, f64) {
        let frame_width = width - MARGIN_LEFT - MARGIN_RIGHT;
        let x = MARGIN_LEFT + frame_width * self.x.fraction(at.0);
        (x, top + frame_height * (1.0 - self.y.fraction(at.1)))
    }

    /// Draws the marks over a frame whose upper edge is at `top`, their labels where curves leave room.
    fn draw_marks(&self, canvas: &mut Canvas, top: f64, size: (f64, f64)) {
        let on_curves = self.curves.iter().flat_map(|curve| curve.pieces.iter().flatten());
        let taken = on_curves.map(|at| self.point(top, size, *at)).collect::<Vec<_>>();
        for Mark { at, label } in &self.marks {
            let dot = self.point(top, size, *at);
            canvas.circle(dot, 3.0, "black", Stroke { color: "black", width: 0.0, dashes: None });
            if label.is_empty() {
                continue;
            }
            let (x, y) = place_of_label(dot, &taken);
            canvas.text(x, y + 0.35 * MARK_SIZE, MARK_SIZE, "middle", label);
        }
    }

    fn plots(&self, curve: &Curve) -> Vec<Plot> {
        let style = curve.stroke.dashes.map_or(LineStyle::Solid, |d| LineStyle::Custom(d.to_owned()));
        let line = LinePlot::new()
            .with_color(curve.stroke.color)
            .with_stroke_width(curve.stroke.width)
            .with_line_style(style);
        self.inside(&curve.pieces).into_iter().map(|piece| line.clone().with_data(piece).into()).collect()
    }

    /// The parts of the pieces that lie within the axes.
    fn inside(&self, pieces: &[Vec<(f64, f64)>]) -> Vec<Vec<(f64, f64)>> {
        let visible = |&(x, y): &(f64, f64)| self.x.shows(x) && self.y.shows(y);
        let runs = pieces.iter().flat_map(|piece| piece.chunk_by(move |a, b| visible(a) && visible(b)));
        runs.filter(|run| run.len() > 1).map(<[_]>::to_vec).collect()
    }
}

/// Columns of the legend of a figure of this width.
fn legend_columns(width: f64) -> usize {
    if width < 0.9 * WIDTH { 1 } else { 2 }
}

/// Size of the labels of dots.
const MARK_SIZE: f64 = 15.0;

/// The centre of a dot's label, in one of sixteen directions: the nearest to the dot whose distance from all
/// `taken` points is enough, or the one with the largest.
fn place_of_label(dot: (f64, f64), taken: &[(f64, f64)]) -> (f64, f64) {
    const ENOUGH: f64 = 0.6 * MARK_SIZE;
    let mut best = (dot, 0.0);
    for distance in [0.8, 1.0, 1.2, 1.5] {
        for direction in 0..16 {
            let (sin, cos) = (std::f64::consts::PI * (0.25 + f64::from(direction) / 8.0)).sin_cos();
            let place = (dot.0 + distance * MARK_SIZE * cos, dot.1 + distance * MARK_SIZE * sin);
            let clear =
                taken.iter().map(|p| (p.0 - place.0).hypot(p.1 - place.1)).fold(f64::INFINITY, f64::min);
            if clear.min(ENOUGH) > best.1 {
                best = (place, clear.min(ENOUGH));
            }
        }
    }
    best.0
}

/// Label and stroke of every curve to be named, once each.
fn legend_entries(charts: &[Chart]) -> Vec<(&str, Stroke)> {
    let mut entries: Vec<(&str, Stroke)> = Vec::new();
    for curve in charts.iter().flat_map(|chart| &chart.curves) {
        if let Some(label) = &curve.label
            && !entries.iter().any(|(name, _)| *name == label)
        {
            entries.push((label, curve.stroke));
        }
    }
    entries
}

fn draw_legend(canvas: &mut Canvas, width: f64, entries: &[(&str, Stroke)], notes: &[&String]) {
    let columns = legend_columns(width);
    let column_width = (width - MARGIN_LEFT - MARGIN_RIGHT) / columns as f64;
    for (i, (label, stroke)) in entries.iter().enumerate() {
        let x = MARGIN_LEFT + column_width * (i % columns) as f64;
        let y = 6.0 + LEGEND_ROW * ((i / columns) as f64 + 0.5);
        canvas.line((x, y), (x + LEGEND_SAMPLE, y), *stroke);
        canvas.text(x + LEGEND_SAMPLE + 8.0, y + 5.0, 15.0, "start", label);
    }
    let rows = entries.len().div_ceil(columns);
    for (i, note) in notes.iter().enumerate() {
        let y = 6.0 + LEGEND_ROW * ((rows + i) as f64 + 0.5);
        canvas.text(MARGIN_LEFT, y + 5.0, 13.0, "start", note);
    }
}

/// `10^{n}` for whole powers, nothing for ticks between them.
fn power_of_ten(value: f64) -> String {
    let exponent = value.log10();
    if (exponent - exponent.round()).abs() > 1e-6 {
        return String::new();
    }
    format!("10^{{{}}}", format!("{exponent:.0}").replace("-0", "0").replace('-', "\u{2212}"))
}

/// Whether an axis is logarithmic and so short that its ticks between powers of ten have room for a number.
fn few_decades(axis: &Axis) -> bool {
    axis.log && axis.min > 0.9e-3 && axis.max < 1.1e3 && axis.max < 1.1e3 * axis.min
}

/// Ticks as decimals with as many digits as they have.
fn plain() -> TickFormat {
    TickFormat::Custom(Arc::new(|value| format!("{}", (value * 1e6).round() / 1e6)))
}

/// Ticks: decimals as the step needs on a linear axis, powers of ten on a logarithmic one.
fn tick_format(axis: &Axis) -> TickFormat {
    if axis.log {
        return TickFormat::Custom(Arc::new(power_of_ten));
    }
    let decimals = (0..6).find(|d| (axis.tick * 10f64.powi(*d)).fract().abs() < 1e-9).unwrap_or(6);
    TickFormat::Fixed(usize::try_from(decimals).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_around_values_end_at_round_numbers() {
        let ends = |values: &[f64]| {
            let axis = Axis::around("", values.iter().copied());
            (axis.min, axis.max, axis.tick)
        };
        assert_eq!(ends(&[0.0, 10.0]), (0.0, 10.0, 2.0));
        assert_eq!(ends(&[-3.0, 41.0, f64::NAN]), (-5.0, 45.0, 10.0));
        assert_eq!(ends(&[]), (0.0, 1.0, 0.2));
        let (min, max, _) = ends(&[2.0, 2.0]);
        assert!(min < 2.0 && max > 2.0, "a constant has room around it");
        let (min, max, tick) = ends(&[0.0]);
        assert!(min < 0.0 && max > 0.0 && tick > 0.0);
    }

    #[test]
    fn labels_keep_away_from_curves() {
        let distance = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).hypot(a.1 - b.1);
        // All but a sector to the left of the dot is full.
        let around = (0..360).map(|degree| f64::from(degree).to_radians());
        let full = around.filter(|angle| (angle - std::f64::consts::PI).abs() > 1.0);
        let ring = full.flat_map(|angle| [8.0, 14.0, 20.0].map(|r| (r * angle.cos(), r * angle.sin())));
        let taken: Vec<(f64, f64)> = ring.collect();
        let place = place_of_label((0.0, 0.0), &taken);
        assert!(place.0 < -10.0, "{place:?}");
        assert!(taken.iter().all(|&p| distance(p, place) > 8.0), "{place:?}");
        // With room everywhere it is close.
        assert!(distance(place_of_label((3.0, 4.0), &[]), (3.0, 4.0)) < MARK_SIZE);
    }
}
