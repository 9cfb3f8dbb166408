//! Summary of a run.

use std::fmt;

use gluey_motion::FlowStatistics;
use serde::{Deserialize, Serialize};

use crate::case::{Case, Strategy};
use crate::measures::RunMeasures;
use crate::number_text::shown_to;
use crate::phases::PhaseTable;
use crate::rheology::RheologyMeans;
use crate::tally::Tally;
use crate::trajectory::PairHistory;

/// Gaps below this many radii are contact, and no measure of anything.
const TOUCHING_OVER_A: f64 = 1e-8;

/// The result of a run in numbers. Lengths named `_over_a` are in mean radii.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunReport {
    /// Name of the case.
    pub case: String,
    /// Contact strategy.
    pub strategy: Strategy,
    /// `unfitted` or `paper`; the name of the analytic model where there is no finite-element
    /// flow.
    pub formulation: String,
    /// Time steps.
    pub steps: usize,
    /// Wall time in seconds.
    pub wall_s: f64,
    /// Cells of the last mesh.
    pub cells: usize,
    /// Velocity and pressure unknowns of the last mesh.
    pub dofs: usize,
    /// Cells per radius of the smallest particle at the surfaces, as the mesh had them; `None` where the flow
    /// has no mesh.
    pub cells_per_radius: Option<f64>,
    /// Smallest gap of any pair at any time; `None` for a single particle.
    pub min_gap_over_a: Option<f64>,
    /// Gap of particles 1 and 2 at the end; `None` for a single particle.
    pub end_gap_over_a: Option<f64>,
    /// `|D(t_end) - D(2 t* - t_end)| / D(2 t* - t_end)` of particles 1 and 2, with `t*` the last time when
    /// their line of centres is at 90 degrees to the flow; `None` where that mirror time is not in the run,
    /// where they touch at it, with a reversal of the shear, and where there are others: only the encounter
    /// of two is its own mirror image.
    pub reversibility_error: Option<f64>,
    /// Name of the reference solution.
    pub reference: Option<String>,
    /// Relative error of the gap of particles 1 and 2 at the end of the common time span.
    pub end_gap_rel_error: Option<f64>,
    /// Largest distance of a centre from its reference position over the common time span.
    pub max_abs_error_over_a: Option<f64>,
    /// Means of the rheology behind its transient, in boxes that are sheared for ever.
    #[serde(default)]
    pub rheology: Option<RheologyMeans>,
    /// What was counted.
    #[serde(flatten)]
    pub tally: Tally,
    /// Seconds spent in each phase, in the order of a step.
    pub phases: Vec<(String, f64)>,
}

impl RunReport {
    /// The report of a run of `case`, without means of the rheology.
    pub(crate) fn of<const D: usize>(
        case: &Case,
        measures: &RunMeasures<D>,
        flow: &FlowStatistics,
        tally: &Tally,
        wall_s: f64,
        phases: &PhaseTable,
    ) -> Self {
        let (a, pair) = (measures.mean_radius(), measures.pair());
        let deviation = measures.deviation();
        let is_mirrored = case.particles.len() == 2 && !case.turns_round();
        Self {
            case: case.name.clone(),
            strategy: case.contact.strategy,
            formulation: case.flow_name().to_owned(),
            steps: measures.row_count().saturating_sub(1),
            wall_s,
            cells: flow.cell_count,
            dofs: flow.dof_count,
            cells_per_radius: case.cells_per_radius_as_built(),
            min_gap_over_a: measures.smallest_gap_over_a(),
            end_gap_over_a: pair.end_gap().map(|gap| gap / a),
            reversibility_error: is_mirrored.then(|| reversibility_error(pair, a)).flatten(),
            reference: case.reference.clone(),
            end_gap_rel_error: deviation.and_then(|deviation| deviation.end_gap_rel_error),
            max_abs_error_over_a: deviation.map(|deviation| deviation.max_abs_error_over_a),
            rheology: None,
            tally: *tally,
            phases: phases.rows().to_vec(),
        }
    }
}

