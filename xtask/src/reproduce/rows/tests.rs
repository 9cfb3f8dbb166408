//! Rows can fail: by a wrong run, by a missing one and by one that is too short.

use std::collections::BTreeMap;

use super::*;
use crate::reproduce::figures::Data;
use crate::reproduce::plan::{Approach, CaseName, RunKey};
use crate::reproduce::reference;
use crate::reproduce::settings::Settings;
use crate::reproduce::verdict::ClaimKind;
use clap::ValueEnum;
use gluey::RunReport;
use gluey_verify::Judgement;

const RUNS: [(CaseName, f64); 3] =
    [(CaseName::Pair2d, 30.0), (CaseName::Pair3d, 16.8), (CaseName::Trio2d, 12.0)];

/// Data for [`Evidence`] with the exact solutions as if `unfitted` had computed them, with a clock that is
/// `shift` slow.
struct Exact {
    data: Data,
    reports: BTreeMap<RunKey, RunReport>,
}

impl Exact {
    fn new(shift: f64, planned_end: impl Fn(f64) -> f64) -> Self {
        let mut data = Data::default();
        for (case, end) in RUNS {
            let key = RunKey { case, approach: Approach::Unfitted };
            let exact = reference::load(case, 30.0).unwrap();
            let mut run = exact.clone();
            run.times.iter_mut().for_each(|t| *t *= 1.0 + shift);
            data.runs.insert(key, run);
            data.exact.insert(case, exact);
            let none = String::new;
            let (flow, contact, domain) = (none(), none(), none());
            let end = planned_end(end);
            let own = Settings { flow, contact, domain, cells_per_radius: 1.0, time_step: 0.1, end };
            data.settings.insert(key, own);
        }
        Self { data, reports: BTreeMap::new() }
    }

    /// The rows that compare `unfitted` with the exact solutions, but for the one that is read from a
    /// report.
    fn rows(&self) -> Vec<JudgedClaim> {
        let evidence = Evidence { data: &self.data, reports: &self.reports };
        let mut rows = all(FigureName::value_variants(), &evidence);
        rows.retain(|row| row.claim.kind == ClaimKind::Exact && row.claim.run.ends_with("unfitted"));
        rows.retain(|row| row.claim.id != "fig7a-reversibility-unfitted");
        rows
    }
}

#[test]
fn the_exact_solutions_agree_with_themselves() {
    let rows = Exact::new(0.0, |end| end).rows();
    assert_eq!(rows.len(), 9);
    assert!(rows.iter().all(|row| row.outcome == Judgement::Yes), "{rows:#?}");
}

#[test]
fn a_clock_ten_percent_slow_is_noticed() {
    let rows = Exact::new(0.1, |end| end).rows();
    // The shape of the orbit and the smallest gap do not know the time, and the doublet's gap varies by 4e-5
    // a only.
    let timeless = ["fig5-distance-unfitted", "fig6-circle-unfitted", "fig7a-smallest-unfitted"];
    for row in rows.iter().filter(|row| !timeless.contains(&&*row.claim.id)) {
        assert_eq!(row.outcome, Judgement::No, "{row:#?}");
    }
}

#[test]
fn a_run_that_ends_too_early_measures_nothing() {
    for row in Exact::new(0.0, |end| 2.0 * end).rows() {
        assert_eq!((row.outcome, row.value), (Judgement::NotMeasured, None), "{row:#?}");
    }
}

#[test]
fn missing_runs_are_failures() {
    let (data, reports) = (Data::default(), BTreeMap::new());
    let rows = all(FigureName::value_variants(), &Evidence { data: &data, reports: &reports });
    assert!(rows.len() > 40 && rows.iter().all(JudgedClaim::is_failure), "{rows:#?}");
}

#[test]
fn every_figure_with_runs_has_statements_and_every_row_its_own_name() {
    let (data, reports) = (Data::default(), BTreeMap::new());
    let rows = all(FigureName::value_variants(), &Evidence { data: &data, reports: &reports });
    for figure in FigureName::all().filter(|figure| !figure.approaches().is_empty()) {
        let statements =
            rows.iter().filter(|row| row.claim.figure == figure && row.claim.kind == ClaimKind::Paper);
        assert!(statements.count() >= 2, "{figure}");
    }
    let mut names: Vec<&str> = rows.iter().map(|row| &*row.claim.id).collect();
    names.sort_unstable();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
    let columns = FigureName::all().flat_map(|figure| &text(figure).columns).map(|name| &**name);
    for name in claims().iter().map(|claim| &*claim.measure).chain(columns) {
        assert!(measure(name).is_some(), "nothing measures `{name}`");
    }
    assert!(claims().iter().all(|claim| claim.own_run().is_some()), "a row without a run");
}
