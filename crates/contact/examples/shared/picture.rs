//! Discs and their contacts as SVG: a line for each contact, as wide as its force (red pushes, blue pulls).

use std::fmt::Write;

use gluey_contact::{Contact, Domain};
use gluey_geom::Vector;

/// Pixels a unit of length.
const SCALE: f64 = 14.0;
/// Room for the axes, in units of length.
const MARGIN: f64 = 5.0;
/// Width of the line of the largest force, and the least width, in units of length.
const WIDTHS: (f64, f64) = (0.7, 0.04);
/// Units of length between two ticks of the axes.
const TICK: usize = 10;

/// Draws the discs; those with a period in x, from `x = 0` on.
pub fn draw(contacts: &[Contact], positions: &[Vector<2>], radii: &[f64], domain: &Domain<2>) -> String {
    let top_of = |d: usize| positions.iter().zip(radii).map(move |(x, a)| x[d] + a).fold(0.0, f64::max);
    let period = domain.lattice.periods()[0];
    let size = [period.unwrap_or_else(|| top_of(0)), top_of(1)];
    let mut svg = frame(size);

    // What crosses a periodic border is drawn on both sides of it.
    let copies = |x: &Vector<2>| -> Vec<Vector<2>> {
        let Some(period) = period else { return vec![*x] };
        let copy = |side: f64| Vector::<2>::new(x.x - period * ((x.x / period).floor() + side), x.y);
        [-1.0, 0.0, 1.0].map(copy).to_vec()
    };
    for (x, radius) in positions.iter().zip(radii) {
        for at in copies(x) {
            let (x, y) = (at.x, at.y);
            _ = writeln!(svg, "<circle class=\"disc\" cx=\"{x:.4}\" cy=\"{y:.4}\" r=\"{radius:.4}\"/>");
        }
    }
    let largest = contacts.iter().map(|contact| contact.lambda.abs()).fold(f64::MIN_POSITIVE, f64::max);
    for Contact { pair, lambda, .. } in contacts {
        let Some(branch) = pair.branch(positions, domain) else { continue };
        let width = (WIDTHS.0 * lambda.abs() / largest).max(WIDTHS.1);
        let color = if *lambda < 0.0 { "#1f5fbf" } else { "#c0271d" };
        for at in copies(&positions[pair.first as usize]) {
            let end = at + branch;
            _ = writeln!(
                svg,
                "<line x1=\"{:.3}\" y1=\"{:.3}\" x2=\"{:.3}\" y2=\"{:.3}\" stroke=\"{color}\" stroke-width=\"{width:.3}\"/>",
                at.x, at.y, end.x, end.y
            );
        }
    }
    svg + "</g>\n</svg>\n"
}

/// The picture with its axes, in radii, open for what is inside. Units are those of length, y upwards.
fn frame([right, top]: [f64; 2]) -> String {
    let (width, height) = (right + 2.0 * MARGIN, top + 2.0 * MARGIN);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{} {} {width} {height}\" width=\"{:.0}\" height=\"{:.0}\" \
         font-family=\"Liberation Sans, Arial, sans-serif\" font-size=\"1.5\" text-anchor=\"middle\">\n\
         <style>.disc {{ fill: #e8ebef; stroke: #8a93a0; stroke-width: 0.05 }}</style>\n\
         <rect x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n",
        -MARGIN,
        -top - MARGIN,
        width * SCALE,
        height * SCALE,
        -MARGIN,
        -top - MARGIN
    );
    for x in (0..=right as usize).step_by(TICK) {
        _ = writeln!(svg, "<path d=\"M{x} 0.2v0.6\" stroke=\"black\" stroke-width=\"0.08\"/>");
        _ = writeln!(svg, "<text x=\"{x}\" y=\"2.4\">{x}</text>");
    }
    for y in (0..=top as usize).step_by(TICK) {
        _ = writeln!(svg, "<path d=\"M-0.2 -{y}h-0.6\" stroke=\"black\" stroke-width=\"0.08\"/>");
        _ = writeln!(svg, "<text x=\"-1.2\" y=\"-{y}\" dy=\"0.5\" text-anchor=\"end\">{y}</text>");
    }
    _ = writeln!(svg, "<text x=\"{}\" y=\"4.2\">x / a</text>", 0.5 * right);
    _ = writeln!(svg, "<text transform=\"translate(-3.8 {}) rotate(-90)\">y / a</text>", -0.5 * top);
    _ = writeln!(
        svg,
        "<rect y=\"{}\" width=\"{right}\" height=\"{top}\" fill=\"none\" stroke=\"black\" stroke-width=\"0.1\"/>",
        -top
    );
    _ = writeln!(svg, "<clipPath id=\"inside\"><rect width=\"{right}\" height=\"{top}\"/></clipPath>");
    svg + "<g transform=\"scale(1 -1)\" clip-path=\"url(#inside)\">\n"
}
