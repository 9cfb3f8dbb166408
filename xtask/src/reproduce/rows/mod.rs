//! The rows under each figure, those of `rows.toml`, with their numbers.

mod measured;

use std::sync::LazyLock;

use serde::Deserialize;

use super::plan::FigureName;
use super::verdict::{Claim, JudgedClaim};
pub use measured::{Evidence, RunView, measure};

/// The content of `rows.toml`.
#[derive(Deserialize)]
struct RowsFile {
    figure: Vec<FigureText>,
    row: Vec<Claim>,
}

/// Words of a figure.
#[derive(Deserialize)]
pub struct FigureText {
    name: FigureName,
    /// Its title.
    pub title: String,
    /// What its table has of each run.
    pub columns: Vec<String>,
}

static ROWS: LazyLock<RowsFile> =
    LazyLock::new(|| toml::from_str(include_str!("rows.toml")).expect("a test reads it"));

/// All rows before they are judged.
pub fn claims() -> &'static [Claim] {
    &ROWS.row
}

/// The words of a figure.
pub fn text(figure: FigureName) -> &'static FigureText {
    ROWS.figure.iter().find(|text| text.name == figure).expect("a test looks for all figures")
}

/// The rows of the chosen figures.
pub fn all(figures: &[FigureName], evidence: &Evidence<'_>) -> Vec<JudgedClaim> {
    let quick = evidence.data.quick;
    let of_figure = |figure| claims().iter().filter(move |claim| claim.figure == figure);
    let chosen = figures.iter().copied().flat_map(of_figure).filter(|claim| !quick || !claim.full_only);
    chosen.map(|claim| claim.judge(value(claim, evidence), quick)).collect()
}

/// The number of a row; `None` if it could not be measured.
fn value(claim: &Claim, evidence: &Evidence<'_>) -> Option<f64> {
    let key = claim.own_run()?;
    measure(&claim.measure)?(&evidence.run(key.case, key.approach)?)
}

#[cfg(test)]
mod tests;