/// `|D(t* + s) - D(t* - s)| / D(t* - s)` at the end of the run: `t*` is the last time when the line of
/// centres is at 90 degrees to the flow and `s = t_end - t*`, or a little less where `t* - s` would lie
/// before the start. An exact encounter has none: it is its own mirror image in time.
///
/// `None` without such a time, where more than a twentieth of `s` would have to be cut, and where the
/// surfaces touch at `t* - s`. `a` is the mean radius.
fn reversibility_error(pair: &PairHistory, a: f64) -> Option<f64> {
    let end = pair.end()?;
    let crossing = pair.last_crossing()?;
    let after = end - crossing;
    let reach = Some(after.min(crossing)).filter(|reach| *reach >= 0.95 * after)?;
    let last = pair.gap_at((crossing + reach).min(end))?;
    let mirrored = pair.gap_at((crossing - reach).max(0.0))?;
    let error = (last - mirrored).abs() / mirrored;
    (mirrored > TOUCHING_OVER_A * a).then_some(error)
}

impl fmt::Display for RunReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} ({}, {}): {} steps in {:.2} s",
            self.case, self.strategy, self.formulation, self.steps, self.wall_s
        )?;
        if self.cells > 0 {
            write!(f, "  mesh: {} cells, {} unknowns", self.cells, self.dofs)?;
            let cells =
                self.cells_per_radius.map(|cells| format!(", {} cells per radius", shown_to(cells, 4)));
            writeln!(f, "{}", cells.unwrap_or_default())?;
        }
        write_number(f, "smallest gap / a", self.min_gap_over_a)?;
        self.tally.fmt(f)?;
        write_number(f, "gap of 1 and 2 at the end / a", self.end_gap_over_a)?;
        write_number(f, "reversibility error", self.reversibility_error)?;
        if let Some(rheology) = &self.rheology {
            writeln!(
                f,
                "  means of the rheology from a strain of {} on:",
                shown_to(rheology.strain_skipped, 7)
            )?;
            for (name, mean) in rheology.named() {
                writeln!(f, "    {name}: {}", mean.to_string().trim_start())?;
            }
        }
        if let Some(reference) = &self.reference {
            writeln!(f, "  compared with {reference}:")?;
        }
        write_number(f, "relative error of the end gap", self.end_gap_rel_error)?;
        write_number(f, "largest position error / a", self.max_abs_error_over_a)
    }
}

fn write_number(f: &mut fmt::Formatter<'_>, name: &str, value: Option<f64>) -> fmt::Result {
    match value {
        Some(value) => writeln!(f, "  {name}: {}", shown_to(value, 7)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use gluey_geom::{Lattice, Vector};

    use super::*;

    const A: f64 = 0.05;

    /// Particle 2 passes above particle 1 at `t = 5`, at the distance `above(t)` in y.
    fn passing(end: f64, above: impl Fn(f64) -> f64) -> PairHistory {
        let mut pair = PairHistory::default();
        let mut t = 0.0;
        while t <= end {
            let other = Vector::<2>::new(0.1 * (t - 5.0), above(t));
            pair.push(t, [&Vector::zeros(), &other], [A; 2], &Lattice::default());
            t += 0.1;
        }
        pair
    }

    #[test]
    fn a_symmetric_passage_is_reversible() {
        let error = reversibility_error(&passing(9.03, |_| 0.11), A).expect("a mirror time");
        assert!(error < 1e-4, "{error}");
    }

    #[test]
    fn a_passage_that_ends_elsewhere_is_not() {
        let pair = passing(9.03, |t| if t < 5.0 { 0.11 } else { 0.3 });
        let error = reversibility_error(&pair, A).expect("a mirror time");
        let gap = |y: f64| 0.4f64.hypot(y) - 2.0 * A;
        assert!((error - (gap(0.3) - gap(0.11)) / gap(0.11)).abs() < 1e-3, "{error}");
    }

    #[test]
    fn without_a_mirror_time_there_is_no_such_error() {
        assert_eq!(reversibility_error(&passing(4.0, |_| 0.11), A), None);
        assert_eq!(reversibility_error(&passing(11.0, |_| 0.11), A), None);
        assert_eq!(reversibility_error(&PairHistory::default(), A), None);
    }
}
