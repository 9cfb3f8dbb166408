//! The rows under each figure: the paper's statements about it, its distance from the exact solution, what
//! holds by construction.
//!
//! Every sentence of section 3 of Verdon et al. (2010) that says what figures 5 to 11 show is a row. The
//! number that decides it and its limit are ours: the paper gives a few numbers and no data.

mod pair_2d;
mod pair_3d;
mod trio;

use std::collections::BTreeMap;

use gluey::RunReport;
use gluey_verify::Wanted;

use super::known::Mode;
use super::plan::{Approach, CaseName, FigureName, RunKey};
use super::trajectory::Trajectory;
use super::verdict::{Claim, Kind, Row};
use crate::figures::Data;

/// Gaps under a contact model that is exact at the end of the step may be negative by round-off only, in
/// radii.
const ROUND_OFF_GAP: f64 = -1e-10;
/// Radius of the particles in units of the box.
pub const RADIUS: f64 = 0.05;

/// Everything a row may look at.
pub struct Evidence<'a> {
    /// Trajectories, exact and computed.
    pub data: &'a Data,
    /// Reports of the runs that succeeded.
    pub reports: &'a BTreeMap<RunKey, RunReport>,
}

impl Evidence<'_> {
    /// A run that reached its end; one that is too short is as good as none.
    pub fn run(&self, case: CaseName, approach: Approach) -> Option<&Trajectory> {
        let key = RunKey { case, approach };
        let (run, settings) = (self.data.runs.get(&key)?, self.data.settings.get(&key)?);
        (run.end() >= settings.end * (1.0 - 1e-9)).then_some(run)
    }

    /// The exact solution of a case.
    pub fn exact(&self, case: CaseName) -> Option<&Trajectory> {
        self.data.exact.get(&case)
    }

    fn report(&self, case: CaseName, approach: Approach) -> Option<&RunReport> {
        self.run(case, approach)?;
        self.reports.get(&RunKey { case, approach })
    }

    /// How much was computed.
    pub fn mode(&self) -> Mode {
        Mode::of(self.data.quick)
    }

    /// One of two limits: that of the full computation, or that of `--quick`, whose meshes and steps are
    /// coarser.
    fn limit(&self, full: f64, quick: f64) -> f64 {
        if self.data.quick { quick } else { full }
    }
}

/// The rows of the chosen figures.
pub fn all(figures: &[FigureName], evidence: &Evidence<'_>) -> Vec<Row> {
    let mode = evidence.mode();
    let of_figure = |&figure: &FigureName| {
        let claims = claims(figure, evidence).into_iter();
        claims.filter(|claim| mode == Mode::Full || !claim.full_only).map(move |c| c.judge(figure, mode))
    };
    figures.iter().flat_map(of_figure).collect()
}

fn claims(figure: FigureName, evidence: &Evidence<'_>) -> Vec<Claim> {
    match figure {
        FigureName::Limit | FigureName::Fig4 | FigureName::Fig8 => Vec::new(),
        FigureName::Fig5 => pair_2d::distances(evidence),
        FigureName::Fig6 => pair_2d::orbits(evidence),
        FigureName::Fig7a => pair_3d::distances(evidence),
        FigureName::Fig7b => pair_3d::paths(evidence),
        FigureName::Fig9 => trio::distances(evidence),
        FigureName::Fig10 => trio::without_correction(evidence),
        FigureName::Fig11 => trio::inelastic(evidence),
    }
}

/// A measure and its number; `None` if it could not be measured.
struct Measured {
    what: &'static str,
    value: Option<f64>,
}

fn measured(what: &'static str, value: Option<f64>) -> Measured {
    Measured { what, value }
}

/// A statement of the paper in short, with the number that decides it.
fn paper(
    id: &'static str,
    statement: &'static str,
    run: &'static str,
    measured: Measured,
    wanted: Wanted,
) -> Claim {
    let Measured { what: measure, value } = measured;
    Claim { id, kind: Kind::Paper, statement, run, measure, value, wanted, full_only: false }
}

/// A comparison with an exact solution.
fn exact(id: &'static str, run: &'static str, measured: Measured, wanted: Wanted) -> Claim {
    Claim { kind: Kind::Exact, ..paper(id, "As in the exact solution.", run, measured, wanted) }
}

/// No pair overlaps, because the contact model does not let it.
fn no_overlap(id: &'static str, run: &'static str, smallest_gap: Option<f64>) -> Claim {
    let statement = "Particles do not overlap: the contact constraint forbids it.";
    let wanted = Wanted::AtLeast(ROUND_OFF_GAP);
    Claim {
        kind: Kind::Guarantee,
        ..paper(id, statement, run, measured("smallest D/a", smallest_gap), wanted)
    }
}

/// No pair overlaps where no contact acts, because films in balance do not let it.
fn films_hold(id: &'static str, run: &'static str, smallest_gap: Option<f64>) -> Claim {
    let statement = "Particles do not overlap: films keep them apart, no contact acts.";
    let wanted = Wanted::AtLeast(0.0);
    Claim { statement, wanted, ..no_overlap(id, run, smallest_gap) }
}

#[cfg(test)]
mod tests;
