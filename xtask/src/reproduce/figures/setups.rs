//! The initial set-ups as drawings: figures 4 and 8.

use gluey_pictures::{Canvas, Stroke};

const BLACK: Stroke = Stroke { color: "black", width: 1.4, dashes: None };
const FLOW: Stroke = Stroke { color: "#0b4f9e", width: 1.4, dashes: None };
const THIN: Stroke = Stroke { color: "#8c8c8c", width: 0.9, dashes: Some("4 3") };
const FILL: &str = "#dce6f2";

const WIDTH: f64 = 600.0;
const BOX_SIDE: f64 = 400.0;
const BOX_LEFT: f64 = 90.0;
const BOX_TOP: f64 = 40.0;
/// Radius of the particles, in units of the box.
const RADIUS: f64 = 0.05;

/// Figure 4 or 8: two or three particles in a shear flow.
pub fn particles(count: usize) -> Canvas {
    let centers = &[[0.451, 0.51], [0.549, 0.49], [0.7, 0.49]][..count];
    let mut canvas = Canvas::new(WIDTH, BOX_TOP + BOX_SIDE + 50.0);
    canvas.rectangle((BOX_LEFT, BOX_TOP), (BOX_SIDE, BOX_SIDE), BLACK);
    canvas.line(at(0.0, 0.5), at(1.0, 0.5), THIN);
    canvas.line(at(0.5, 0.0), at(0.5, 1.0), THIN);
    shear_profile(&mut canvas);
    walls(&mut canvas);
    for (i, &[x, y]) in centers.iter().enumerate() {
        canvas.circle(at(x, y), RADIUS * BOX_SIDE, FILL, BLACK);
        let (px, py) = at(x, y);
        canvas.text(px, py + 5.0, 16.0, "middle", &format!("{}", i + 1));
    }
    if let Some(&[x, y]) = centers.last() {
        radius(&mut canvas, x, y);
    }
    coordinates(&mut canvas);
    canvas
}

/// A point of the unit box on the canvas.
fn at(x: f64, y: f64) -> (f64, f64) {
    (BOX_LEFT + x * BOX_SIDE, BOX_TOP + (1.0 - y) * BOX_SIDE)
}

/// Arrows of the undisturbed velocity along a vertical line.
fn shear_profile(canvas: &mut Canvas) {
    let (foot, scale) = (0.17, 0.25);
    canvas.line(at(foot, 0.0), at(foot, 1.0), Stroke { width: 0.9, dashes: None, ..FLOW });
    for y in [0.05, 0.2, 0.35, 0.65, 0.8, 0.95] {
        canvas.arrow(at(foot, y), at(foot + scale * (y - 0.5), y), FLOW);
    }
}

/// The moving walls and the boundary velocity.
fn walls(canvas: &mut Canvas) {
    let above = |(x, y): (f64, f64)| (x, y - 14.0);
    let below = |(x, y): (f64, f64)| (x, y + 14.0);
    canvas.arrow(above(at(0.38, 1.0)), above(at(0.62, 1.0)), FLOW);
    canvas.arrow(below(at(0.62, 0.0)), below(at(0.38, 0.0)), FLOW);
    let (x, y) = at(1.0, 0.93);
    canvas.text(x + 10.0, y, 16.0, "start", "*u* = *y* − 1/2");
    let (x, y) = at(0.63, 1.0);
    canvas.text(x, y - 9.0, 16.0, "start", "+1/2");
    let (x, y) = at(0.37, 0.0);
    canvas.text(x, y + 19.0, 16.0, "end", "−1/2");
}

/// The axes in the lower left corner and the size of a particle.
fn coordinates(canvas: &mut Canvas) {
    let origin = (BOX_LEFT - 46.0, BOX_TOP + BOX_SIDE + 18.0);
    canvas.arrow(origin, (origin.0 + 44.0, origin.1), BLACK);
    canvas.arrow(origin, (origin.0, origin.1 - 44.0), BLACK);
    canvas.text(origin.0 + 50.0, origin.1 + 5.0, 16.0, "start", "*x*");
    canvas.text(origin.0 - 4.0, origin.1 - 50.0, 16.0, "start", "*y*");
}

/// Measures the radius beside the particle at `(x, y)`.
fn radius(canvas: &mut Canvas, x: f64, y: f64) {
    let side = x + RADIUS + 0.035;
    let thin = Stroke { color: "black", width: 0.8, dashes: None };
    for level in [y, y - RADIUS] {
        canvas.line(at(if level == y { x + 0.02 } else { x }, level), at(side + 0.015, level), thin);
    }
    canvas.arrow(at(side, y - 0.5 * RADIUS), at(side, y), thin);
    canvas.arrow(at(side, y - 0.5 * RADIUS), at(side, y - RADIUS), thin);
    let (label_x, label_y) = at(side + 0.025, y - 0.5 * RADIUS);
    canvas.text(label_x, label_y + 5.0, 16.0, "start", "*a*");
}
