//! A run that was interrupted and resumed ends with the same bits as one that was not.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use gluey::case::{Formulation, Solver};
use gluey::{
    Case, CheckpointError, Ended, Progress, ProgressState, RowsError, RunError, RunOptions, Silent, Strategy,
    run,
};
use tempfile::TempDir;

fn case() -> Case {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");
    Case::load(file).expect("a case")
}

/// Interrupts a run when it has reached a step.
struct StopAt {
    step: usize,
    interrupt: Arc<AtomicBool>,
}

impl Progress for StopAt {
    fn report(&self, state: &ProgressState) {
        if state.step >= self.step {
            self.interrupt.store(true, Ordering::Relaxed);
        }
    }
}

/// Options with a checkpoint beside the trajectory.
fn options(folder: &Path) -> RunOptions {
    RunOptions { checkpoint: Some(folder.join("c.checkpoint")), ..RunOptions::csv(folder.join("t.csv")) }
}

/// Runs to `step`, where the run is interrupted.
fn interrupted(case: &Case, folder: &Path, step: usize) {
    let interrupt = Arc::new(AtomicBool::new(false));
    let options = RunOptions { interrupt: Some(interrupt.clone()), ..options(folder) };
    match run(case, &options, &StopAt { step, interrupt }) {
        Err(RunError::Interrupted(Ended { step: done, checkpoint: Some(_), .. })) => {
            assert_eq!(done, step + 1)
        }
        other => panic!("{other:?}"),
    }
    assert!(!options.csv.exists(), "a trajectory that is not complete has its final name");
}

fn resumed(case: &Case, folder: &Path) -> Result<gluey::RunReport, RunError> {
    let options = RunOptions { resume: Some(folder.join("c.checkpoint")), ..options(folder) };
    run(case, &options, &Silent)
}

fn resumes_bit_by_bit(case: &Case, step: usize) {
    let folder = TempDir::new().expect("a folder");
    let whole = folder.path().join("whole.csv");
    let one = run(case, &RunOptions::csv(&whole), &Silent).unwrap_or_else(|error| panic!("{error}"));
    interrupted(case, folder.path(), step);
    let two = resumed(case, folder.path()).unwrap_or_else(|error| panic!("{error}"));
    let read = |path: &Path| fs::read_to_string(path).expect("a trajectory");
    assert_eq!(read(&whole), read(&folder.path().join("t.csv")));
    assert_eq!(
        (one.steps, one.min_gap_over_a, one.end_gap_over_a),
        (two.steps, two.min_gap_over_a, two.end_gap_over_a)
    );
    assert_eq!(one.reversibility_error, two.reversibility_error);
}

#[test]
fn before_during_and_after_contact() {
    // The pair touches from about step 140 to 190.
    for step in [0, 50, 160, 250] {
        resumes_bit_by_bit(&case(), step);
    }
}

#[test]
fn on_the_way_back() {
    let mut case = case();
    case.reference = None;
    case.time.reverse_at = Some(8.0);
    resumes_bit_by_bit(&case, 159);
    resumes_bit_by_bit(&case, 200);
}

/// Five steps of the finite-element flow on a coarse mesh; the iterative solver starts from the last step's
/// solution.
#[test]
fn with_the_finite_element_flow() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-2d.toml");
    for solver in [Solver::Direct, Solver::Multigrid] {
        for formulation in [Formulation::Paper, Formulation::Unfitted] {
            let mut case = Case::load(file).expect("a case");
            case.time.end = 5.0 * case.time.step;
            case.flow.mesh.cells_per_radius = Some(3.2);
            (case.flow.solver, case.flow.formulation) = (solver, formulation);
            resumes_bit_by_bit(&case, 2);
        }
    }
}

#[test]
fn a_run_can_be_prolonged() {
    let folder = TempDir::new().expect("a folder");
    let long = case();
    let mut short = case();
    short.time.end = 5.0;
    let options = RunOptions { checkpoint_every: Some(50), ..options(folder.path()) };
    run(&short, &options, &Silent).unwrap_or_else(|error| panic!("{error}"));
    let report = resumed(&long, folder.path()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.steps, long.step_count());
}

