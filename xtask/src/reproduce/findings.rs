//! For each figure: what the paper says, and a table of the exact solution beside the runs.

use std::f64::consts::PI;

use super::checks::{Check, Evidence};
use super::measures::{
    self, center_deviation, closest_approach, distance_from_center, gap_deviation, time_to_turn,
};
use super::plan::{Approach, CaseName, FigureName, RunKey};
use super::trajectory::Trajectory;
use crate::figures;

/// A table of numbers: one row a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Names of the columns after the first.
    pub columns: Vec<String>,
    /// Name of the curve and its numbers.
    pub rows: Vec<(String, Vec<Option<f64>>)>,
}

/// Title of a figure.
pub fn title(figure: FigureName) -> &'static str {
    match figure {
        FigureName::Fig4 => "Figure 4: set-up, two particles in a shear flow",
        FigureName::Fig5 => "Figure 5: two discs, distance over time",
        FigureName::Fig6 => "Figure 6: two discs, trajectories",
        FigureName::Fig7a => "Figure 7a: two spheres, distance over time",
        FigureName::Fig7b => "Figure 7b: two spheres, trajectories",
        FigureName::Fig8 => "Figure 8: set-up, three particles in a shear flow",
        FigureName::Fig9 => "Figure 9: three discs, distances over time",
        FigureName::Fig10 => "Figure 10: three discs, gluey contact and no correction",
        FigureName::Fig11 => "Figure 11: three discs, gluey contact and inelastic collision",
    }
}

/// What the paper (Verdon et al. 2010, section 3) says about a figure.
pub fn paper_statement(figure: FigureName) -> &'static str {
    match figure {
        FigureName::Fig4 | FigureName::Fig8 => "Particles of radius a = 0.05 in a unit box, shear rate 1.",
        FigureName::Fig5 => {
            "Without correction the particles overlap by more than 0.01 a and come apart again; gluey contact keeps them \
             from overlapping; inelastic collisions let the distance grow."
        }
        FigureName::Fig6 => {
            "Gluey contact keeps the particles on a circle, the limit of zero distance; without correction they follow \
             it with small fluctuations; inelastic collisions throw them onto another, more elliptic orbit."
        }
        FigureName::Fig7a => {
            "Without correction the spheres overlap; inelastic collisions avoid that but the encounter is no longer \
             reversible; with gluey contact reversibility is almost recovered, the relative error of the distance at \
             the end is 6.5 %."
        }
        FigureName::Fig7b => {
            "Inelastic collisions modify the trajectories significantly; gluey contact does not."
        }
        FigureName::Fig9 => {
            "Particles 1 and 2 stay together with gluey contact and without correction; inelastic collisions separate \
             them. Without correction the third particle joins them by t = 30 (gap 2-3 below 0.01 a)."
        }
        FigureName::Fig10 => {
            "Without correction the particles overlap, so that the trajectories differ from those with gluey contact, \
             more than for two particles."
        }
        FigureName::Fig11 => {
            "The trajectories with inelastic collisions are quite different: the three particles no longer stay close \
             together."
        }
    }
}

/// One sentence that counts the checks of a figure; `None` if it has none.
pub fn verdict(figure: FigureName, checks: &[Check]) -> Option<String> {
    let own: Vec<&Check> = checks.iter().filter(|check| check.figure == figure.as_str()).collect();
    let failed: Vec<String> =
        own.iter().filter(|check| !check.ok).map(|check| format!("{}: {}", check.run, check.name)).collect();
    match (own.len(), failed.len()) {
        (0, _) => None,
        (count, 0) => Some(format!("checks that hold: {count} of {count}.")),
        (count, bad) => {
            Some(format!("checks that hold: {} of {count}; not: {}.", count - bad, failed.join("; ")))
        }
    }
}

/// The numbers of a figure, the exact solution in the first row; `None` for set-ups.
pub fn table(figure: FigureName, evidence: &Evidence<'_>) -> Option<Table> {
    let measures = measures_of(figure);
    if measures.is_empty() {
        return None;
    }
    let exact = evidence.data.exact.get(&figure.case());
    let row = |name: &str, run: &Trajectory, key: Option<RunKey>| {
        let view = View { run, exact, key, evidence };
        (name.to_owned(), measures.iter().map(|(_, measure)| measure(&view)).collect())
    };
    let mut rows: Vec<_> = exact.map(|exact| row("exact", exact, None)).into_iter().collect();
    for approach in figure.approaches() {
        let key = RunKey { case: figure.case(), approach };
        if let Some(run) = evidence.data.runs.get(&key) {
            rows.push(row(figures::legend(approach), run, Some(key)));
        }
    }
    Some(Table { columns: measures.iter().map(|(name, _)| (*name).to_owned()).collect(), rows })
}

