//! What a run comes to.

use std::fmt;

use serde::Serialize;

use crate::case::Strategy;

/// The result of a run in numbers. Lengths named `_over_a` are in mean radii.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunReport {
    /// Name of the case.
    pub case: String,
    /// Contact strategy.
    pub strategy: Strategy,
    /// `paper` or `rigid-dofs`; the name of the analytic model where there is no finite-element flow.
    pub formulation: String,
    /// Time steps.
    pub steps: usize,
    /// Wall time in seconds.
    pub wall_s: f64,
    /// Cells of the last mesh.
    pub cells: usize,
    /// Velocity and pressure unknowns of the last mesh.
    pub dofs: usize,
    /// Smallest gap of any pair at any time; `None` for a single particle.
    pub min_gap_over_a: Option<f64>,
    /// Smallest gap of any pair at the end; `None` for a single particle.
    pub end_gap_over_a: Option<f64>,
    /// `|D(t_end) - D(2 t* - t_end)| / D(2 t* - t_end)` of the pair of particles 1 and 2, with `t*` the last
    /// time when their line of centres is at 90 degrees to the flow and the mirror time is in the run.
    pub reversibility_error: Option<f64>,
    /// Name of the reference solution.
    pub reference: Option<String>,
    /// Relative error of the gap of particles 1 and 2 at the end of the common time span.
    pub end_gap_rel_error: Option<f64>,
    /// Largest distance of a centre from its reference position over the common time span.
    pub max_abs_error_over_a: Option<f64>,
    /// Seconds spent in each phase, in the order of a step.
    pub phases: Vec<(String, f64)>,
}

impl fmt::Display for RunReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} ({}, {}): {} steps in {:.2} s",
            self.case, self.strategy, self.formulation, self.steps, self.wall_s
        )?;
        if self.cells > 0 {
            writeln!(f, "  mesh: {} cells, {} unknowns", self.cells, self.dofs)?;
        }
        write_number(f, "smallest gap / a", self.min_gap_over_a)?;
        write_number(f, "gap at the end / a", self.end_gap_over_a)?;
        write_number(f, "reversibility error", self.reversibility_error)?;
        if let Some(reference) = &self.reference {
            writeln!(f, "  compared with {reference}:")?;
        }
        write_number(f, "relative error of the end gap", self.end_gap_rel_error)?;
        write_number(f, "largest position error / a", self.max_abs_error_over_a)
    }
}

fn write_number(f: &mut fmt::Formatter<'_>, name: &str, value: Option<f64>) -> fmt::Result {
    match value {
        Some(value) => writeln!(f, "  {name}: {value:.6e}"),
        None => Ok(()),
    }
}
