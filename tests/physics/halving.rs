//! Steps that are too long for a crowd are done in parts: nothing overlaps, rows stay where they are, what
//! was done is counted, and a run that is resumed has the same bits.

use std::fs;

use gluey::{Case, RunError, RunOptions, Silent, StepError, Tally};

use crate::program;
use crate::runs::{beside, case, column, failure, resumes_bit_by_bit, run};

/// Discs so crowded in a small box that films of one pair over several borders are in each other's way.
fn crowd(halvings: u32) -> Case {
    case(&text(halvings))
}

fn text(halvings: u32) -> String {
    format!(
        r#"
        name = "crowd"
        dimension = 2
        [domain]
        boundary = "sheared"
        [suspension]
        volume_fraction = 0.7
        count = 12
        seed = 1
        min_gap = 0.002
        [time]
        step = 0.1
        end = 0.7
        halvings = {halvings}
        [contact]
        strategy = "none"
        [flow.mesh]
        cells_per_radius = 1.6
        "#
    )
}

#[test]
fn a_step_that_is_too_long_is_done_in_parts_and_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let (case, csv) = (crowd(8), folder.path().join("t.csv"));
    let report = run(&case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error}"));
    let Tally { halved_steps, shortest_part, film_push, .. } = report.tally;
    assert!(halved_steps > 0 && shortest_part < 1.0 && film_push < 1.0, "{report}");
    assert!(report.to_string().contains("steps done in parts: "), "{report}");
    assert!(report.min_gap_over_a.is_some_and(|gap| gap > 0.0), "{report}");
    // Rows are where the case asks for them.
    let times = column(&csv, "t");
    let wanted = (0..=case.step_count()).map(|step| step as f64 * case.time.step);
    assert!(times.iter().copied().eq(wanted), "{times:?}");
    let parts = column(&beside(&csv, "solver"), "parts");
    assert_eq!(parts.iter().filter(|parts| **parts > 1.0).count(), halved_steps);
    assert_eq!(parts.len(), case.step_count());
}

#[test]
fn parts_are_the_same_after_a_resumption() {
    resumes_bit_by_bit(&crowd(8), 4, &["rheology"]);
    resumes_bit_by_bit(&crowd(8), 5, &["rheology"]);
}

#[test]
fn without_halving_the_run_ends_with_the_pair_and_what_helps() {
    match failure(&crowd(0)) {
        RunError::Step(StepError::Film { step, length, source, .. }) => {
            assert_eq!((step, length), (5, 0.1), "{source}");
        }
        other => panic!("{other}"),
    }
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("crowd.toml"), text(0)).expect("a file");
    let expected =
        ["also with a time step of 0.1", "between particle", "more time.halvings", "a smaller time.step"];
    program::fails(folder.path(), &["run", "crowd.toml", "--out", "out"], &expected);
    let (_, stdout, stderr) =
        program::gluey(folder.path(), &["run", "crowd.toml", "--set", "time.halvings=8", "--out", "other"]);
    assert!(stdout.contains("steps done in parts: "), "{stdout}");
    assert!(stderr.contains("parts: the film"), "{stderr}");
}
