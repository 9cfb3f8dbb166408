//! What is measured in runs, by the names that rows and tables have for it.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use gluey::RunReport;

use crate::reproduce::figures::Data;
use crate::reproduce::measures::*;
use crate::reproduce::plan::{Approach, CaseName, RunKey};
use crate::reproduce::reference::{CLOSEST_APPROACH_TIME, HALF_TURN_TIME};
use crate::reproduce::trajectory::Trajectory;

/// Radius of the particles in units of the box.
const RADIUS: f64 = 0.05;
const PAIR: (usize, usize) = (1, 2);
const TO_THE_END: f64 = f64::INFINITY;

/// Everything a row may look at.
pub struct Evidence<'a> {
    /// Trajectories, exact and computed.
    pub data: &'a Data,
    /// Reports of the runs that succeeded.
    pub reports: &'a BTreeMap<RunKey, RunReport>,
}

impl Evidence<'_> {
    /// A run that reached its end; one that is too short is as good as none.
    pub fn run(&self, case: CaseName, approach: Approach) -> Option<RunView<'_>> {
        let key = RunKey { case, approach };
        let (run, settings) = (self.data.runs.get(&key)?, self.data.settings.get(&key)?);
        let is_whole = run.end() >= settings.end * (1.0 - 1e-9);
        let (exact, approach) = (self.exact(case), Some(approach));
        is_whole.then_some(RunView { run, exact, case, approach, evidence: self })
    }

    /// The exact solution of a case.
    pub fn exact(&self, case: CaseName) -> Option<&Trajectory> {
        self.data.exact.get(&case)
    }
}

/// A run, or an exact solution, and what it may be compared with.
#[derive(Clone, Copy)]
pub struct RunView<'a> {
    /// Its trajectory.
    pub run: &'a Trajectory,
    /// The exact solution of its case.
    pub exact: Option<&'a Trajectory>,
    /// Its case.
    pub case: CaseName,
    /// The way it was computed.
    pub approach: Option<Approach>,
    /// All runs.
    pub evidence: &'a Evidence<'a>,
}

