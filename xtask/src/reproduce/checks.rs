//! What the runs must show: the paper's findings and the distance from the exact solutions, as numbers with limits.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use gluey::RunReport;
use serde::Serialize;

use super::measures::{
    self, center_deviation, closest_approach, distance_from_center, gap_deviation, time_to_turn,
};
use super::plan::{Approach, CaseName, FigureName, RunKey};
use super::reference::{CLOSEST_APPROACH_TIME, DOUBLET_RADIUS, HALF_TURN_TIME};
use super::trajectory::Trajectory;
use crate::figures::Data;

/// Gaps of an exact-gap contact model may be negative by round-off only, in radii.
const ROUND_OFF_GAP: f64 = -1e-10;
/// A particle of the doublet is on its circle if its distance from the box centre is right to this, relative.
const CIRCLE_BAND: f64 = 0.005;
/// Radius of the particles in units of the box.
const RADIUS: f64 = 0.05;

/// One statement about a run, with the number that decides it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// The figure under which it is shown.
    pub figure: String,
    /// The run it is about.
    pub run: String,
    /// What is measured.
    pub name: String,
    /// The number; `None` if the run failed or is too short.
    pub value: Option<f64>,
    /// What the number should be.
    pub wanted: String,
    /// Whether it is.
    pub ok: bool,
}

/// An interval of wanted values.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    AtLeast(f64),
    AtMost(f64),
    Between(f64, f64),
    Reported,
}

impl Wanted {
    fn holds(self, value: f64) -> bool {
        match self {
            Self::AtLeast(low) => value >= low,
            Self::AtMost(high) => value <= high,
            Self::Between(low, high) => (low..=high).contains(&value),
            Self::Reported => value.is_finite(),
        }
    }

    fn text(self) -> String {
        match self {
            Self::AtLeast(low) => format!("at least {}", short(low)),
            Self::AtMost(high) => format!("at most {}", short(high)),
            Self::Between(low, high) => format!("between {} and {}", short(low), short(high)),
            Self::Reported => "reported only".to_owned(),
        }
    }
}

/// A number in few characters.
fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:e}") } else { format!("{value}") }
}

/// Everything a check may look at.
pub struct Evidence<'a> {
    /// Trajectories, exact and computed.
    pub data: &'a Data,
    /// Reports of the runs that succeeded.
    pub reports: &'a BTreeMap<RunKey, RunReport>,
}

/// All checks of the chosen figures.
pub fn all(figures: &[FigureName], evidence: &Evidence<'_>) -> Vec<Check> {
    figures.iter().flat_map(|&figure| of_figure(figure, evidence)).collect()
}

fn of_figure(figure: FigureName, evidence: &Evidence<'_>) -> Vec<Check> {
    let list = List { figure, evidence };
    match figure {
        FigureName::Fig5 => pair_2d_gaps(&list),
        FigureName::Fig6 => pair_2d_paths(&list),
        FigureName::Fig7a => pair_3d_gaps(&list),
        FigureName::Fig9 => trio_gaps(&list),
        FigureName::Fig10 => trio_paths(&list),
        FigureName::Fig4 | FigureName::Fig7b | FigureName::Fig8 | FigureName::Fig11 => Vec::new(),
    }
}

fn pair_2d_gaps(list: &List<'_>) -> Vec<Check> {
    let half_turn = |run: &Trajectory| Some(time_to_turn(run, -PI)? / HALF_TURN_TIME - 1.0);
    let name = "time of half a turn, relative error";
    vec![
        list.smallest_gap(Approach::None, Wanted::Between(-0.1, -0.003)),
        list.smallest_gap(Approach::Gluey, Wanted::AtLeast(ROUND_OFF_GAP)),
        list.smallest_gap(Approach::GlueyRigidDofs, Wanted::AtLeast(ROUND_OFF_GAP)),
        list.of_run(Approach::Gluey, name, Wanted::Between(-0.03, 0.03), half_turn),
        list.of_run(Approach::GlueyRigidDofs, name, Wanted::Between(-0.01, 0.01), half_turn),
    ]
}

