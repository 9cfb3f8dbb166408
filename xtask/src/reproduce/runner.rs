//! One run: the case file with the approach's settings, handed to `gluey::run`.

use std::path::Path;

use gluey::case::{Memory, ParticleVelocity};
use gluey::{Case, CaseError, Formulation, RunError, RunOptions, RunReport, Strategy};

use super::plan::{Approach, CaseName, RunKey, quick_settings};
use crate::book::chain;
use crate::book::progress::Board;
use gluey::progress::duration;

/// The case of a run, ready to go. The accurate run of the three discs is made in the box of the exact
/// solution.
pub fn case(root: &Path, key: RunKey, quick: bool) -> Result<Case, CaseError> {
    let file = match (key.case, key.approach) {
        (CaseName::Trio2d, Approach::Unfitted) => "trio-2d-couette".to_owned(),
        _ => key.case.to_string(),
    };
    let mut case = Case::load(root.join("data/cases").join(format!("{file}.toml")))?;
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
        let settings = quick_settings(key.case);
        case.flow.mesh.cells_per_radius = Some(settings.cells_per_radius);
        if case.flow.formulation == Formulation::Paper {
            case.flow.tolerance = settings.paper_tolerance;
        }
        case.time.step *= settings.step_factor;
        case.time.end = case.time.end.min(settings.latest_end);
    }
    Ok(case)
}

/// Runs it; `folder/<name>.csv` is there when it succeeded, `folder/<name>.csv.partial-1` holds what a failed
/// run wrote.
pub fn run(
    root: &Path,
    folder: &Path,
    key: RunKey,
    quick: bool,
    board: &Board,
) -> Result<RunReport, RunError> {
    let line = board.start(&key.name());
    let result = run_to_files(root, folder, key, quick, &line);
    match &result {
        Ok(report) => line.finish(&format!("done in {}", duration(report.wall_s))),
        Err(error) => line.finish(&format!("failed: {}", chain(error))),
    }
    result
}

fn run_to_files(
    root: &Path,
    folder: &Path,
    key: RunKey,
    quick: bool,
    line: &dyn gluey::Progress,
) -> Result<RunReport, RunError> {
    let csv = folder.join(format!("{key}.csv"));
    gluey::run(&case(root, key, quick)?, &RunOptions::csv(csv), line)
}
