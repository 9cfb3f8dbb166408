//! Contact across the periodic border of a box and with its walls, in the finite-element flow.

use std::path::Path;

use gluey::{Case, RunError, RunOptions, RunReport, Silent};
use tempfile::TempDir;

use crate::runs::run;

fn case(text: &str) -> Case {
    Case::parse(text, "case.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// The pair of pair-2d in a periodic box, moved along x; soft near contact, so that there is some.
fn pair(shift: f64, strategy: &str) -> Case {
    let x = [0.451, 0.549].map(|x: f64| (x + shift).rem_euclid(1.0));
    case(&format!(
        r#"
name = "pair"
dimension = 2
domain.boundary = "periodic"
particles = [{{ position = [{}, 0.51], radius = 0.05 }}, {{ position = [{}, 0.49], radius = 0.05 }}]
time = {{ step = 0.025, end = 0.75 }}
contact = {{ strategy = "{strategy}", exact_gap = true }}
flow.formulation = "paper"
"#,
        x[0], x[1]
    ))
}

/// A disc just above the lower wall, carried under another.
fn squeezed(strategy: &str) -> Case {
    case(&format!(
        r#"
name = "squeezed"
dimension = 2
domain.boundary = "periodic"
particles = [{{ position = [0.5, 0.0501], radius = 0.05 }}, {{ position = [0.425, 0.1165], radius = 0.05 }}]
time = {{ step = 0.05, end = 2.0 }}
contact = {{ strategy = "{strategy}", exact_gap = true }}
flow.formulation = "paper"
"#
    ))
}

fn run_in(case: &Case, folder: &Path) -> Result<RunReport, RunError> {
    run(case, &RunOptions::csv(folder.join("t.csv")), &Silent)
}

/// The columns of a trajectory whose names begin with `name`, row by row.
fn columns(folder: &Path, name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(folder.join("t.csv")).expect("a trajectory");
    let mut lines = text.lines().map(|line| line.split(','));
    let header: Vec<&str> = lines.next().expect("a header").collect();
    let wanted = |(column, _): &(usize, &str)| header[*column].starts_with(name);
    lines
        .map(|line| {
            let cells = line.enumerate().filter(wanted);
            cells.map(|(_, cell)| cell.parse().expect("a number")).collect()
        })
        .collect()
}

/// Across the border the pair does what it does in the middle.
#[test]
fn contact_does_not_see_the_border() {
    let [inside, across] = [0.0, 0.5].map(|shift| {
        let folder = TempDir::new().expect("a folder");
        let report = run_in(&pair(shift, "gluey"), folder.path()).unwrap_or_else(|error| panic!("{error}"));
        (report, columns(folder.path(), "gap"), columns(folder.path(), "y"))
    });
    assert!(across.0.min_gap_over_a.is_some_and(|gap| gap.abs() < 1e-10), "no contact: {}", across.0);
    for (inside, across) in [(inside.1, across.1), (inside.2, across.2)] {
        assert_eq!(inside.len(), 31);
        for (a, b) in inside.iter().flatten().zip(across.iter().flatten()) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
    }
    let folder = TempDir::new().expect("a folder");
    let report = run_in(&pair(0.5, "none"), folder.path()).unwrap_or_else(|error| panic!("{error}"));
    assert!(report.min_gap_over_a.is_some_and(|gap| gap < -1e-4), "{report}");
}

#[test]
fn a_wall_holds_what_is_pressed_against_it() {
    let folder = TempDir::new().expect("a folder");
    match run_in(&squeezed("none"), folder.path()) {
        Err(RunError::LeftBox { particle: 1, excess, .. }) => assert!(excess > 1e-10),
        other => panic!("{other:?}"),
    }
    for strategy in ["inelastic", "gluey"] {
        let folder = TempDir::new().expect("a folder");
        run_in(&squeezed(strategy), folder.path()).unwrap_or_else(|error| panic!("{strategy}: {error}"));
        let lowest = columns(folder.path(), "y1").iter().map(|y| y[0]).fold(f64::INFINITY, f64::min);
        assert!((lowest - 0.05).abs() < 1e-10, "{strategy}: {lowest}");
    }
}

/// The run up to the last good step is not lost: it can be ended there.
#[test]
fn a_particle_that_leaves_the_box_leaves_a_checkpoint() {
    let folder = TempDir::new().expect("a folder");
    let checkpoint = folder.path().join("c.checkpoint");
    let csv = folder.path().join("t.csv");
    let options = RunOptions { checkpoint: Some(checkpoint.clone()), ..RunOptions::csv(&csv) };
    let mut case = squeezed("none");
    let good = match run(&case, &options, &Silent) {
        Err(RunError::Stopped { step, checkpoint: path, cause }) => {
            assert_eq!(path, checkpoint);
            assert!(
                matches!(*cause, RunError::LeftBox { particle: 1, step: failed, .. } if failed == step + 1)
            );
            step
        }
        other => panic!("{other:?}"),
    };
    let rows = std::fs::read_to_string(folder.path().join("t.csv.partial-1")).expect("rows");
    case.time.end = good as f64 * case.time.step;
    let report = run(&case, &RunOptions { resume: Some(checkpoint), ..options }, &Silent);
    assert_eq!(report.unwrap_or_else(|error| panic!("{error}")).steps, good);
    assert_eq!(std::fs::read_to_string(csv).expect("a trajectory"), rows);
}

/// Where the flow comes in through a side, a disc that nearly touches it moves in with the flow, in any step.
#[test]
fn open_sides_hold_nothing() {
    let moved = |step: f64| {
        let text = format!(
            r#"
name = "entering"
dimension = 2
particles = [{{ position = [0.11217, 0.88], radius = 0.112 }}]
time = {{ step = {step}, end = 0.01 }}
contact.strategy = "none"
flow = {{ formulation = "unfitted", mesh.cells_per_radius = 3.2 }}
"#
        );
        let folder = TempDir::new().expect("a folder");
        run_in(&case(&text), folder.path()).unwrap_or_else(|error| panic!("{error}"));
        let places = columns(folder.path(), "x1");
        places[places.len() - 1][0] - places[0][0]
    };
    let [coarse, fine] = [0.01, 0.001].map(moved);
    assert!((fine / 0.01 - 0.38).abs() < 0.02, "{fine}");
    assert!((coarse / fine - 1.0).abs() < 0.03, "{coarse} {fine}");
}

#[test]
fn particles_that_overlap_across_the_border_are_refused() {
    let text = |boundary: &str| {
        format!(
            r#"
name = "overlap"
dimension = 2
domain.boundary = "{boundary}"
particles = [{{ position = [0.06, 0.5], radius = 0.05 }}, {{ position = [0.98, 0.5], radius = 0.05 }}]
time = {{ step = 0.05, end = 1.0 }}
"#
        )
    };
    let message = |boundary| match Case::parse(&text(boundary), "case.toml") {
        Err(error) => error.to_string(),
        Ok(_) => panic!("{boundary}: accepted"),
    };
    assert!(
        message("periodic").contains("particles 1 and 2 overlap at the start"),
        "{}",
        message("periodic")
    );
    assert!(message("couette").contains("particle 2 sticks out of the box"), "{}", message("couette"));
}

#[test]
fn a_period_in_which_two_particles_touch_twice_is_refused() {
    let text = |radius: f64| {
        format!(
            r#"
name = "short"
dimension = 2
domain.boundary = "periodic"
particles = [{{ position = [0.5, 0.5], radius = {radius} }}]
time = {{ step = 0.05, end = 1.0 }}
"#
        )
    };
    let Err(error) = Case::parse(&text(0.26), "case.toml") else { panic!("accepted") };
    let message = error.to_string();
    let wanted =
        "particles[0].radius = 0.26: particle 1 of diameter 0.52 is wider than half the period 1 along x";
    assert!(message.contains(wanted), "{message}");
    assert!(Case::parse(&text(0.25), "case.toml").is_ok());
}