fn pair_2d_paths(list: &List<'_>) -> Vec<Check> {
    let last_turn = |run: &Trajectory| distance_from_center(run, run.end() - 2.0 * HALF_TURN_TIME);
    let off_circle = |(low, high): (f64, f64)| (high / DOUBLET_RADIUS - 1.0).max(1.0 - low / DOUBLET_RADIUS);
    let name = "distance from the box centre, largest relative deviation from 0.05001";
    vec![
        list.of_run(Approach::Gluey, name, Wanted::AtMost(CIRCLE_BAND), |run| {
            distance_from_center(run, 0.0).map(off_circle)
        }),
        list.of_run(
            Approach::Inelastic,
            "least distance from the box centre, last turn",
            Wanted::Reported,
            |run| Some(last_turn(run)?.0),
        ),
        list.of_run(
            Approach::Inelastic,
            "greatest distance from the box centre, last turn",
            Wanted::Reported,
            |run| Some(last_turn(run)?.1),
        ),
        list.of_run(
            Approach::Inelastic,
            "the same deviation, last turn: the particles leave the circle",
            Wanted::AtLeast(CIRCLE_BAND),
            |run| last_turn(run).map(off_circle),
        ),
    ]
}

fn pair_3d_gaps(list: &List<'_>) -> Vec<Check> {
    let mut checks = vec![list.smallest_gap(Approach::None, Wanted::AtMost(0.0))];
    for approach in [Approach::Gluey, Approach::GlueyRigidDofs] {
        checks.push(list.smallest_gap(approach, Wanted::AtLeast(ROUND_OFF_GAP)));
        checks.push(
            list.of_report(approach, "reversibility error", Wanted::AtMost(0.02), |r| r.reversibility_error),
        );
    }
    let end_gap = |key| measures::last_gap(list.evidence.data.runs.get(&key)?, (1, 2));
    let gluey_end = end_gap(RunKey { case: CaseName::Pair3d, approach: Approach::Gluey });
    checks.push(list.of_run(
        Approach::Inelastic,
        "end distance, relative difference from gluey contact",
        Wanted::AtLeast(0.15),
        |run| {
            let (own, gluey) = (measures::last_gap(run, (1, 2))?, gluey_end?);
            Some((own - gluey).abs() / gluey)
        },
    ));
    let exact = list.evidence.data.exact.get(&CaseName::Pair3d);
    checks.push(list.of_run(
        Approach::GlueyRigidDofs,
        "D(t), largest relative deviation while D > a",
        Wanted::AtMost(0.03),
        |run| gap_deviation(run, exact?, 1.0),
    ));
    checks.push(list.of_run(
        Approach::GlueyRigidDofs,
        "time of closest approach, relative error",
        Wanted::Between(-0.015, 0.015),
        |run| Some(closest_approach(run)? / CLOSEST_APPROACH_TIME - 1.0),
    ));
    checks
}

fn trio_gaps(list: &List<'_>) -> Vec<Check> {
    let largest = |run: &Trajectory| measures::largest_gap(run, (1, 2));
    let last = |run: &Trajectory| measures::last_gap(run, (1, 2));
    vec![
        list.of_run(Approach::Gluey, "largest gap of particles 1 and 2, D/a", Wanted::AtMost(0.05), largest),
        list.smallest_gap(Approach::Gluey, Wanted::AtLeast(ROUND_OFF_GAP)),
        list.smallest_gap(Approach::GlueyRigidDofs, Wanted::AtLeast(ROUND_OFF_GAP)),
        list.smallest_gap(Approach::None, Wanted::AtMost(0.0)),
        list.of_run(
            Approach::Inelastic,
            "gap of particles 1 and 2 at the end, D/a",
            Wanted::AtLeast(0.05),
            last,
        ),
    ]
}

