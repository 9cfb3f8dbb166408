//! What the curves of a chart are called, above its frame.

use crate::canvas::Canvas;
use crate::curve::{Curve, Stroke};
use crate::text;

const ROW: f64 = 19.0;
const SAMPLE: f64 = 40.0;
/// Between a sample and its label, and behind the label.
const SPACE: f64 = 8.0;
const SIZE: f64 = 15.0;
const NOTE_SIZE: f64 = 13.0;
const MOST_COLUMNS: usize = 2;

/// Labels with samples of their strokes, and remarks below them.
pub(crate) struct Legend<'a> {
    pub entries: Vec<(&'a str, Stroke)>,
    pub notes: &'a [String],
}

fn entries(curves: &[Curve]) -> Vec<(&str, Stroke)> {
    let mut entries: Vec<(&str, Stroke)> = Vec::new();
    for curve in curves {
        if let Some(label) = &curve.label
            && !entries.iter().any(|(name, _)| name == label)
        {
            entries.push((label, curve.stroke));
        }
    }
    entries
}

impl<'a> Legend<'a> {
    /// What curves are called, once each, but for entries that stand elsewhere, and remarks.
    pub fn of(curves: &'a [Curve], notes: &'a [String], elsewhere: &[(&str, Stroke)]) -> Self {
        let entries = entries(curves).into_iter().filter(|entry| !elsewhere.contains(entry));
        Legend { entries: entries.collect(), notes }
    }

    /// The entries of several charts, given by their curves, that all have the same ones; none if they
    /// differ, or if there is one chart only.
    pub fn shared(charts: &[&'a [Curve]]) -> Self {
        let shared = charts.first().map_or_else(Vec::new, |curves| entries(curves));
        let is_shared = charts.len() > 1 && charts.iter().all(|curves| entries(curves) == shared);
        Legend { entries: if is_shared { shared } else { Vec::new() }, notes: &[] }
    }
}

impl Legend<'_> {
    /// As many columns as labels have room in.
    fn columns(&self, width: f64) -> usize {
        let widest = self.entries.iter().map(|(label, _)| text::width(label, SIZE)).fold(0.0, f64::max);
        let columns = (width / (SAMPLE + 2.0 * SPACE + widest)).floor() as usize;
        columns.clamp(1, MOST_COLUMNS)
    }

    /// Its height where it is so wide.
    pub fn height(&self, width: f64) -> f64 {
        ROW * (self.entries.len().div_ceil(self.columns(width)) + self.notes.len()) as f64
    }

    /// Draws it with this upper left corner, so wide.
    pub fn draw(&self, canvas: &mut Canvas, left: f64, top: f64, width: f64) {
        let columns = self.columns(width);
        let middle = |row: usize| top + ROW * (row as f64 + 0.5);
        for (i, (label, stroke)) in self.entries.iter().enumerate() {
            let (x, y) = (left + width / columns as f64 * (i % columns) as f64, middle(i / columns));
            canvas.line((x, y), (x + SAMPLE, y), *stroke);
            canvas.text(x + SAMPLE + SPACE, y + 5.0, SIZE, "start", label);
        }
        let rows = self.entries.len().div_ceil(columns);
        for (i, note) in self.notes.iter().enumerate() {
            canvas.text(left, middle(rows + i) + 5.0, NOTE_SIZE, "start", note);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PALETTE;

    fn curves(labels: &[&str]) -> Vec<Curve> {
        let curve = |(label, stroke): (&&str, &Stroke)| Curve {
            label: Some((*label).to_owned()),
            stroke: *stroke,
            pieces: vec![vec![(0.0, 0.0), (1.0, 1.0)]],
        };
        labels.iter().zip(&PALETTE).map(curve).collect()
    }

    #[test]
    fn legends_stand_at_their_panel_or_once_on_top() {
        let (both, one) = (curves(&["a", "b"]), curves(&["a"]));
        assert_eq!(Legend::shared(&[&both, &both]).entries.len(), 2);
        assert!(Legend::shared(&[&both, &one]).entries.is_empty());
        assert_eq!(Legend::of(&both, &[], &[]).entries.len(), 2);
        assert!(Legend::of(&one, &[], &[("a", PALETTE[0])]).entries.is_empty());
    }
}
