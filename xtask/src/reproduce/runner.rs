//! One run: the case file with the approach's settings, handed to `gluey::run`.

use std::path::Path;

use gluey::case::{Memory, ParticleVelocity};
use gluey::{Case, Formulation, RunOptions, RunReport, Strategy};

use super::plan::{Approach, CaseName, RunKey};
use crate::book::progress::Board;
use crate::workspace_root;

/// The case of a run, ready to go. The accurate run of the three discs is made in the box of the exact
/// solution.
pub fn case(key: RunKey, quick: bool) -> anyhow::Result<Case> {
    let file = match (key.case, key.approach) {
        (CaseName::Trio2d, Approach::Unfitted) => "trio-2d-couette".to_owned(),
        _ => key.case.to_string(),
    };
    let mut case = Case::load(workspace_root().join("data/cases").join(format!("{file}.toml")))?;
    case.name = key.case.to_string();
    case.contact.exact_gap = true;
    case.contact.strategy = match key.approach {
        Approach::None | Approach::Unfitted => Strategy::None,
        Approach::Inelastic => Strategy::Inelastic,
        _ => Strategy::Gluey,
    };
    case.flow.formulation = match key.approach {
        Approach::Unfitted => Formulation::Unfitted,
        _ => Formulation::Paper,
    };
    if matches!(key.approach, Approach::GlueyAsPrinted | Approach::GlueyAsPrintedLargeStep) {
        case.contact.exact_gap = false;
        case.contact.memory = Memory::Paper;
        case.flow.paper.velocity = ParticleVelocity::Center;
    }
    if key.approach == Approach::GlueyAsPrintedLargeStep {
        case.time.step *= 2.0;
    }
    if quick {
        // Cells per radius, tolerance of `paper` (that of `unfitted` stays), end: the only place for these.
        let (cells, tolerance, end) = match key.case {
            CaseName::Pair2d | CaseName::Trio2d => (6.4, 1e-6, 16.0),
            CaseName::Pair3d => (3.2, 1e-3, 16.85),
        };
        case.flow.mesh.cells_per_radius = Some(cells);
        if case.flow.formulation == Formulation::Paper {
            case.flow.tolerance = tolerance;
        }
        case.time.step *= 2.0;
        case.time.end = case.time.end.min(end);
    }
    Ok(case)
}

/// Runs it; `folder/<name>.csv` is there when it succeeded, `folder/<name>.csv.partial-1` holds what a failed
/// run wrote.
pub fn run(folder: &Path, key: RunKey, quick: bool, board: &Board) -> anyhow::Result<RunReport> {
    let line = board.start(&key.name());
    let options = RunOptions::csv(folder.join(format!("{key}.csv")));
    let result = case(key, quick).and_then(|case| Ok(gluey::run(&case, &options, &line)?));
    line.finish(&result);
    result
}
