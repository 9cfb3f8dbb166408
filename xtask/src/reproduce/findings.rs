//! For each figure: its title, and a table of the exact solution beside the runs.

use std::f64::consts::PI;

use super::measures::{
    self, center_deviation, closest_approach, distance_from_center, gap_deviation, time_to_turn,
};
use super::plan::{Approach, CaseName, FigureName, RunKey};
use super::rows::{Evidence, RADIUS};
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
        FigureName::Limit => "Section 2.5: gluey contact as the limit of lubrication",
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
    for key in figure.runs().into_iter().filter(|key| key.case == figure.case()) {
        if let Some(run) = evidence.data.runs.get(&key) {
            rows.push(row(figures::legend(key.approach), run, Some(key)));
        }
    }
    Some(Table { columns: measures.iter().map(|(name, _)| (*name).to_owned()).collect(), rows })
}

/// Data from which a column of a table is computed.
struct View<'a> {
    run: &'a Trajectory,
    exact: Option<&'a Trajectory>,
    key: Option<RunKey>,
    evidence: &'a Evidence<'a>,
}

type Measure = fn(&View<'_>) -> Option<f64>;

fn measures_of(figure: FigureName) -> Vec<(&'static str, Measure)> {
    match figure {
        FigureName::Limit | FigureName::Fig4 | FigureName::Fig8 => Vec::new(),
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
            ("largest distance from gluey contact / a", |v| {
                let gluey = RunKey { case: CaseName::Trio2d, approach: Approach::Gluey };
                Some(center_deviation(v.run, v.evidence.data.runs.get(&gluey)?, f64::INFINITY)? / RADIUS)
            }),
        ],
    }
}

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
        let reports = BTreeMap::new();
        let evidence = Evidence { data: &data, reports: &reports };
        let table = table(FigureName::Fig7a, &evidence).unwrap();
        assert_eq!(table.rows.len(), 1);
        assert_eq!(table.rows[0].1[4], Some(0.0));
        assert!((table.rows[0].1[0].unwrap() - 3.38e-3).abs() < 1e-5);
    }
}
