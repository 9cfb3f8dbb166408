//! `summary.json`: everything a program may want to know about a reproduction.

use std::path::Path;

use gluey::RunReport;
use gluey_verify::Judgement;
use serde::Serialize;

use super::plan::FigureName;
use super::settings::Settings;
use super::verdict::{Claim, ClaimKind, JudgedClaim, count};
use crate::book::BookFailure;

/// The content of `summary.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Version of gluey.
    pub version: &'static str,
    /// Computed with `--quick`.
    pub quick: bool,
    /// Wall time of everything, seconds.
    pub wall_s: f64,
    /// The figures drawn.
    pub figures: Vec<FigureName>,
    /// The runs that succeeded.
    pub runs: Vec<CompletedRun>,
    /// Runs, figures and files that failed.
    pub failures: Vec<BookFailure>,
    /// Rows under the figures.
    pub rows: Vec<JudgedClaim>,
}

/// A run that succeeded.
#[derive(Clone, Debug, Serialize)]
pub struct CompletedRun {
    /// Its name, that of its CSV file.
    pub name: String,
    /// Its settings.
    pub settings: Settings,
    /// Its result in numbers.
    pub report: RunReport,
}

impl Summary {
    /// Whether everything was computed and every row holds or is a known disagreement.
    pub fn succeeded(&self) -> bool {
        self.failures.is_empty() && !self.rows.iter().any(JudgedClaim::is_failure)
    }

    /// As indented JSON.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|json| json + "\n")
    }

    /// Says what was found: every row, counts, and what did not work.
    pub fn print(&self, out: &Path) {
        for row in &self.rows {
            let Claim { figure, statement, run, measure, kind, .. } = row.claim;
            let mark = match (row.outcome, row.reason().is_some(), kind) {
                (Judgement::NotMeasured, _, _) => "MISSING",
                (Judgement::No, true, _) => "no, known",
                (Judgement::No, false, _) => "NO",
                (Judgement::Yes, _, ClaimKind::Guarantee) => "guaranteed",
                (Judgement::Yes, _, _) => "yes",
            };
            let value = row.value.map_or_else(|| "not measured".to_owned(), |value| format!("{value:.4e}"));
            println!("{mark:10} {figure:5} {statement} {run}: {measure} = {value} ({})", row.wanted);
        }
        println!("\nfigures, runs, summary.json and index.html are in {}", out.display());
        let (reproduced, statements) = count(&self.rows, ClaimKind::Paper);
        let (held, comparisons) = count(&self.rows, ClaimKind::Exact);
        println!(
            "\nof {statements} statements of the paper {reproduced} are reproduced, {} are not; of {comparisons} comparisons \
             with exact solutions {held} hold, {} do not",
            statements - reproduced,
            comparisons - held
        );
        let rows = || self.rows.iter().map(|row| (&row.claim.id, &row.claim.statement, row));
        for (id, statement, reason) in rows().filter_map(|(id, said, row)| Some((id, said, row.reason()?))) {
            println!("known disagreement: {id}: {statement} {reason}");
        }
        for (id, statement, failure) in rows().filter_map(|(id, said, row)| Some((id, said, row.failure()?)))
        {
            eprintln!("error: {id} {failure}: {statement}");
        }
        self.failures.iter().for_each(|failure| eprintln!("error: {}: {}", failure.what, failure.error));
    }
}
