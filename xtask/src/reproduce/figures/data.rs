//! What figures are drawn from, and how their curves look.

use std::collections::BTreeMap;

use crate::reproduce::plan::{Approach, CaseName, FigureName, RunKey};
use crate::reproduce::settings::Settings;
use crate::reproduce::trajectory::Trajectory;
use gluey_pictures::{Curve, Stroke};

/// Data from which figures are drawn.
#[derive(Debug, Default)]
pub struct Data {
    /// Trajectories of the runs that succeeded.
    pub runs: BTreeMap<RunKey, Trajectory>,
    /// Exact solutions.
    pub exact: BTreeMap<CaseName, Trajectory>,
    /// Settings of the runs.
    pub settings: BTreeMap<RunKey, Settings>,
    /// The runs are those of `--quick`; the figures say so.
    pub quick: bool,
}

impl Data {
    /// The runs a figure shows, those that exist.
    pub fn runs_of(&self, figure: FigureName) -> Vec<(Approach, &Trajectory)> {
        let run = |approach| self.runs.get(&RunKey { case: figure.case(), approach });
        figure.approaches().into_iter().filter_map(|approach| Some((approach, run(approach)?))).collect()
    }

    /// Notes for the reader of the figure: missing runs, reduced settings.
    pub fn notes(&self, figure: FigureName) -> Vec<String> {
        let mut notes = Vec::new();
        if self.quick {
            notes.push("Computed with --quick: coarse mesh and large time steps.".to_owned());
        }
        let gluey = RunKey { case: figure.case(), approach: Approach::Gluey };
        if let Some(settings) = self.settings.get(&gluey).filter(|_| !figure.approaches().is_empty()) {
            notes.extend(settings.figure_notes());
        }
        if figure.case() == CaseName::Trio2d && !figure.approaches().is_empty() {
            notes.push(
                "Box periodic in *x*; exact and unfitted beside it: Couette flow on all sides, to *t* = 12."
                    .to_owned(),
            );
        }
        let missing: Vec<&str> = figure
            .approaches()
            .into_iter()
            .filter(|&approach| !self.runs.contains_key(&RunKey { case: figure.case(), approach }))
            .map(legend)
            .collect();
        if !missing.is_empty() {
            notes.push(format!("Missing, because the run failed: {}.", missing.join(", ")));
        }
        notes
    }
}

/// Line of a way of computing: the paper's styles, and colours that stay apart for colour-blind readers.
pub fn stroke(approach: Approach) -> Stroke {
    match approach {
        Approach::Gluey => Stroke { color: "#0b4f9e", width: 1.8, dashes: None },
        Approach::Inelastic => Stroke { color: "#c8471b", width: 1.8, dashes: Some("9 4") },
        Approach::None => Stroke { color: "#1b7f4d", width: 1.8, dashes: Some("9 3 2 3") },
        Approach::GlueyAsPrinted | Approach::GlueyAsPrintedLargeStep => {
            Stroke { color: "#c79a00", width: 1.8, dashes: Some("1.5 1.5 6 1.5") }
        }
        Approach::Unfitted => Stroke { color: "#8a3ea0", width: 1.8, dashes: Some("2 2.5") },
        Approach::UnfittedPeriodic => Stroke { color: "#cc79a7", width: 1.8, dashes: Some("5 2.5") },
    }
}

/// Thin grey line of exact solutions.
pub const EXACT_STROKE: Stroke = Stroke { color: "#8c8c8c", width: 1.0, dashes: None };

/// Name of a way of computing in legends.
pub fn legend(approach: Approach) -> &'static str {
    match approach {
        Approach::Gluey => "gluey contact",
        Approach::Inelastic => "inelastic collision",
        Approach::None => "no correction",
        Approach::GlueyAsPrinted => "gluey contact as printed",
        Approach::GlueyAsPrintedLargeStep => "gluey contact as printed, twice the time step",
        Approach::Unfitted => "unfitted, no contact",
        Approach::UnfittedPeriodic => "unfitted, no contact, in the box of the paper's runs",
    }
}

/// A curve of an exact solution.
pub fn exact_curve(label: &str, pieces: Vec<Vec<(f64, f64)>>) -> Curve {
    Curve { label: Some(label.to_owned()), stroke: EXACT_STROKE, pieces }
}
