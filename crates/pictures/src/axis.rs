//! One axis: its ends and its ticks. Labels of ticks that would be long have a power of ten set apart.

use std::sync::Arc;

use kuva::render::layout::TickFormat;

use crate::text;

/// Size of the labels of ticks.
pub(crate) const TICK_SIZE: f64 = 14.0;
/// Room between labels of ticks side by side, and one over the other.
const BETWEEN: [f64; 2] = [8.0, 2.0];
/// Values from here on, and below, are told with a power of ten.
const PLAIN: [f64; 2] = [0.01, 1e5];
/// Most decimals of a label.
const MOST_DECIMALS: i32 = 14;

/// An axis: label, ends and ticks.
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
        let size = high.abs().max(low.abs());
        // A constant has room around it.
        let room = match high - low > 1e-9 * size {
            true => 0.0,
            false if size == 0.0 => 1.0,
            false => 0.5 * size,
        };
        let (low, high) = (low - room, high + room);
        let tick = round_step((high - low) / 5.0);
        let half = 0.5 * tick;
        let (min, max) = ((low / half + 1e-6).floor() * half, (high / half - 1e-6).ceil() * half);
        Self { label: label.to_owned(), min, max, tick, log: false }
    }

    /// Whether a value lies between the ends, which [`Axis::around`] rounds a little.
    pub(crate) fn shows(&self, value: f64) -> bool {
        let slack = if self.log { 0.0 } else { 1e-6 * (self.max - self.min) };
        (self.min - slack..=self.max + slack).contains(&value)
    }

    /// Where a value lies, from 0 at the smallest value shown to 1 at the largest.
    pub(crate) fn fraction(&self, value: f64) -> f64 {
        let scale = |x: f64| if self.log { x.log10() } else { x };
        (scale(value) - scale(self.min)) / (scale(self.max) - scale(self.min))
    }

    /// The power of ten that is set apart, and ends and ticks over it.
    pub(crate) fn set_apart(&self) -> Option<(i32, Self)> {
        let most = self.min.abs().max(self.max.abs());
        if self.log || most == 0.0 || (PLAIN[0]..PLAIN[1]).contains(&most) {
            return None;
        }
        let power = (most.log10() + 1e-9).floor() as i32;
        let over = |value: f64| scaled(value, power);
        let (tick, label) = (over(self.tick), self.label.clone());
        // Round numbers again, as they are in the unit of the axis.
        let half = 0.5 * tick;
        let round = |end: f64| {
            let halves = (over(end) / half).round();
            if (halves * half - over(end)).abs() < 1e-6 * tick { halves * half } else { over(end) }
        };
        Some((power, Self { label, min: round(self.min), max: round(self.max), tick, log: false }))
    }

    /// With so many ticks only that their labels have room side by side in a length (or `upright`, one over
    /// the other).
    pub(crate) fn with_room(mut self, length: f64, upright: bool) -> Self {
        let [beside, over] = BETWEEN;
        let needed = |axis: &Self| if upright { TICK_SIZE + over } else { axis.widest_label() + beside };
        let has_room = |axis: &Self| axis.tick / (axis.max - axis.min) * length >= needed(axis);
        while !self.log && !has_room(&self) && self.tick < self.max - self.min {
            self.tick = round_step(1.5 * self.tick);
        }
        self
    }

    /// Width of the widest label of a tick, as it is told where no power is set apart.
    pub(crate) fn widest_label(&self) -> f64 {
        let labels = match self.log {
            true => [self.min, self.max].map(|end| match self.has_few_decades() {
                true => plain(end),
                false => power_of_ten(end),
            }),
            false => [self.min, self.max].map(|end| decimal(end, self.decimals())),
        };
        labels.iter().map(|label| text::width(label, TICK_SIZE)).fold(0.0, f64::max)
    }

    /// Ticks: decimals as the step needs on a linear axis, powers of ten on a logarithmic one, where across
    /// and short also numbers.
    pub(crate) fn tick_format(&self, upright: bool) -> TickFormat {
        let decimals = self.decimals();
        match (self.log, !upright && self.has_few_decades()) {
            (true, true) => TickFormat::Custom(Arc::new(plain)),
            (true, false) => TickFormat::Custom(Arc::new(power_of_ten)),
            (false, _) => TickFormat::Custom(Arc::new(move |value| decimal(value, decimals))),
        }
    }

    fn decimals(&self) -> usize {
        let is_whole = |decimals: &i32| {
            let ticks = scaled(self.tick, -decimals);
            (ticks - ticks.round()).abs() < 1e-6 * ticks
        };
        (0..MOST_DECIMALS).find(is_whole).unwrap_or(MOST_DECIMALS) as usize
    }

    /// Whether it is logarithmic and so short that its ticks between powers of ten have room for a number.
    fn has_few_decades(&self) -> bool {
        self.log && self.min > 0.9e-3 && self.max < 1.1e3 && self.max < 1.1e3 * self.min
    }
}

