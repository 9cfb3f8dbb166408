//! The table of a study: a line for each point, with its values and the numbers of its report.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Axis;
use crate::number_text::shown_to;
use crate::report::RunReport;

/// What came out of a point.
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
pub fn table(axes: &[Axis], results: &[PointResult]) -> Vec<Vec<String>> {
    let numbers = [
        "steps",
        "wall_s",
        "cells",
        "dofs",
        "cells_per_radius",
        "min_gap_over_a",
        "end_gap_over_a",
        "reversibility_error",
        "end_gap_rel_error",
        "max_abs_error_over_a",
        "strain_skipped",
        "viscosity",
        "viscosity_half_width",
        "N1",
        "N1_half_width",
        "N2",
        "N2_half_width",
        "particle_pressure",
        "particle_pressure_half_width",
        "blocks_independent",
        "halved_steps",
        "closed_films",
    ];
    let keys = axes.iter().map(|axis| axis.key.clone());
    let head = keys.chain(["state"].into_iter().chain(numbers).map(str::to_owned)).collect();
    let line = |result: &PointResult| {
        let values = axes.iter().map(|axis| result.values.get(&axis.key).cloned().unwrap_or_default());
        let numbers = result.report.as_ref().map_or(vec![String::new(); numbers.len()], numbers_of);
        values.chain([result.state.to_owned()]).chain(numbers).collect()
    };
    [head].into_iter().chain(results.iter().map(line)).collect()
}

/// In the order of the head.
fn numbers_of(report: &RunReport) -> Vec<String> {
    let number = |value: Option<f64>| value.map_or(String::new(), |value| shown_to(value, 7));
    let mut cells = vec![
        report.steps.to_string(),
        format!("{:.3}", report.wall_s),
        report.cells.to_string(),
        report.dofs.to_string(),
        number(report.cells_per_radius),
        number(report.min_gap_over_a),
        number(report.end_gap_over_a),
        number(report.reversibility_error),
        number(report.end_gap_rel_error),
        number(report.max_abs_error_over_a),
    ];
    let rheology = report.rheology.as_ref();
    cells.push(number(rheology.map(|rheology| rheology.strain_skipped)));
    let means =
        rheology.map_or([None; 4], |means| [means.viscosity, means.n1, means.n2, means.particle_pressure]);
    for mean in means {
        cells.push(number(mean.map(|mean| mean.mean)));
        cells.push(number(mean.and_then(|mean| mean.half_width)));
    }
    let is_resolved = means.into_iter().flatten().map(|mean| mean.is_resolved).reduce(|all, one| all && one);
    cells.push(is_resolved.map_or(String::new(), |is| if is { "yes" } else { "no" }.to_owned()));
    let counts = [report.tally.halved_steps, report.tally.closed_films];
    cells.extend(counts.map(|count| number((count > 0).then_some(count as f64))));
    cells
}
