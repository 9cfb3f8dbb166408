//! One chart: styled curves over linear or logarithmic axes, drawn by kuva, with its legend above the frame.

use kuva::backend::svg::SvgBackend;
use kuva::plot::LinePlot;
use kuva::plot::line::LineStyle;
use kuva::render::layout::Layout;
use kuva::render::plots::Plot;
use kuva::render::render::render_multiple;

use crate::axis::{Axis, TICK_SIZE, scaled, tenth};
use crate::canvas::{Canvas, FONT_FAMILY};
use crate::curve::{Curve, Stroke};
use crate::legend::Legend;
use crate::text;

/// Width of a figure, in SVG pixels.
pub const WIDTH: f64 = 600.0;
const MARGIN_LEFT: f64 = 66.0;
const MARGIN_RIGHT: f64 = 18.0;
const MARGIN_BOTTOM: f64 = 48.0;
const MARGIN_TOP: f64 = 8.0;
/// Beside the labels of ticks at an upright axis: room to the frame, and for the label of the axis.
const BESIDE_LABELS: f64 = 40.0;
const LABEL_SIZE: f64 = 17.0;
/// Height and width of a power of ten set apart.
const POWER_ROW: f64 = 17.0;
const POWER_WIDTH: f64 = 52.0;
/// Over all.
const GAP: f64 = 6.0;
/// Radius of points without neighbours.
const POINT: f64 = 2.0;

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

/// Stacks charts of the usual width into one SVG canvas, each under its legend, or all under one that
/// they share.
pub fn stack(charts: &[Chart], frame_height: impl Fn(&Chart) -> f64) -> Canvas {
    stack_to_width(charts, WIDTH, |chart, _| frame_height(chart))
}

