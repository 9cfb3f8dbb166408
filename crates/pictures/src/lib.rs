//! Charts and drawings as SVG text and PNG bytes: numbers in, pictures out. It knows no file and no flow.
//!
//! A [`Chart`] has [`Curve`]s over two axes ([`Axis`]); [`stack`] puts charts of equal width onto a
//! [`Canvas`], which also takes what no chart draws: lines, labels, spheres with light on them ([`Ball`]),
//! pixels ([`Raster`]). Labels have a little markup: `*t*` is italic, `_{12}` a subscript, `^{-1}` a
//! superscript. Lengths are SVG pixels; [`PIXELS_PER_MM`] of them are one millimetre on paper.
//!
//! Not for interactive charts.

mod animation;
mod axis;
mod ball;
mod canvas;
mod chart;
mod color;
mod curve;
mod legend;
mod palette;
mod raster;
mod text;

pub use animation::{Animation, Still};
pub use axis::Axis;
pub use ball::Ball;
pub use canvas::{Canvas, FONT_FAMILY, PIXELS_PER_MM, PngError, font_faces};
pub use chart::{Chart, Mark, WIDTH, equal_aspect_height, stack, stack_to_width};
pub use color::{Rgb, color_scale};
pub use curve::{Curve, Stroke};
pub use gif::EncodingError;
pub use palette::PALETTE;
pub use raster::Raster;

/// The example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