/// A value over a power of ten.
pub(crate) fn scaled(value: f64, power: i32) -> f64 {
    // Powers beyond 10^22 are not exact, nor need they be.
    if power < 0 { value * 10f64.powi(-power) } else { value / 10f64.powi(power) }
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

/// `10^{n}` for whole powers, nothing for ticks between them.
fn power_of_ten(value: f64) -> String {
    let exponent = value.log10();
    if (exponent - exponent.round()).abs() > 1e-6 {
        return String::new();
    }
    tenth(exponent.round() as i32)
}

/// `10^{n}`.
pub(crate) fn tenth(power: i32) -> String {
    format!("10^{{{}}}", power.to_string().replace('-', "\u{2212}"))
}

/// Ticks as decimals with as many digits as they have.
fn plain(value: f64) -> String {
    format!("{}", (value * 1e6).round() / 1e6)
}

/// A number with so many decimals, and no sign before zero.
fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = !text.contains(|digit: char| digit.is_ascii_digit() && digit != '0');
    if is_zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "\u{2212}") }
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

    /// What a reader sees: labels, and the power that they are times of.
    fn told(values: &[f64]) -> (Vec<String>, Option<i32>) {
        let axis = Axis::around("", values.iter().copied());
        let (power, shown) =
            axis.set_apart().map_or((None, axis.clone()), |(power, shown)| (Some(power), shown));
        let count = ((shown.max - shown.min) / shown.tick + 1e-6).floor() as i32;
        let first = (shown.min / shown.tick - 1e-6).ceil();
        let format = shown.tick_format(false);
        let labels = (0..=count).map(|k| first + f64::from(k)).map(|k| format.format(k * shown.tick));
        (labels.collect(), power)
    }

    /// From 1e-12 to 1e12 labels differ, are short, and make the numbers again with their power.
    #[test]
    fn labels_tell_numbers_of_any_size() {
        for power in -12..=12 {
            let unit = 10f64.powi(power);
            for ends in [[0.0, 1.0], [0.12, 0.83], [-0.4, 0.3], [1.98, 2.02], [0.0, 5.0]] {
                let values = ends.map(|end| end * unit);
                let (labels, apart) = told(&values);
                assert!(labels.len() >= 3, "{values:?}: {labels:?}");
                assert!(labels.windows(2).all(|two| two[0] != two[1]), "{values:?}: {labels:?}");
                assert!(labels.iter().all(|label| label.chars().count() <= 7), "{values:?}: {labels:?}");
                let number = |label: &String| -> f64 {
                    let number: f64 = label.replace('\u{2212}', "-").parse().expect("a number");
                    number * 10f64.powi(apart.unwrap_or(0))
                };
                let span = number(&labels[labels.len() - 1]) - number(&labels[0]);
                let wanted = values[1] - values[0];
                assert!(span > 0.5 * wanted && span < 1.7 * wanted, "{values:?}: {labels:?} {apart:?}");
            }
        }
        assert_eq!(told(&[0.0, 8e-5]).0, ["0", "2", "4", "6", "8"]);
        assert_eq!(told(&[0.0, 8e-5]).1, Some(-5));
        assert_eq!(told(&[0.0, 1.0]).1, None);
    }

    #[test]
    fn ticks_have_room() {
        let axis = Axis::around("", [0.0, 1.0]);
        assert_eq!(axis.clone().with_room(400.0, false).tick, axis.tick);
        let narrow = axis.clone().with_room(100.0, false);
        assert!(narrow.tick > axis.tick && narrow.tick <= 1.0, "{narrow:?}");
        assert!(axis.with_room(30.0, true).tick > 0.5);
    }
}
