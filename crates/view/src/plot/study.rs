//! The picture of a study: viscosities with their intervals against a swept key.

use gluey::rheology::Mean;
use gluey::sweep::{PointProgress, PointStage, StudyProgress};
use gluey_pictures::{Axis, Canvas, Curve, PALETTE, Stroke};

use super::error::PlotError;
use super::figures::{FAINT, LOGARITHMIC, chart, ends, points, stacked};

/// How intervals are drawn, in the colour of their curve.
const BAR: f64 = 1.2;

/// Relative viscosity against the first key that has two numbers at least, a curve for each combination of
/// the others.
pub fn draw(study: &StudyProgress, width_mm: f64) -> Result<Canvas, PlotError> {
    let axis = (0..study.keys.len()).find(|&key| has_numbers(&study.points, key));
    let no_numbers = || PlotError::NoNumbers { folder: study.folder.clone(), keys: study.keys.clone() };
    let axis = axis.ok_or_else(no_numbers)?;
    let mut series: Vec<Viscosities> = Vec::new();
    for point in &study.points {
        let Some((x, mean)) = number(point, axis).zip(viscosity(point)) else { continue };
        let label = label(study, point, axis);
        match series.iter_mut().find(|one| one.label == label) {
            Some(one) => one.points.push((x, mean)),
            None => series.push(Viscosities { label, points: vec![(x, mean)] }),
        }
    }
    if series.is_empty() {
        let (folder, done, of) = (study.folder.clone(), study.count(PointStage::Done), study.points.len());
        return Err(PlotError::NoViscosity { folder, done, of });
    }
    let curves: Vec<Curve> = series.iter_mut().enumerate().flat_map(|(n, one)| one.curves(n)).collect();
    let x: Vec<f64> = points(&curves).map(|point| point.0).collect();
    let (low, high) = ends(&x);
    // Points lie beside the frame, not on it.
    let room = 0.04 * (high - low);
    let across = match low > 0.0 && high > LOGARITHMIC * low {
        true => Axis::decades(&study.keys[axis], low, high),
        false => Axis::around(&study.keys[axis], [low - room, high + room]),
    };
    let up = Axis::around("relative viscosity", points(&curves).map(|point| point.1));
    let mut chart = chart(across, up, curves);
    chart.notes.push("Means behind the transient and their 95 % intervals".to_owned());
    Ok(stacked(&[chart], width_mm))
}

struct Viscosities {
    label: String,
    points: Vec<(f64, Mean)>,
}

impl Viscosities {
    /// A line through the means, a dot at each, and their intervals as bars.
    fn curves(&mut self, number: usize) -> [Curve; 2] {
        self.points.sort_by(|one, other| one.0.total_cmp(&other.0));
        let stroke = PALETTE.get(number).copied().unwrap_or(FAINT);
        let line: Vec<(f64, f64)> = self.points.iter().map(|(x, mean)| (*x, mean.mean)).collect();
        let dots = line.iter().map(|at| vec![*at]);
        let bar = |&(x, Mean { mean, half_width, .. }): &(f64, Mean)| {
            half_width.map(|width| vec![(x, mean - width), (x, mean + width)])
        };
        let pieces = self.points.iter().filter_map(bar).chain(dots).collect();
        let label = (!self.label.is_empty()).then(|| self.label.clone());
        let bars = Stroke { width: BAR, dashes: None, ..stroke };
        [Curve { label, stroke, pieces: vec![line] }, Curve { label: None, stroke: bars, pieces }]
    }
}

/// The values of all keys but one.
fn label(study: &StudyProgress, point: &PointProgress, axis: usize) -> String {
    let others = study.keys.iter().zip(&point.values).enumerate().filter(|(key, _)| *key != axis);
    let names = others.map(|(_, (key, value))| format!("{key} = {value}"));
    names.collect::<Vec<_>>().join(", ")
}

/// Whether the values of a key are numbers, and not all the same.
fn has_numbers(points: &[PointProgress], key: usize) -> bool {
    let numbers: Option<Vec<f64>> = points.iter().map(|point| number(point, key)).collect();
    numbers.is_some_and(|numbers| numbers.iter().any(|number| *number != numbers[0]))
}

fn number(point: &PointProgress, key: usize) -> Option<f64> {
    point.values.get(key)?.parse().ok().filter(|number: &f64| number.is_finite())
}

fn viscosity(point: &PointProgress) -> Option<Mean> {
    point.report.as_ref()?.rheology.as_ref()?.viscosity
}
