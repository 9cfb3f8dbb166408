//! The table of a study: a line for each point, with its values and the numbers of its report.

use std::collections::BTreeMap;

use serde::Serialize;

use super::SweptKey;
use crate::number_text::shown_to;
use crate::report::RunReport;
use crate::rheology::{Mean, RheologyMeans};

/// The outcome of a point.
#[derive(Clone, Debug, Serialize)]
pub struct PointResult {
    /// Name of the point and of its folder.
    pub name: String,
    /// Values of the swept keys, as they were written.
    pub values: BTreeMap<String, String>,
    /// `complete`, `failed` or `interrupted`; `not run` where the study ended before.
    pub state: &'static str,
    /// Its report, where it is complete.
    pub report: Option<RunReport>,
    /// Why it failed, where it did.
    pub error: Option<String>,
}

/// The head of the table and its lines: values of the keys, then `state`, then numbers of reports. Lengths
/// named `_over_a` are in mean radii, `wall_s` in seconds; means of the rheology behind `strain_skipped` have
/// half the width of their 95 % interval beside them, which `blocks_independent` says to hold. No count where
/// there was nothing to be counted.
pub fn table(axes: &[SweptKey], results: &[PointResult]) -> Vec<Vec<String>> {
    let keys = axes.iter().map(|axis| axis.key.clone());
    let numbers = numbers_of(None).into_iter().map(|(name, _)| name);
    let head = keys.chain(["state".to_owned()]).chain(numbers).collect();
    let line = |result: &PointResult| {
        let values = axes.iter().map(|axis| result.values.get(&axis.key).cloned().unwrap_or_default());
        let numbers = numbers_of(result.report.as_ref()).into_iter().map(|(_, number)| number);
        values.chain([result.state.to_owned()]).chain(numbers).collect()
    };
    [head].into_iter().chain(results.iter().map(line)).collect()
}

/// A mean among those of a run.
type MeanOf = fn(&RheologyMeans) -> Option<Mean>;

/// Means of the rheology, by the columns they are of.
const MEANS: [(&str, MeanOf); 9] = [
    ("viscosity", |means| means.viscosity),
    ("viscosity_by_dissipation", |means| means.viscosity_by_dissipation),
    ("viscosity_of_contacts", |means| means.viscosity_of_contacts),
    ("viscosity_of_friction", |means| means.viscosity_of_friction),
    ("sticking_contacts", |means| means.sticking_contacts),
    ("sliding_contacts", |means| means.sliding_contacts),
    ("N1", |means| means.n1),
    ("N2", |means| means.n2),
    ("particle_pressure", |means| means.particle_pressure),
];

/// Names and numbers of a report; no numbers without one.
fn numbers_of(report: Option<&RunReport>) -> Vec<(String, String)> {
    let text = |of: fn(&RunReport) -> String| report.map_or(String::new(), of);
    let shown = |value: Option<f64>| value.map_or(String::new(), |value| shown_to(value, 7));
    let number = |of: fn(&RunReport) -> Option<f64>| shown(report.and_then(of));
    let cells = [
        ("steps", text(|report| report.steps.to_string())),
        ("wall_s", text(|report| format!("{:.3}", report.wall_s))),
        ("cells", text(|report| report.cells.to_string())),
        ("dofs", text(|report| report.dofs.to_string())),
        ("cells_per_radius", number(|report| report.cells_per_radius)),
        ("min_gap_over_a", number(|report| report.min_gap_over_a)),
        ("end_gap_over_a", number(|report| report.end_gap_over_a)),
        ("reversibility_error", number(|report| report.reversibility_error)),
        ("end_gap_rel_error", number(|report| report.end_gap_rel_error)),
        ("max_abs_error_over_a", number(|report| report.max_abs_error_over_a)),
        ("strain_skipped", number(|report| Some(report.rheology.as_ref()?.strain_skipped))),
    ];
    let rheology = report.and_then(|report| report.rheology.as_ref());
    let means = MEANS.map(|(name, of)| (name, rheology.and_then(of)));
    let all = means.iter().filter_map(|(_, mean)| *mean).map(|mean| mean.is_resolved);
    let is_resolved = all.reduce(|all, one| all && one);
    let is_resolved = is_resolved.map_or(String::new(), |is| if is { "yes" } else { "no" }.to_owned());
    let count = |count: usize| (count > 0).then_some(count as f64);
    let ends = [
        ("blocks_independent", is_resolved),
        ("halved_steps", shown(report.and_then(|report| count(report.tally.halved_steps)))),
        ("closed_films", shown(report.and_then(|report| count(report.tally.closed_films)))),
    ];
    let with_width = means.into_iter().flat_map(|(name, mean)| {
        let width = shown(mean.and_then(|mean| mean.half_width));
        [(name.to_owned(), shown(mean.map(|mean| mean.mean))), (format!("{name}_half_width"), width)]
    });
    let named = |(name, cell): (&str, String)| (name.to_owned(), cell);
    cells.map(named).into_iter().chain(with_width).chain(ends.map(named)).collect()
}