/// Stacks charts of this width, whose frames are as high as is said for their width.
pub fn stack_to_width(charts: &[Chart], width: f64, frame_height: impl Fn(&Chart, f64) -> f64) -> Canvas {
    let sides = Sides::around(charts);
    let frame_width = sides.frame_width(width);
    let of_all = Legend::shared(&charts.iter().map(|chart| &chart.curves[..]).collect::<Vec<_>>());
    let legends: Vec<Legend<'_>> =
        charts.iter().map(|chart| Legend::of(&chart.curves, &chart.notes, &of_all.entries)).collect();
    let frame = |chart: &Chart| {
        let height = frame_height(chart, frame_width);
        chart.margin_top() + height + chart.margin_bottom(frame_width)
    };
    let height = |(chart, legend): (&Chart, &Legend<'_>)| legend.height(frame_width) + frame(chart);
    let heights = charts.iter().zip(&legends).map(height).sum::<f64>();
    let mut y = GAP + of_all.height(frame_width);
    let mut canvas = Canvas::new(width, y + heights);
    of_all.draw(&mut canvas, sides.left, GAP, frame_width);
    for (chart, legend) in charts.iter().zip(&legends) {
        legend.draw(&mut canvas, sides.left, y, frame_width);
        y += legend.height(frame_width);
        canvas.embed(&chart.svg_between(&sides, width, frame(chart)), 0.0, y);
        let size = (frame_width, frame_height(chart, frame_width));
        chart.draw_points(&mut canvas, (sides.left, y + chart.margin_top()), size);
        y += frame(chart);
    }
    canvas
}

/// Height of the frame that gives both axes of a chart the same scale, alone on a canvas of the usual width.
pub fn equal_aspect_height(chart: &Chart) -> f64 {
    chart.equal_aspect(Sides::around(std::slice::from_ref(chart)).frame_width(WIDTH))
}

/// Room beside frames, for the labels at their sides.
struct Sides {
    left: f64,
    right: f64,
}

impl Sides {
    /// The same for charts that stand one over the other.
    fn around(charts: &[Chart]) -> Self {
        let mut sides = Self { left: MARGIN_LEFT, right: MARGIN_RIGHT };
        for chart in charts {
            let widest = |axis: &Axis| match axis.set_apart() {
                Some((_, shown)) => shown.widest_label(),
                None => axis.widest_label(),
            };
            sides.left = sides.left.max(widest(&chart.y) + BESIDE_LABELS);
            sides.right = sides.right.max(0.5 * widest(&chart.x) + 4.0);
        }
        sides
    }

    fn frame_width(&self, width: f64) -> f64 {
        width - self.left - self.right
    }
}

impl Chart {
    /// The chart alone, of this size with its margins.
    pub fn svg(&self, width: f64, height: f64) -> String {
        self.svg_between(&Sides::around(std::slice::from_ref(self)), width, height)
    }

    /// The chart of this size with this room beside its frame.
    fn svg_between(&self, sides: &Sides, width: f64, height: f64) -> String {
        let (frame_width, bottom) = (sides.frame_width(width), self.margin_bottom(sides.frame_width(width)));
        let frame_height = height - self.margin_top() - bottom;
        let apart = [&self.x, &self.y].map(Axis::set_apart);
        let powers = apart.each_ref().map(|apart| apart.as_ref().map(|(power, _)| *power));
        let [x, y] = apart.map(|apart| apart.map(|(_, axis)| axis));
        let x = x.unwrap_or_else(|| self.x.clone()).with_room(frame_width, false);
        let y = y.unwrap_or_else(|| self.y.clone()).with_room(frame_height, true);
        let mut plots: Vec<Plot> = self.curves.iter().flat_map(|curve| self.plots(curve, powers)).collect();
        if plots.is_empty() {
            // Without a plot kuva draws no frame.
            plots.push(LinePlot::new().into());
        }
        let mut layout = Layout::new((x.min, x.max), (y.min, y.max))
            .with_width(width)
            .with_height(height)
            .with_force_margins(sides.left, sides.right)
            .with_force_margins_y(self.margin_top(), bottom)
            .with_x_axis_min(x.min)
            .with_x_axis_max(x.max)
            .with_y_axis_min(y.min)
            .with_y_axis_max(y.max)
            .with_x_label(&*x.label)
            .with_y_label(&*y.label)
            .with_font_family(FONT_FAMILY)
            .with_label_size(LABEL_SIZE as u32)
            .with_tick_size(TICK_SIZE as u32)
            .with_show_grid(false)
            .with_box_axes()
            .with_tick_align("inside")
            .with_tick_pos("both")
            .with_x_tick_format(x.tick_format(false))
            .with_y_tick_format(y.tick_format(true));
        layout = if x.log { layout.with_log_x() } else { layout.with_x_tick_step(x.tick) };
        layout = if y.log { layout.with_log_y() } else { layout.with_y_tick_step(y.tick) };
        let svg = SvgBackend::new().render_scene(&render_multiple(plots, layout));
        let under = height - if self.is_crowded_below(frame_width) { LABEL_SIZE + 5.0 } else { 9.0 };
        let places = [(width - sides.right, under, "end"), (sides.left, self.margin_top() - 5.0, "start")];
        let texts: String = powers
            .iter()
            .zip(places)
            .filter_map(|(power, (x, y, anchor))| power_text((*power)?, x, y, anchor))
            .collect();
        svg.replacen("</svg>", &format!("{texts}</svg>"), 1)
    }

    /// Room over the frame, also for a power of ten.
    fn margin_top(&self) -> f64 {
        if self.y.set_apart().is_some() { MARGIN_TOP + POWER_ROW } else { MARGIN_TOP }
    }

    /// Room for tick labels and, if there is one, the axis label, and a power of ten beside it or above.
    fn margin_bottom(&self, frame_width: f64) -> f64 {
        match (self.x.label.is_empty(), self.x.set_apart().is_some()) {
            (true, false) => 0.5 * MARGIN_BOTTOM,
            _ if self.is_crowded_below(frame_width) => MARGIN_BOTTOM + POWER_ROW,
            _ => MARGIN_BOTTOM,
        }
    }

    /// Whether the axis label leaves no room for a power of ten beside it.
    fn is_crowded_below(&self, frame_width: f64) -> bool {
        let half = 0.5 * text::width(&self.x.label, LABEL_SIZE);
        self.x.set_apart().is_some() && half + POWER_WIDTH > 0.5 * frame_width
    }

    /// Height of a frame of this width in which both axes have the same scale.
    pub fn equal_aspect(&self, frame_width: f64) -> f64 {
        frame_width * (self.y.max - self.y.min) / (self.x.max - self.x.min)
    }

    /// Where a point lies on a canvas of this height that has only this chart, with equal scales.
    pub fn point_in_stack(&self, canvas_height: f64, at: (f64, f64)) -> (f64, f64) {
        let sides = Sides::around(std::slice::from_ref(self));
        let size = (sides.frame_width(WIDTH), equal_aspect_height(self));
        let top = canvas_height - self.margin_bottom(size.0) - size.1;
        self.point((sides.left, top), size, at)
    }

    /// A point in a frame with this upper left corner and size.
    fn point(&self, corner: (f64, f64), size: (f64, f64), at: (f64, f64)) -> (f64, f64) {
        let x = corner.0 + size.0 * self.x.fraction(at.0);
        (x, corner.1 + size.1 * (1.0 - self.y.fraction(at.1)))
    }

    /// Draws the marks over a frame, their labels where curves leave room, and points of curves that have no
    /// neighbour to be joined with.
    fn draw_points(&self, canvas: &mut Canvas, corner: (f64, f64), size: (f64, f64)) {
        for Curve { stroke, pieces, .. } in &self.curves {
            for at in pieces.iter().filter(|piece| piece.len() == 1).map(|piece| piece[0]) {
                if self.x.shows(at.0) && self.y.shows(at.1) {
                    let radius = POINT.max(1.2 * stroke.width);
                    canvas.circle(
                        self.point(corner, size, at),
                        radius,
                        stroke.color,
                        Stroke { width: 0.0, ..*stroke },
                    );
                }
            }
        }
        let on_curves = self.curves.iter().flat_map(|curve| curve.pieces.iter().flatten());
        let taken = on_curves.map(|at| self.point(corner, size, *at)).collect::<Vec<_>>();
        for Mark { at, label } in &self.marks {
            let dot = self.point(corner, size, *at);
            canvas.circle(dot, 3.0, "black", Stroke { color: "black", width: 0.0, dashes: None });
            if label.is_empty() {
                continue;
            }
            let (x, y) = place_of_label(dot, &taken);
            canvas.text(x, y + 0.35 * MARK_SIZE, MARK_SIZE, "middle", label);
        }
    }

    /// The lines of a curve over powers of ten.
    fn plots(&self, curve: &Curve, [x, y]: [Option<i32>; 2]) -> Vec<Plot> {
        let style = curve.stroke.dashes.map_or(LineStyle::Solid, |d| LineStyle::Custom(d.to_owned()));
        let line = LinePlot::new()
            .with_color(curve.stroke.color)
            .with_stroke_width(curve.stroke.width)
            .with_line_style(style);
        let over = |value: f64, power: Option<i32>| power.map_or(value, |power| scaled(value, power));
        let shown = |piece: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
            piece.into_iter().map(|at| (over(at.0, x), over(at.1, y))).collect()
        };
        self.inside(&curve.pieces)
            .into_iter()
            .map(|piece| line.clone().with_data(shown(piece)).into())
            .collect()
    }

    /// The parts of the pieces that lie within the axes.
    fn inside(&self, pieces: &[Vec<(f64, f64)>]) -> Vec<Vec<(f64, f64)>> {
        let visible = |&(x, y): &(f64, f64)| self.x.shows(x) && self.y.shows(y);
        let runs = pieces.iter().flat_map(|piece| piece.chunk_by(move |a, b| visible(a) && visible(b)));
        runs.filter(|run| run.len() > 1).map(<[_]>::to_vec).collect()
    }
}

/// A power of ten at the end of an axis.
fn power_text(power: i32, x: f64, y: f64, anchor: &str) -> Option<String> {
    let label = format!("\u{d7} {}", tenth(power));
    Some(format!(
        r#"<text x="{x:.2}" y="{y:.2}" font-size="{TICK_SIZE}" text-anchor="{anchor}" fill="black">{label}</text>"#
    ))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_alone_have_a_frame_with_ticks() {
        let stroke = Stroke { color: "black", width: 1.0, dashes: None };
        let curve = Curve { label: None, stroke, pieces: vec![vec![(0.2, 0.3)], vec![(0.7, 0.9)]] };
        let axis = || Axis::around("", [0.0, 1.0]);
        let chart = Chart { x: axis(), y: axis(), curves: vec![curve], notes: Vec::new(), marks: Vec::new() };
        assert!(chart.svg(400.0, 300.0).contains(">0.4<"));
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