/// What a column of a table is computed from.
struct View<'a> {
    run: &'a Trajectory,
    exact: Option<&'a Trajectory>,
    key: Option<RunKey>,
    evidence: &'a Evidence<'a>,
}

type Measure = fn(&View<'_>) -> Option<f64>;

fn measures_of(figure: FigureName) -> Vec<(&'static str, Measure)> {
    match figure {
        FigureName::Fig4 | FigureName::Fig8 => Vec::new(),
        FigureName::Fig5 => vec![
            ("smallest D/a", |v| measures::smallest_gap(v.run)),
            ("largest D/a", |v| measures::largest_gap(v.run, (1, 2))),
            ("half a turn at t", |v| time_to_turn(v.run, -PI)),
        ],
        FigureName::Fig6 => vec![
            ("least distance from the centre", |v| Some(distance_from_center(v.run, 0.0)?.0)),
            ("greatest distance from the centre", |v| Some(distance_from_center(v.run, 0.0)?.1)),
            ("largest distance from the exact position / a", off_exact_to_end),
        ],
        FigureName::Fig7a => vec![
            ("smallest D/a", |v| measures::smallest_gap(v.run)),
            ("closest at t", |v| closest_approach(v.run)),
            ("D/a at the end", |v| measures::last_gap(v.run, (1, 2))),
            ("reversibility error", |v| v.evidence.reports.get(&v.key?)?.reversibility_error),
            ("largest relative error of D while D > a", |v| gap_deviation(v.run, v.exact?, 1.0)),
        ],
        FigureName::Fig7b => vec![
            ("offset of sphere 1 at the end, y − 1/2", |v| Some(v.run.centers[0].last()?[1] - 0.5)),
            ("largest distance from the exact position / a", off_exact_to_end),
        ],
        FigureName::Fig9 => vec![
            ("smallest D/a of all pairs", |v| measures::smallest_gap(v.run)),
            ("largest D12/a", |v| measures::largest_gap(v.run, (1, 2))),
            ("D12/a at the end", |v| measures::last_gap(v.run, (1, 2))),
            ("D13/a at the end", |v| measures::last_gap(v.run, (1, 3))),
            ("D23/a at the end", |v| measures::last_gap(v.run, (2, 3))),
        ],
        FigureName::Fig10 | FigureName::Fig11 => vec![
            ("largest distance from the exact position / a, to t = 6", |v| off_exact(v, 6.0)),
            ("the same, to t = 12", |v| off_exact(v, 12.0)),
            ("largest distance from gluey contact / a", |v| {
                let gluey = RunKey { case: CaseName::Trio2d, approach: Approach::Gluey };
                Some(center_deviation(v.run, v.evidence.data.runs.get(&gluey)?, f64::INFINITY)? / RADIUS)
            }),
        ],
    }
}

/// Radius of the particles in units of the box.
const RADIUS: f64 = 0.05;

fn off_exact_to_end(view: &View<'_>) -> Option<f64> {
    off_exact(view, f64::INFINITY)
}

fn off_exact(view: &View<'_>, until: f64) -> Option<f64> {
    Some(center_deviation(view.run, view.exact?, until)? / RADIUS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::Data;
    use crate::reproduce::reference;
    use std::collections::BTreeMap;

    #[test]
    fn the_exact_row_has_no_error_against_itself() {
        let mut data = Data::default();
        let exact = reference::load(&crate::workspace_root(), CaseName::Pair3d, 30.0).unwrap();
        data.exact.insert(CaseName::Pair3d, exact);
        let table = table(FigureName::Fig7a, &Evidence { data: &data, reports: &BTreeMap::new() }).unwrap();
        assert_eq!(table.rows.len(), 1);
        assert_eq!(table.rows[0].1[4], Some(0.0));
        assert!((table.rows[0].1[0].unwrap() - 3.38e-3).abs() < 1e-5);
    }

    #[test]
    fn the_verdict_names_what_fails() {
        let check = |ok| Check {
            figure: "fig5".to_owned(),
            run: "pair-2d-none".to_owned(),
            name: "smallest gap".to_owned(),
            value: Some(1.0),
            wanted: "at most 0".to_owned(),
            ok,
        };
        assert_eq!(verdict(FigureName::Fig5, &[check(true)]).unwrap(), "checks that hold: 1 of 1.");
        assert!(verdict(FigureName::Fig5, &[check(true), check(false)]).unwrap().contains("pair-2d-none"));
        assert_eq!(verdict(FigureName::Fig6, &[check(true)]), None);
    }
}
