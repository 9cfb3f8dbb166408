//! `summary.json`: everything a program may want to know about a reproduction.

use gluey::RunReport;
use serde::Serialize;

use super::checks::Check;

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
    pub figures: Vec<String>,
    /// The runs that succeeded.
    pub runs: Vec<RunReport>,
    /// What did not work.
    pub failures: Vec<Failure>,
    /// What the runs show.
    pub checks: Vec<Check>,
}

/// Something that did not work.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Failure {
    /// The run, figure or file.
    pub what: String,
    /// Why.
    pub error: String,
}

impl Summary {
    /// As indented JSON.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|json| json + "\n")
    }
}
