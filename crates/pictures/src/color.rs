//! Colours, and a scale of them for numbers.

/// A colour: red, green, blue.
pub type Rgb = [u8; 3];

/// Viridis (S. van der Walt and N. Smith 2015, public domain) in ten equal steps: dark to light, so that
/// order is seen without colours too.
const SCALE: [Rgb; 11] = [
    [68, 1, 84],
    [72, 37, 118],
    [65, 68, 135],
    [53, 95, 141],
    [42, 120, 142],
    [33, 145, 140],
    [34, 168, 132],
    [68, 191, 112],
    [122, 209, 81],
    [189, 223, 38],
    [253, 231, 37],
];

/// The colour of a fraction from 0, dark, to 1, light; equal steps are equal steps of lightness, nearly.
pub fn color_scale(fraction: f64) -> Rgb {
    let place = fraction.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let first = (place as usize).min(SCALE.len() - 2);
    let share = place - first as f64;
    std::array::from_fn(|k| {
        let [from, to] = [SCALE[first][k], SCALE[first + 1][k]].map(f64::from);
        (from + share * (to - from)).round() as u8
    })
}

/// Darker below 1, towards white from 1 to 2.
pub(crate) fn shaded(color: Rgb, light: f64) -> Rgb {
    color.map(|part| {
        let part = f64::from(part);
        let shade = if light > 1.0 { part + (255.0 - part) * (light - 1.0) } else { part * light };
        shade.round() as u8
    })
}

/// As SVG and CSS write it.
pub(crate) fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_of_colours_gets_lighter() {
        let lightness = |n: u32| {
            let [red, green, blue] = color_scale(f64::from(n) / 20.0).map(f64::from);
            0.3 * red + 0.59 * green + 0.11 * blue
        };
        assert!((0..20).all(|n| lightness(n + 1) > lightness(n)));
        assert_eq!((color_scale(-1.0), color_scale(2.0)), (SCALE[0], SCALE[10]));
    }
}
