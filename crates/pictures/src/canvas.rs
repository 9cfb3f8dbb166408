//! A drawing surface for what kuva does not draw: legends, set-ups, stacked panels. Plain SVG, one element a
//! call.

use std::collections::BTreeSet;
use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg;

use crate::color::{Rgb, hex};
use crate::curve::Stroke;
use crate::raster::{Placed, Raster};
use crate::text;

/// The bundled font first, then fonts of similar width.
pub const FONT_FAMILY: &str = "Libertinus Serif, Linux Libertine, Times New Roman, serif";
const REGULAR: &[u8] = include_bytes!("../assets/LibertinusSerif-Regular.otf");
const ITALIC: &[u8] = include_bytes!("../assets/LibertinusSerif-Italic.otf");
/// PNG pixels per SVG pixel: 600 SVG pixels are 1800 PNG pixels, 300 dpi at 152 mm.
const PNG_ZOOM: f32 = 3.0;
/// SVG pixels per millimetre on paper: labels of 15 pixels are 3 mm high.
pub const PIXELS_PER_MM: f64 = 5.0;

/// An SVG drawing under construction; lengths in SVG pixels, y downwards.
pub struct Canvas {
    width: f64,
    height: f64,
    body: String,
    /// Pixels under the body, and the elements that hold them in a document.
    rasters: Vec<Placed>,
    images: String,
    /// Names of what the body defines once and uses often.
    defined: BTreeSet<String>,
}

/// A reason why a drawing could not become a PNG.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// The SVG is not readable.
    #[error("the SVG cannot be read back: {0}")]
    Svg(#[from] usvg::Error),
    /// The picture has no area or is too large.
    #[error("no picture of {0} x {1} pixels can be made")]
    Size(u32, u32),
    /// The encoder failed.
    #[error("PNG encoding failed: {0}")]
    Encoding(String),
}

impl Canvas {
    /// An empty white canvas.
    pub fn new(width: f64, height: f64) -> Self {
        let (body, images) = (String::new(), String::new());
        Self { width, height, body, rasters: Vec::new(), images, defined: BTreeSet::new() }
    }

    /// Width in SVG pixels.
    pub(crate) fn width(&self) -> f64 {
        self.width
    }

    /// Height in SVG pixels.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// A straight line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), stroke: Stroke) {
        let dashes = stroke.dashes.map(|d| format!(r#" stroke-dasharray="{d}""#)).unwrap_or_default();
        self.element(format_args!(
            r#"<line x1="{:.2}" y1="{:.2}" x2="{:.2}" y2="{:.2}" stroke="{}" stroke-width="{}"{dashes}/>"#,
            from.0, from.1, to.0, to.1, stroke.color, stroke.width
        ));
    }

    /// A straight arrow, its head at `to`.
    pub fn arrow(&mut self, from: (f64, f64), to: (f64, f64), stroke: Stroke) {
        self.line(from, to, stroke);
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy).max(f64::MIN_POSITIVE);
        let (ex, ey) = (dx / length, dy / length);
        let head = |side: f64| (to.0 - 8.0 * ex - side * 3.5 * ey, to.1 - 8.0 * ey + side * 3.5 * ex);
        let ((ax, ay), (bx, by)) = (head(1.0), head(-1.0));
        self.element(format_args!(
            r#"<path d="M{:.2} {:.2}L{ax:.2} {ay:.2}L{bx:.2} {by:.2}Z" fill="{}"/>"#,
            to.0, to.1, stroke.color
        ));
    }

    /// A closed polygon without filling.
    pub fn polygon(&mut self, corners: &[(f64, f64)], stroke: Stroke) {
        let points = points(corners);
        self.element(format_args!(
            r#"<polygon points="{points}" fill="none" stroke="{}" stroke-width="{}" stroke-linejoin="round"/>"#,
            stroke.color, stroke.width
        ));
    }

