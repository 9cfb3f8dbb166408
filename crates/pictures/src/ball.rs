//! Balls with light on them, and the scale of their colours as a bar.

use crate::canvas::Canvas;
use crate::color::{Rgb, color_scale, hex, shaded};

/// A disc or a sphere as it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its middle in SVG pixels.
    pub center: (f64, f64),
    /// In SVG pixels.
    pub radius: f64,
    /// Its colour.
    pub color: Rgb,
    /// Whether light from above makes it a sphere; else it is a disc.
    pub is_sphere: bool,
    /// From 0, invisible, to 1.
    pub opacity: f64,
}

impl Canvas {
    /// A ball over all that was drawn before.
    pub fn ball(&mut self, ball: &Ball) {
        let Ball { center: (x, y), radius, color, is_sphere, opacity } = *ball;
        let fill = if is_sphere { format!("url(#{})", self.gradient(color)) } else { hex(color) };
        let edge = hex(shaded(color, 0.5));
        self.element(format_args!(
            r#"<circle cx="{x:.2}" cy="{y:.2}" r="{radius:.2}" fill="{fill}" stroke="{edge}" stroke-width="0.8" opacity="{opacity}"/>"#
        ));
    }

    /// The scale of colours as a bar from left to right.
    pub fn color_bar(&mut self, corner: (f64, f64), size: (f64, f64)) {
        let steps = 64;
        let width = size.0 / f64::from(steps);
        for step in 0..steps {
            let color = hex(color_scale((f64::from(step) + 0.5) / f64::from(steps)));
            // Half a pixel more, so that no line is seen between neighbours.
            let (x, more) = (corner.0 + width * f64::from(step), if step + 1 < steps { 0.5 } else { 0.0 });
            self.element(format_args!(
                r#"<rect x="{x:.2}" y="{:.2}" width="{:.2}" height="{:.2}" fill="{color}"/>"#,
                corner.1,
                width + more,
                size.1
            ));
        }
    }

    /// The name of the light on spheres of a colour, which is defined once.
    fn gradient(&mut self, color: Rgb) -> String {
        let name = format!("ball-{}", &hex(color)[1..]);
        let [light, plain, dark] = [1.65, 1.0, 0.42].map(|light| hex(shaded(color, light)));
        self.define(&name, format_args!(
            r#"<radialGradient id="{name}" cx="0.5" cy="0.5" r="0.5" fx="0.33" fy="0.3"><stop offset="0.05" stop-color="{light}"/><stop offset="0.45" stop-color="{plain}"/><stop offset="1" stop-color="{dark}"/></radialGradient>"#
        ));
        name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_light_on_spheres_of_a_colour_is_defined_once() {
        let mut canvas = Canvas::new(100.0, 100.0);
        let ball =
            Ball { center: (50.0, 50.0), radius: 20.0, color: [65, 68, 135], is_sphere: true, opacity: 1.0 };
        canvas.ball(&ball);
        canvas.ball(&Ball { radius: 5.0, ..ball });
        canvas.ball(&Ball { is_sphere: false, ..ball });
        let svg = canvas.inline_svg();
        assert_eq!(svg.matches("<radialGradient id=\"ball-414487\"").count(), 1);
        assert_eq!(svg.matches("fill=\"url(#ball-414487)\"").count(), 2);
        assert!(canvas.png().is_ok());
    }
}