/// A number that a run has, if it can be measured.
pub type RunMeasure = fn(&RunView<'_>) -> Option<f64>;

/// The measure of this name.
pub fn measure(name: &str) -> Option<RunMeasure> {
    MEASURES.iter().find(|(own, _)| *own == name).map(|(_, measure)| *measure)
}

/// Gaps, then times, then places.
const MEASURES: &[(&str, RunMeasure)] = &[
    ("smallest D/a", smallest),
    ("smallest D/a of all pairs", smallest),
    ("smallest D/a, relative error", |v| Some(smallest(v)? / smallest_gap(v.exact?)? - 1.0)),
    ("largest D/a", largest),
    ("largest D12/a", largest),
    ("largest D/a after the deepest overlap", |v| largest_gap_after_smallest(v.run)),
    ("median of D12/a over the second half of the run", |v| median_gap(v.run, PAIR)),
    ("D/a at the end", |v| last_gap(v.run, PAIR)),
    ("D12/a at the end", |v| last_gap(v.run, PAIR)),
    ("D13/a at the end", |v| last_gap(v.run, (1, 3))),
    ("D23/a at the end", |v| last_gap(v.run, (2, 3))),
    ("D23/a at t = 30", |v| v.run.at(v.run.gap((2, 3))?, 30.0)),
    ("gap at the end from disc 3 to the nearer one of the others, in radii", |v| {
        Some(last_gap(v.run, (1, 3))?.min(last_gap(v.run, (2, 3))?))
    }),
    ("D at the end, relative difference", |v| {
        let gluey = last_gap(v.beside(Approach::Gluey)?.run, PAIR)?;
        Some((last_gap(v.run, PAIR)? - gluey).abs() / gluey)
    }),
    ("largest difference of D at all times when it is positive, over the largest D", |v| {
        Some(gap_difference_while_apart(v.run, v.beside(Approach::Gluey)?.run)? / largest(v)?)
    }),
    ("largest D/a while pair-2d-gluey is in contact", largest_in_contact),
    ("the same, over that with twice the time step", |v| {
        Some(largest_in_contact(v)? / largest_in_contact(&v.beside(Approach::GlueyAsPrintedLargeStep)?)?)
    }),
    ("largest error of D/a", |v| gap_error(v.run, v.exact?, v.run.end(), f64::INFINITY)),
    ("D(t)/a, largest error while D < 0.2 a", |v| gap_error(v.run, v.exact?, v.exact?.end(), 0.2)),
    ("largest relative error of D while D > a", |v| gap_deviation(v.run, v.exact?, 1.0)),
    ("D(t), largest relative error while D > 0.2 a (2 % is the error of the exact data)", |v| {
        gap_deviation(v.run, v.exact?, 0.2)
    }),
    ("reversibility error", reversibility),
    ("reversibility error: |D(t* + s) - D(t* - s)| / D(t* - s)", reversibility),
    (
        "reversibility error, over that with twice the time step (of the six pairs of 1, 2, 3 and 4 times the step the only one \
         that agrees)",
        |v| Some(reversibility(v)? / reversibility(&v.beside(Approach::GlueyAsPrintedLargeStep)?)?),
    ),
    ("half a turn at t", |v| time_to_turn(v.run, -PI)),
    ("time of half a turn, relative error", |v| Some(time_to_turn(v.run, -PI)? / HALF_TURN_TIME - 1.0)),
    ("closest at t", |v| closest_approach(v.run)),
    ("time of closest approach, relative error", |v| {
        Some(closest_approach(v.run)? / CLOSEST_APPROACH_TIME - 1.0)
    }),
    ("least distance from the centre", |v| Some(distance_from_center(v.run, 0.0)?.0)),
    ("greatest distance from the centre", |v| Some(distance_from_center(v.run, 0.0)?.1)),
    ("greatest over least distance from the box centre", |v| orbit_ratio(v.run, 0.0)),
    ("greatest over least distance from the box centre, last turn", |v| {
        orbit_ratio(v.run, v.run.end() - 2.0 * HALF_TURN_TIME)
    }),
    ("offset of sphere 1 at the end, y − 1/2", |v| Some(v.run.centers[0].last()?[1] - 0.5)),
    // An exact encounter ends as far from the plane y = 1/2 as it began.
    ("relative change of sphere 1's distance from the plane y = 1/2", |v| {
        let path = &v.run.centers[0];
        Some(((path.last()?[1] - 0.5) / (path.first()?[1] - 0.5) - 1.0).abs())
    }),
    ("largest distance of the middle of particles 1 and 2 from the mid-plane, in radii", |v| {
        Some(offset_of_the_pair(v.run)? / RADIUS)
    }),
    ("largest distance from gluey contact / a", off_gluey),
    ("largest distance between the centres, in radii", off_gluey),
    ("the same distance, over that of two particles", |v| {
        Some(off_gluey(v)? / off_gluey(&v.evidence.run(CaseName::Pair2d, v.approach?)?)?)
    }),
    ("largest distance from the exact position / a", |v| off_exact(v, TO_THE_END)),
    ("largest distance of a centre from the exact one, in radii", |v| off_exact(v, TO_THE_END)),
    // To the time up to which the exact data are checked.
    ("largest distance from the exact position / a, to t = 6", |v| off_exact(v, 6.0)),
    ("largest distance of a centre from the exact one to t = 6, in radii", |v| off_exact(v, 6.0)),
];

impl RunView<'_> {
    /// Another run of its case.
    fn beside(&self, approach: Approach) -> Option<RunView<'_>> {
        self.evidence.run(self.case, approach)
    }
}

fn smallest(v: &RunView<'_>) -> Option<f64> {
    smallest_gap(v.run)
}

fn largest(v: &RunView<'_>) -> Option<f64> {
    largest_gap(v.run, PAIR)
}

fn largest_in_contact(v: &RunView<'_>) -> Option<f64> {
    largest_gap_while_touching(v.run, v.beside(Approach::Gluey)?.run)
}

fn reversibility(v: &RunView<'_>) -> Option<f64> {
    v.evidence.reports.get(&RunKey { case: v.case, approach: v.approach? })?.reversibility_error
}

fn off_exact(v: &RunView<'_>, until: f64) -> Option<f64> {
    Some(center_deviation(v.run, v.exact?, until)? / RADIUS)
}

fn off_gluey(v: &RunView<'_>) -> Option<f64> {
    Some(center_deviation(v.run, v.beside(Approach::Gluey)?.run, TO_THE_END)? / RADIUS)
}
