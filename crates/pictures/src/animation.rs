//! Animations as GIF files.

use gif::{Encoder, EncodingError, Frame, Repeat};

use crate::canvas::{Canvas, PngError};

/// How finely colours are chosen, 1 (best) to 30 (fastest).
const SPEED: i32 = 3;

/// Frames one after the other, again and again: a GIF that grows as they come.
pub struct Animation {
    encoder: Encoder<Vec<u8>>,
    /// Time that a frame is seen, in hundredths of a second.
    delay: u16,
}

/// A frame with at most 256 colours; frames can be made at the same time, on any thread.
pub struct Still(Frame<'static>);

impl Still {
    /// A drawing with so many pixels across.
    ///
    /// # Errors
    /// If it cannot be drawn, or is too large for a GIF (65535 pixels).
    pub fn new(canvas: &Canvas, pixels: u32) -> Result<Self, PngError> {
        let mut picture = canvas.pixels(pixels as f32 / canvas.width() as f32)?;
        let too_large = PngError::Size(picture.width(), picture.height());
        let [Ok(width), Ok(height)] = [picture.width(), picture.height()].map(u16::try_from) else {
            return Err(too_large);
        };
        // White behind everything: nothing is transparent, so that no colour was multiplied by its opacity.
        Ok(Self(Frame::from_rgba_speed(width, height, picture.data_mut(), SPEED)))
    }
}

impl Animation {
    /// An animation of the size of this frame, which is its first.
    ///
    /// # Errors
    /// Those of the format.
    pub fn new(first: Still, frames_per_second: f64) -> Result<Self, EncodingError> {
        let mut encoder = Encoder::new(Vec::new(), first.0.width, first.0.height, &[])?;
        encoder.set_repeat(Repeat::Infinite)?;
        // Players take less than two hundredths for a mistake.
        let delay = (100.0 / frames_per_second).round().clamp(2.0, f64::from(u16::MAX)) as u16;
        let mut animation = Self { encoder, delay };
        animation.push(first)?;
        Ok(animation)
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// Those of the format, such as a frame larger than the first.
    pub fn push(&mut self, mut still: Still) -> Result<(), EncodingError> {
        still.0.delay = self.delay;
        self.encoder.write_frame(&still.0)
    }

    /// The file.
    ///
    /// # Errors
    /// Those of the format.
    pub fn into_bytes(self) -> Result<Vec<u8>, EncodingError> {
        self.encoder.into_inner()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Stroke;

    #[test]
    fn frames_come_back_in_order_with_their_colours() {
        let drawing = |color| {
            let mut canvas = Canvas::new(40.0, 20.0);
            canvas.circle((20.0, 10.0), 8.0, color, Stroke { color, width: 0.0, dashes: None });
            Still::new(&canvas, 80).expect("a frame")
        };
        let mut animation = Animation::new(drawing("#ff0000"), 12.5).expect("a file");
        animation.push(drawing("#0000ff")).expect("another");
        let bytes = animation.into_bytes().expect("whole");
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(&bytes[..]).expect("a header");
        for expected in [[255, 0, 0, 255], [0, 0, 255, 255]] {
            let frame = decoder.read_next_frame().expect("readable").expect("there");
            assert_eq!((frame.width, frame.height, frame.delay), (80, 40, 8));
            let [corner, middle] = [0, 20 * 80 + 40].map(|pixel| &frame.buffer[4 * pixel..][..4]);
            let near = |one: &[u8], other: [u8; 4]| one.iter().zip(other).all(|(a, b)| a.abs_diff(b) < 3);
            assert!(near(corner, [255; 4]) && near(middle, expected), "{corner:?} {middle:?}");
        }
        assert!(decoder.read_next_frame().expect("readable").is_none());
    }
}
