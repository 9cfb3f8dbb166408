//! `summary.json`: everything a program may want to know about a reproduction.

use gluey::RunReport;
use serde::Serialize;

use super::plan::FigureName;
use super::settings::Settings;
use super::verdict::Row;
use crate::book::Failure;

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
    pub runs: Vec<Run>,
    /// Runs, figures and files that failed.
    pub failures: Vec<Failure>,
    /// Rows under the figures.
    pub rows: Vec<Row>,
}

/// A run that succeeded.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
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
        self.failures.is_empty() && !self.rows.iter().any(Row::is_failure)
    }

    /// As indented JSON.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|json| json + "\n")
    }
}
