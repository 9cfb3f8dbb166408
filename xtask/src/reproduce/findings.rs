//! For each figure a table of the exact solution beside the runs.

use super::figures;
use super::plan::{Approach, FigureName};
use super::rows::{Evidence, RunView, measure, text};
use super::trajectory::Trajectory;

/// A table of numbers: one row a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureTable {
    /// Names of the columns after the first.
    pub columns: &'static [String],
    /// Name of the curve and its numbers.
    pub rows: Vec<(String, Vec<Option<f64>>)>,
}

/// The numbers of a figure, the exact solution in the first row; `None` for set-ups.
pub fn table(figure: FigureName, evidence: &Evidence<'_>) -> Option<FigureTable> {
    let columns = &text(figure).columns;
    let (case, exact) = (figure.case(), evidence.exact(figure.case()));
    let row = |name: &str, run: &Trajectory, approach: Option<Approach>| {
        let view = RunView { run, exact, case, approach, evidence };
        (name.to_owned(), columns.iter().map(|column| measure(column)?(&view)).collect())
    };
    let mut rows: Vec<_> = exact.map(|exact| row("exact", exact, None)).into_iter().collect();
    for key in figure.runs().into_iter().filter(|key| key.case == case) {
        let run = evidence.data.runs.get(&key);
        rows.extend(run.map(|run| row(figures::legend(key.approach), run, Some(key.approach))));
    }
    (!columns.is_empty()).then_some(FigureTable { columns, rows })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduce::figures::Data;
    use crate::reproduce::plan::CaseName;
    use crate::reproduce::reference;
    use std::collections::BTreeMap;

    #[test]
    fn the_exact_row_has_no_error_against_itself() {
        let mut data = Data::default();
        let exact = reference::load(CaseName::Pair3d, 30.0).unwrap();
        data.exact.insert(CaseName::Pair3d, exact);
        let reports = BTreeMap::new();
        let evidence = Evidence { data: &data, reports: &reports };
        let table = table(FigureName::Fig7a, &evidence).unwrap();
        assert_eq!(table.rows.len(), 1);
        assert_eq!(table.rows[0].1[4], Some(0.0));
        assert!((table.rows[0].1[0].unwrap() - 3.38e-3).abs() < 1e-5);
    }
}