fn trio_paths(list: &List<'_>) -> Vec<Check> {
    let exact = list.evidence.data.exact.get(&CaseName::Trio2d);
    let deviation = |until: f64| move |run: &Trajectory| Some(center_deviation(run, exact?, until)? / RADIUS);
    let name =
        |until: f64| format!("largest distance of a centre from the exact one to t = {until}, in radii");
    vec![
        list.of_run(Approach::GlueyRigidDofs, &name(6.0), Wanted::AtMost(0.15), deviation(6.0)),
        list.of_run(Approach::GlueyRigidDofs, &name(12.0), Wanted::Reported, deviation(12.0)),
    ]
}

/// Makes the checks of one figure.
struct List<'a> {
    figure: FigureName,
    evidence: &'a Evidence<'a>,
}

impl List<'_> {
    fn smallest_gap(&self, approach: Approach, wanted: Wanted) -> Check {
        self.of_report(approach, "smallest gap D/a", wanted, |report| report.min_gap_over_a)
    }

    fn of_report(
        &self,
        approach: Approach,
        name: &str,
        wanted: Wanted,
        measure: impl Fn(&RunReport) -> Option<f64>,
    ) -> Check {
        self.check(approach, name, wanted, self.evidence.reports.get(&self.key(approach)).and_then(measure))
    }

    fn of_run(
        &self,
        approach: Approach,
        name: &str,
        wanted: Wanted,
        measure: impl Fn(&Trajectory) -> Option<f64>,
    ) -> Check {
        self.check(approach, name, wanted, self.evidence.data.runs.get(&self.key(approach)).and_then(measure))
    }

    fn key(&self, approach: Approach) -> RunKey {
        RunKey { case: self.figure.case(), approach }
    }

    fn check(&self, approach: Approach, name: &str, wanted: Wanted, value: Option<f64>) -> Check {
        let value = value.filter(|value| value.is_finite());
        Check {
            figure: self.figure.to_string(),
            run: self.key(approach).name(),
            name: name.to_owned(),
            value,
            wanted: wanted.text(),
            ok: value.is_some_and(|value| wanted.holds(value)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduce::reference;

    /// The exact solutions as if `rigid-dofs` had computed them.
    fn exact_as_run(shift: f64) -> Data {
        let mut data = Data::default();
        for case in [CaseName::Pair2d, CaseName::Pair3d, CaseName::Trio2d] {
            let exact = reference::load(&crate::workspace_root(), case, 30.0).unwrap();
            let mut run = exact.clone();
            run.times.iter_mut().for_each(|t| *t *= 1.0 + shift);
            data.runs.insert(RunKey { case, approach: Approach::GlueyRigidDofs }, run);
            data.exact.insert(case, exact);
        }
        data
    }

    fn rigid_dofs_checks(data: &Data) -> Vec<Check> {
        let checks = all(&FigureName::ALL, &Evidence { data, reports: &BTreeMap::new() });
        checks.into_iter().filter(|c| c.run.ends_with("rigid-dofs") && c.value.is_some()).collect()
    }

    #[test]
    fn the_exact_solutions_pass_their_own_checks() {
        let checks = rigid_dofs_checks(&exact_as_run(0.0));
        assert_eq!(checks.len(), 5);
        assert!(checks.iter().all(|check| check.ok), "{checks:#?}");
    }

    #[test]
    fn a_clock_ten_percent_slow_fails_them() {
        let checks = rigid_dofs_checks(&exact_as_run(0.1));
        let bad = checks.iter().filter(|check| !check.ok).count();
        assert_eq!(bad, checks.len() - 1, "all but the one that is only reported: {checks:#?}");
    }

    #[test]
    fn a_missing_run_is_not_ok() {
        let checks =
            all(&[FigureName::Fig5], &Evidence { data: &Data::default(), reports: &BTreeMap::new() });
        assert!(checks.len() >= 5 && checks.iter().all(|check| !check.ok && check.value.is_none()));
    }
}
