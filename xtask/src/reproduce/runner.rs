//! One run: the case file with the approach's settings, handed to `gluey::run`.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::{Context, anyhow, ensure};
use gluey::case::{Memory, ParticleVelocity};
use gluey::{Case, Checkpoint, Formulation, ResultPaths, RunOptions, RunReport, Strategy};

use super::plan::{Approach, CaseName, RunKey};
use crate::book::chain;
use crate::book::progress::Board;
use crate::workspace_root;

/// The case of a run, ready to go. The accurate run of the three discs is made in the box of the exact
/// solution, too.
pub fn case(key: RunKey, quick: bool) -> anyhow::Result<Case> {
    let file = match (key.case, key.approach) {
        (CaseName::Trio2d, Approach::Unfitted) => "trio-2d-couette".to_owned(),
        _ => key.case.to_string(),
    };
    let mut case = Case::load(workspace_root().join("data/cases").join(format!("{file}.toml")))?;
    case.name = key.case.to_string();
    case.contact.exact_gap = true;
    case.contact.strategy = match key.approach {
        Approach::None | Approach::Unfitted | Approach::UnfittedPeriodic => Strategy::None,
        Approach::Inelastic => Strategy::Inelastic,
        _ => Strategy::Gluey,
    };
    case.flow.formulation = match key.approach {
        Approach::Unfitted | Approach::UnfittedPeriodic => Formulation::Unfitted,
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

/// The runs in a folder.
pub struct Runner<'a> {
    folder: &'a Path,
    quick: bool,
    board: &'a Board,
    /// Made by the first of the runs that have it in common.
    beginning: OnceLock<Result<Beginning, String>>,
}

impl<'a> Runner<'a> {
    /// Those of this extent, shown by `board`.
    pub fn new(folder: &'a Path, quick: bool, board: &'a Board) -> Self {
        Self { folder, quick, board, beginning: OnceLock::new() }
    }

    /// Makes a run; `folder/<name>.csv` is there when it succeeded, `folder/<name>.csv.partial-1` holds what
    /// a failed run wrote.
    pub fn run(&self, key: RunKey) -> anyhow::Result<RunReport> {
        let case = case(key, self.quick)?;
        let paths = ResultPaths::new(self.folder, key.name());
        let resume = match key.common_end() {
            Some(end) => Some(self.beginning(key, end)?.handed_on(&case, &paths)?),
            None => None,
        };
        self.shown(&key.name(), &case, &RunOptions { resume, ..RunOptions::csv(paths.csv()) })
    }

    fn shown(&self, name: &str, case: &Case, options: &RunOptions) -> anyhow::Result<RunReport> {
        let line = self.board.start(name);
        let result = gluey::run(case, options, &line).map_err(anyhow::Error::from);
        line.finish(&result);
        result
    }

    /// The beginning of a run up to this time; waits while another run makes it.
    fn beginning(&self, key: RunKey, end: f64) -> anyhow::Result<&Beginning> {
        let made = || {
            let mut case = case(RunKey { approach: Approach::None, ..key }, self.quick)?;
            case.time.end = end;
            Beginning::made(case, self.folder, |name, case, options| self.shown(name, case, options))
        };
        let beginning = self.beginning.get_or_init(|| made().map_err(|error| chain(&*error)));
        beginning.as_ref().map_err(|error| anyhow!("{error}"))
    }
}

/// The steps of a case before any particles touch, which are the same whatever contact does then.
struct Beginning {
    case: Case,
    paths: ResultPaths,
}

impl Beginning {
    /// That of a case without contact, to its end.
    fn made(
        case: Case,
        folder: &Path,
        run: impl FnOnce(&str, &Case, &RunOptions) -> anyhow::Result<RunReport>,
    ) -> anyhow::Result<Self> {
        let name = format!("{}-beginning", case.name);
        let paths = ResultPaths::new(folder, &name);
        let options = RunOptions { checkpoint: Some(paths.checkpoint()), ..RunOptions::csv(paths.csv()) };
        let report = run(&name, &case, &options)?;
        ensure!(report.min_gap_over_a > Some(0.0), "{name}: particles touch before t = {}", case.time.end);
        Ok(Self { case, paths })
    }

    /// Makes it that of the same case with other contact, whose files have these places; the checkpoint to go
    /// on from.
    fn handed_on(&self, case: &Case, to: &ResultPaths) -> anyhow::Result<PathBuf> {
        for (own, copy) in [(self.paths.csv(), to.csv()), (self.paths.solver(), to.solver())] {
            // What a run that was killed left would be taken for the rows to come.
            let draft = |number: u32| copy.with_added_extension(format!("partial-{number}"));
            (1..).take_while(|&number| fs::remove_file(draft(number)).is_ok()).count();
            fs::copy(&own, &copy).with_context(|| format!("{} cannot be copied", own.display()))?;
        }
        Checkpoint::<3>::read(&self.case, &self.paths.checkpoint())?.write(case, &to.checkpoint())?;
        Ok(to.checkpoint())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduce::plan::CaseName;
    use gluey::Silent;

    /// Two large spheres that only contact keeps apart, on few cells.
    fn quick_case(strategy: Strategy) -> Case {
        let key = RunKey { case: CaseName::Pair3d, approach: Approach::Gluey };
        let mut case = case(key, true).unwrap();
        case.reference = None;
        case.flow.mesh.cells_per_radius = Some(1.0);
        case.contact.strategy = strategy;
        for (particle, [x, y]) in case.particles.iter_mut().zip([[0.32, 0.53], [0.68, 0.47]]) {
            (particle.position, particle.radius) = (vec![x, y, 0.5], 0.15);
        }
        (case.time.step, case.time.end) = (0.25, 4.0);
        case
    }

    #[test]
    fn a_run_from_a_common_beginning_has_the_bits_of_one_from_the_start() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = quick_case(Strategy::None);
        first.time.end = 0.5;
        let run = |_: &str, case: &Case, options: &RunOptions| Ok(gluey::run(case, options, &Silent)?);
        let beginning = Beginning::made(first, folder.path(), run).unwrap();
        let case = quick_case(Strategy::Gluey);
        let [whole, begun] = ["whole", "begun"].map(|name| ResultPaths::new(folder.path(), name));
        let report = gluey::run(&case, &RunOptions::csv(whole.csv()), &Silent).unwrap();
        assert!(report.min_gap_over_a.is_some_and(|gap| gap < 1e-9), "nothing touches: {report:?}");
        fs::write(begun.csv().with_added_extension("partial-1"), "a killed run").unwrap();
        let resume = Some(beginning.handed_on(&case, &begun).unwrap());
        gluey::run(&case, &RunOptions { resume, ..RunOptions::csv(begun.csv()) }, &Silent).unwrap();
        let read = |paths: &ResultPaths| fs::read_to_string(paths.csv()).unwrap();
        assert_eq!(read(&whole), read(&begun));
        assert_eq!(read(&whole).lines().count(), 18);
    }

    #[test]
    fn particles_that_touch_have_no_common_beginning() {
        let folder = tempfile::tempdir().unwrap();
        let run = |_: &str, case: &Case, options: &RunOptions| Ok(gluey::run(case, options, &Silent)?);
        let made = Beginning::made(quick_case(Strategy::None), folder.path(), run);
        let error = made.err().expect("they overlap").to_string();
        assert_eq!(error, "pair-3d-beginning: particles touch before t = 4");
    }
}