#[test]
fn a_checkpoint_of_another_case_is_refused() {
    let folder = TempDir::new().expect("a folder");
    interrupted(&case(), folder.path(), 3);
    let mut other = case();
    other.contact.strategy = Strategy::Inelastic;
    match resumed(&other, folder.path()) {
        Err(RunError::Checkpoint(CheckpointError::OtherCase { difference, .. })) => {
            assert_eq!(difference.saved, "strategy = \"gluey\"");
            assert_eq!(difference.given, "strategy = \"inelastic\"");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_damaged_checkpoint_is_refused() {
    let folder = TempDir::new().expect("a folder");
    interrupted(&case(), folder.path(), 3);
    let path = folder.path().join("c.checkpoint");
    let whole = fs::read(&path).expect("a checkpoint");
    let refusal = |bytes: &[u8]| {
        fs::write(&path, bytes).expect("a file");
        match resumed(&case(), folder.path()) {
            Err(RunError::Checkpoint(error)) => error,
            other => panic!("{other:?}"),
        }
    };
    let mut flipped = whole.clone();
    *flipped.last_mut().expect("bytes") ^= 1;
    assert!(matches!(refusal(&flipped), CheckpointError::Damaged { .. }));
    assert!(matches!(refusal(&whole[..whole.len() - 1]), CheckpointError::Damaged { .. }));
    assert!(matches!(refusal(b"t,x1,y1"), CheckpointError::Foreign { .. }));
    assert!(matches!(refusal(&[b'x'; 100]), CheckpointError::Foreign { .. }));
    let mut newer = whole.clone();
    newer[8] = 200;
    assert!(matches!(refusal(&newer), CheckpointError::Version { found: 200, .. }));
    fs::remove_file(&path).expect("a file");
    assert!(matches!(resumed(&case(), folder.path()), Err(RunError::Checkpoint(CheckpointError::Read(_)))));
}

/// Rows that a checkpoint counts on but that are not there, or are others, are missed and not made up for.
#[test]
fn a_checkpoint_without_its_rows_is_refused() {
    let folder = TempDir::new().expect("a folder");
    interrupted(&case(), folder.path(), 30);
    let draft = folder.path().join("t.csv.partial-1");
    let text = fs::read_to_string(&draft).expect("a draft");
    let refusal = |text: Option<&str>| {
        match text {
            Some(text) => fs::write(&draft, text).expect("a file"),
            None => fs::remove_file(&draft).expect("a file"),
        }
        let refused = resumed(&case(), folder.path());
        assert_eq!(fs::read_to_string(&draft).ok().as_deref(), text, "the draft was changed");
        match refused {
            Err(RunError::Rows(error)) => error,
            other => panic!("{other:?}"),
        }
    };
    let changed = text.replacen('3', "4", 1);
    assert!(matches!(refusal(Some(&changed)), RowsError::Missing { lines: 32, .. }));
    assert!(matches!(refusal(Some(&text[..text.len() - 2])), RowsError::Missing { .. }));
    // A row behind the checkpoint that the run does not make.
    let wrong = format!("{text}1.0,2.0\n");
    assert!(matches!(refusal(Some(&wrong)), RowsError::Differs { line: 33, .. }));
    assert!(matches!(refusal(None), RowsError::Missing { .. }));
}

/// A run that is resumed to an earlier end completes its rows, and those beyond it stay where they were.
#[test]
fn rows_beyond_the_end_are_not_lost() {
    let folder = TempDir::new().expect("a folder");
    interrupted(&case(), folder.path(), 30);
    let draft = folder.path().join("t.csv.partial-1");
    let early = fs::read(folder.path().join("c.checkpoint")).expect("a checkpoint");
    let options = RunOptions { resume: Some(folder.path().join("c.checkpoint")), ..options(folder.path()) };
    let interrupt = Arc::new(AtomicBool::new(false));
    let stop = StopAt { step: 50, interrupt: interrupt.clone() };
    let more = run(&case(), &RunOptions { interrupt: Some(interrupt), ..options }, &stop);
    assert!(matches!(more, Err(RunError::Interrupted(_))), "{more:?}");
    let rows = fs::read_to_string(&draft).expect("a draft");
    fs::write(folder.path().join("c.checkpoint"), early).expect("a file");
    let mut short = case();
    short.time.end = 2.0;
    let report = resumed(&short, folder.path()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.steps, 40);
    assert_eq!(fs::read_to_string(&draft).expect("the draft"), rows);
    let complete = fs::read_to_string(folder.path().join("t.csv")).expect("a trajectory");
    assert_eq!(complete.lines().count(), 1 + 41);
    assert!(rows.starts_with(&complete));
}
