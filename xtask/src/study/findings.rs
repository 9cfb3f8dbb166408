//! What a study is, and what comes out of it.

use gluey_pictures::Canvas;

use super::point::{Done, StudyPoint};

/// A study.
pub struct Study {
    /// Its title.
    pub title: &'static str,
    /// What is computed and beside what, as HTML.
    pub text: &'static str,
    /// The runs.
    pub points: fn(quick: bool) -> Vec<StudyPoint>,
    /// What comes out of the runs that succeeded.
    pub findings: fn(&[Done]) -> anyhow::Result<Findings>,
}

/// Results of a study.
#[derive(Default)]
pub struct Findings {
    /// Names of the columns with commas between them.
    pub columns: String,
    /// The rows.
    pub rows: Vec<Vec<String>>,
    /// Pictures with names.
    pub drawings: Vec<(&'static str, Canvas)>,
    /// What the numbers say, as HTML.
    pub remarks: Vec<String>,
}