    /// What `draw` draws, as far as it lies in a polygon.
    pub fn clipped(&mut self, corners: &[(f64, f64)], draw: impl FnOnce(&mut Self)) {
        let name = format!("clip-{}", self.body.len());
        let points = points(corners);
        self.element(format_args!(r#"<clipPath id="{name}"><polygon points="{points}"/></clipPath>"#));
        self.element(format_args!(r#"<g clip-path="url(#{name})">"#));
        draw(self);
        self.element(format_args!("</g>"));
    }

    /// Slender arrows of one colour, light on dark and dark on light by a border of another one; heads are a
    /// third of an arrow, at most `head` long.
    pub fn arrows(&mut self, arrows: &[[(f64, f64); 2]], color: Rgb, border: Rgb, head: f64) {
        let mut path = String::new();
        for [(x, y), (end_x, end_y)] in arrows {
            let (dx, dy) = (end_x - x, end_y - y);
            let length = dx.hypot(dy).max(f64::MIN_POSITIVE);
            let (back, half) = ((length / 3.0).min(head), 0.4 * (length / 3.0).min(head));
            let (ex, ey) = (dx / length, dy / length);
            let barb =
                |side: f64| (end_x - back * ex - side * half * ey, end_y - back * ey + side * half * ex);
            let ((ax, ay), (bx, by)) = (barb(1.0), barb(-1.0));
            // Writing to a string cannot fail.
            let _ = write!(
                path,
                "M{x:.1} {y:.1}L{end_x:.1} {end_y:.1}M{ax:.1} {ay:.1}L{end_x:.1} {end_y:.1}L{bx:.1} {by:.1}"
            );
        }
        for (color, width) in [(border, 2.6), (color, 1.1)] {
            self.element(format_args!(
                r#"<path d="{path}" fill="none" stroke="{}" stroke-width="{width}" stroke-linecap="round"/>"#,
                hex(color)
            ));
        }
    }

    /// A raster that fills a rectangle, under everything else on this canvas.
    ///
    /// # Errors
    /// If it has no pixels.
    pub fn raster(&mut self, corner: (f64, f64), size: (f64, f64), raster: &Raster) -> Result<(), PngError> {
        let (width, height) = raster.size();
        let placed = Placed::new(corner, size, raster).ok_or(PngError::Size(width, height))?;
        self.images.push_str(&placed.element().map_err(PngError::Encoding)?);
        self.images.push('\n');
        self.rasters.push(placed);
        Ok(())
    }

    /// A circle, filled or only outlined.
    pub fn circle(&mut self, center: (f64, f64), radius: f64, fill: &str, stroke: Stroke) {
        self.element(format_args!(
            r#"<circle cx="{:.2}" cy="{:.2}" r="{radius:.2}" fill="{fill}" stroke="{}" stroke-width="{}"/>"#,
            center.0, center.1, stroke.color, stroke.width
        ));
    }

    /// An axis-parallel rectangle without filling.
    pub fn rectangle(&mut self, corner: (f64, f64), size: (f64, f64), stroke: Stroke) {
        self.element(format_args!(
            r#"<rect x="{:.2}" y="{:.2}" width="{:.2}" height="{:.2}" fill="none" stroke="{}" stroke-width="{}"/>"#,
            corner.0, corner.1, size.0, size.1, stroke.color, stroke.width
        ));
    }

    /// A label with the markup of the [crate]; `anchor` is `start`, `middle` or `end`.
    pub fn text(&mut self, x: f64, y: f64, size: f64, anchor: &str, label: &str) {
        let escaped = label.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        self.element(format_args!(
            r#"<text x="{x:.2}" y="{y:.2}" font-size="{size}" text-anchor="{anchor}" fill="black">{escaped}</text>"#
        ));
    }

    /// Another SVG document, its upper left corner at `(x, y)`.
    pub fn embed(&mut self, svg: &str, x: f64, y: f64) {
        let body = svg.find("<svg").map_or(svg, |start| &svg[start..]);
        let body = body.replacen("<svg", &format!(r#"<svg x="{x:.2}" y="{y:.2}""#), 1);
        self.element(format_args!("{body}"));
    }

    /// The drawing as an SVG document without its fonts (for a page that brings them).
    pub fn inline_svg(&self) -> String {
        self.document("", &self.background())
    }

    /// The drawing as an SVG document that carries its fonts.
    pub fn svg(&self) -> String {
        self.document(&format!("<style>{}</style>", font_faces()), &self.background())
    }

    /// The same document with its size in millimetres, for print.
    pub fn svg_for_print(&self) -> String {
        let (w, h) = (self.width, self.height);
        let pixels = format!("width=\"{w:.0}\" height=\"{h:.0}\"");
        let millimetres =
            format!("width=\"{:.1}mm\" height=\"{:.1}mm\"", w / PIXELS_PER_MM, h / PIXELS_PER_MM);
        self.svg().replacen(&pixels, &millimetres, 1)
    }

    /// The drawing as a PNG picture, drawn with the bundled fonts only.
    pub fn png(&self) -> Result<Vec<u8>, PngError> {
        let picture = self.pixels(PNG_ZOOM)?;
        picture.encode_png().map_err(|error| PngError::Encoding(error.to_string()))
    }

    /// The drawing with so many pixels per SVG pixel, on white.
    pub(crate) fn pixels(&self, zoom: f32) -> Result<Pixmap, PngError> {
        let mut options = usvg::Options { font_family: "Libertinus Serif".to_owned(), ..Default::default() };
        options.fontdb_mut().load_font_data(REGULAR.to_vec());
        options.fontdb_mut().load_font_data(ITALIC.to_vec());
        let tree = usvg::Tree::from_str(&self.document("", ""), &options)?;
        let size = tree.size().to_int_size().scale_by(zoom).ok_or(PngError::Size(0, 0))?;
        let mut pixels =
            Pixmap::new(size.width(), size.height()).ok_or(PngError::Size(size.width(), size.height()))?;
        pixels.fill(Color::WHITE);
        self.rasters.iter().for_each(|raster| raster.draw(&mut pixels, zoom));
        resvg::render(&tree, Transform::from_scale(zoom, zoom), &mut pixels.as_mut());
        Ok(pixels)
    }

    /// White, and pixels on it.
    fn background(&self) -> String {
        format!("<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{}", self.images)
    }

    fn document(&self, style: &str, background: &str) -> String {
        let (w, h) = (self.width, self.height);
        text::typeset(&format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w:.0}\" height=\"{h:.0}\" viewBox=\"0 0 {w:.0} {h:.0}\" \
             font-family=\"{FONT_FAMILY}\">{style}\n{background}{}</svg>\n",
            self.body
        ))
    }

    /// Writes an element that others refer to by its name, the first time that it is asked for.
    pub(crate) fn define(&mut self, name: &str, element: std::fmt::Arguments<'_>) {
        if self.defined.insert(name.to_owned()) {
            self.element(element);
        }
    }

    /// An element of SVG over all others.
    pub(crate) fn element(&mut self, element: std::fmt::Arguments<'_>) {
        writeln!(self.body, "{element}").expect("writing to a String cannot fail");
    }
}

/// Points as SVG lists them.
fn points(corners: &[(f64, f64)]) -> String {
    corners.iter().map(|(x, y)| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ")
}

/// CSS that brings the two bundled fonts.
pub fn font_faces() -> String {
    let face = |style: &str, data: &[u8]| {
        format!(
            "@font-face{{font-family:'Libertinus Serif';font-style:{style};\
             src:url(data:font/otf;base64,{}) format('opentype');}}",
            STANDARD.encode(data)
        )
    };
    face("normal", REGULAR) + &face("italic", ITALIC)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn print_has_millimetres_where_the_screen_has_pixels() {
        let canvas = Canvas::new(425.0, 300.0);
        let print = canvas.svg_for_print();
        assert!(
            print.contains("width=\"85.0mm\" height=\"60.0mm\" viewBox=\"0 0 425 300\""),
            "{}",
            &print[..200]
        );
        assert!(canvas.svg().contains("width=\"425\" height=\"300\" viewBox"));
    }

    #[test]
    fn pngs_have_three_pixels_for_one() {
        let png = Canvas::new(425.0, 300.0).png().expect("a picture");
        // Behind the signature and the name of the block: width and height, four bytes each.
        let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes"));
        assert_eq!((number(16), number(20)), (1275, 900));
    }
}
