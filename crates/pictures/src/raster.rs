//! Pictures of pixels in a drawing, under all of its lines.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use resvg::tiny_skia::{ColorU8, FilterQuality, Pixmap, PixmapPaint, Transform};

use crate::color::Rgb;

/// Pixels in rows from above, each with a colour or transparent.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    width: usize,
    pixels: Vec<Option<Rgb>>,
}

/// A raster and where it lies.
pub(crate) struct Placed {
    corner: (f64, f64),
    size: (f64, f64),
    picture: Pixmap,
}

impl Raster {
    /// A raster with so many pixels in a row.
    pub fn new(width: usize, pixels: Vec<Option<Rgb>>) -> Self {
        Self { width, pixels }
    }

    /// Pixels in a row, and rows.
    pub(crate) fn size(&self) -> (u32, u32) {
        let count = |n: usize| u32::try_from(n).unwrap_or(0);
        (count(self.width), count(self.pixels.len() / self.width.max(1)))
    }

    fn picture(&self) -> Option<Pixmap> {
        let (width, height) = self.size();
        let mut picture = Pixmap::new(width, height)?;
        for (pixel, color) in picture.pixels_mut().iter_mut().zip(&self.pixels) {
            if let Some([red, green, blue]) = *color {
                *pixel = ColorU8::from_rgba(red, green, blue, u8::MAX).premultiply();
            }
        }
        Some(picture)
    }
}

impl Placed {
    /// Nothing for a raster without pixels.
    pub fn new(corner: (f64, f64), size: (f64, f64), raster: &Raster) -> Option<Self> {
        Some(Self { corner, size, picture: raster.picture()? })
    }

    /// As an element of SVG that holds the pixels as PNG.
    pub fn element(&self) -> Result<String, String> {
        let png = self.picture.encode_png().map_err(|error| error.to_string())?;
        let ((x, y), (width, height)) = (self.corner, self.size);
        let data = STANDARD.encode(png);
        Ok(format!(
            r#"<image x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}" preserveAspectRatio="none" href="data:image/png;base64,{data}"/>"#
        ))
    }

    /// Onto a picture with so many pixels per SVG pixel.
    pub fn draw(&self, picture: &mut Pixmap, zoom: f32) {
        let scale = |length: f64, count: u32| zoom * length as f32 / count as f32;
        let (sx, sy) = (scale(self.size.0, self.picture.width()), scale(self.size.1, self.picture.height()));
        let transform =
            Transform::from_row(sx, 0.0, 0.0, sy, zoom * self.corner.0 as f32, zoom * self.corner.1 as f32);
        let paint = PixmapPaint { quality: FilterQuality::Bilinear, ..PixmapPaint::default() };
        picture.draw_pixmap(0, 0, self.picture.as_ref(), &paint, transform, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Canvas, Stroke};

    /// Left half red, right half transparent: white in the picture, and the same pixels in the SVG.
    #[test]
    fn pixels_lie_where_they_are_put_under_what_is_drawn() {
        let mut canvas = Canvas::new(40.0, 20.0);
        let row = [Some([255, 0, 0]), Some([255, 0, 0]), None, None];
        canvas.raster((10.0, 5.0), (20.0, 10.0), &Raster::new(4, [row, row].concat())).expect("pixels");
        canvas.rectangle((12.0, 6.0), (2.0, 8.0), Stroke { color: "#0000ff", width: 2.0, dashes: None });
        let picture = canvas.pixels(1.0).expect("a picture");
        let at = |x, y| picture.pixel(x, y).map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]);
        assert_eq!(at(17, 10), Some([255, 0, 0]));
        assert_eq!(at(12, 10), Some([0, 0, 255]), "a line over it");
        assert_eq!([at(27, 10), at(5, 10), at(17, 2)], [Some([255; 3]); 3]);
        let svg = canvas.inline_svg();
        assert!(svg.contains("<image x=\"10.00\" y=\"5.00\" width=\"20.00\" height=\"10.00\""), "{svg}");
        assert!(svg.find("<image") < svg.find("stroke=\"#0000ff\""));
        assert!(canvas.raster((0.0, 0.0), (1.0, 1.0), &Raster::new(0, Vec::new())).is_err());
    }
}
