//! Every case in `data/cases` loads, and runs its first steps.

use std::fs;
use std::path::PathBuf;

use gluey::case::{Formulation, Hydrodynamics};
use gluey::{Case, RunOptions, Silent};
use tempfile::TempDir;

use crate::runs::run;

/// Largest distance from the reference, in radii, after two steps on a coarse mesh: three times what is
/// measured. A case whose particles do not move at all, or move backwards, is ten times as far away.
const LIMITS: [(&str, f64); 4] =
    [("pair-2d", 3.6e-3), ("pair-3d", 4.2e-4), ("pair-3d-mobility", 2.9e-5), ("trio-2d-couette", 1.7e-3)];

fn case_files() -> Vec<PathBuf> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases");
    let entries = fs::read_dir(folder).expect("the folder of cases");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}

/// The package carries copies of the trajectories, for it cannot reach outside its folder.
#[test]
fn the_packaged_references_are_those_of_the_workspace() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    for name in gluey::reference::NAMES {
        let [packaged, original] = ["crates/gluey/data", "data/reference"]
            .map(|folder| fs::read_to_string(format!("{root}/{folder}/{name}.csv")).expect("a table"));
        assert!(packaged == original, "{name}");
    }
}

#[test]
fn the_papers_cases_are_there() {
    let names: Vec<String> =
        case_files().iter().map(|path| path.file_stem().expect("a name").to_string_lossy().into()).collect();
    for name in ["pair-2d", "pair-3d", "pair-3d-mobility", "sedimentation-2d", "trio-2d", "trio-2d-couette"] {
        assert!(names.iter().any(|found| found == name), "{name} is not among {names:?}");
    }
}

#[test]
fn the_papers_data_are_in_them() {
    let case = |name: &str| {
        let file = case_files().into_iter().find(|path| path.ends_with(format!("{name}.toml")));
        Case::load(file.expect(name)).expect(name)
    };
    let starts =
        |case: &Case| -> Vec<Vec<f64>> { case.particles.iter().map(|p| p.position.clone()).collect() };
    let (pair, trio, spheres) = (case("pair-2d"), case("trio-2d"), case("pair-3d"));
    assert_eq!(starts(&pair), [[0.451, 0.51], [0.549, 0.49]]);
    assert_eq!(starts(&trio), [[0.451, 0.51], [0.549, 0.49], [0.7, 0.49]]);
    assert_eq!(starts(&spheres), [[0.3, 0.525, 0.5], [0.7, 0.475, 0.5]]);
    assert_eq!([pair.step_count(), trio.step_count(), spheres.step_count()], [1200, 1200, 337]);
    for case in [pair, trio, spheres] {
        assert!(case.particles.iter().all(|particle| particle.radius == 0.05));
        assert_eq!((case.shear_rate, case.lower()[0], case.upper()[0]), (1.0, 0.0, 1.0));
    }
}

/// How far the discs of the sedimentation fall in five steps under a multiple of gravity.
fn drops(formulation: Formulation, gravity: f64) -> Vec<f64> {
    let path = case_files().into_iter().find(|path| path.ends_with("sedimentation-2d.toml"));
    let mut case = Case::load(path.expect("the case")).expect("a case");
    case.time.end = 5.0 * case.time.step;
    case.flow.formulation = formulation;
    case.flow.mesh.cells_per_radius = Some(3.0);
    case.gravity.iter_mut().flatten().for_each(|g| *g *= gravity);
    let folder = TempDir::new().expect("a folder");
    let csv = folder.path().join("trajectory.csv");
    run(&case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error}"));
    let rows = fs::read_to_string(&csv).expect("a trajectory");
    let height = |line: usize, disc: usize| -> f64 {
        let row = rows.lines().nth(line).expect("a row");
        row.split(',').nth(2 + 2 * disc).expect("a column").parse().expect("a number")
    };
    (0..case.particles.len()).map(|disc| height(1, disc) - height(6, disc)).collect()
}

/// Discs fall with gravity, the largest fastest, rise against it, and stay where they are without it.
#[test]
fn heavy_discs_settle() {
    let [rigid, soft] = [Formulation::Unfitted, Formulation::Paper].map(|f| drops(f, 1.0));
    assert!(rigid.iter().zip(&soft).all(|(a, b)| (a / b - 1.0).abs() < 0.06), "{rigid:?} {soft:?}");
    assert!(rigid[..4].iter().all(|drop| (0.03..rigid[4]).contains(drop)), "{rigid:?}");
    assert!(drops(Formulation::Unfitted, -1.0).iter().all(|drop| *drop < -0.03));
    assert!(drops(Formulation::Unfitted, 0.0).iter().all(|drop| drop.abs() < 1e-12));
}

#[test]
fn every_case_runs_its_first_steps() {
    for file in case_files() {
        let mut case = Case::load(&file).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(Some(case.name.as_str()), file.file_stem().and_then(|stem| stem.to_str()));
        case.time.end = 2.0 * case.time.step;
        // Coarse: this asks whether it runs, not how well.
        case.flow.mesh.cells_per_radius = Some(2.0);
        let folder = TempDir::new().expect("a folder");
        let csv = folder.path().join("runs").join("trajectory.csv");
        let report = run(&case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((report.steps, report.case.as_str()), (2, case.name.as_str()));
        assert_eq!(report.cells > 0, case.flow.hydrodynamics == Hydrodynamics::Stokes);
        assert!(report.min_gap_over_a.is_some_and(f64::is_finite));
        assert_eq!(report.max_abs_error_over_a.is_some(), case.reference.is_some());
        let limit = LIMITS.iter().find(|(name, _)| *name == case.name).map(|(_, limit)| *limit);
        assert_eq!(limit.is_some(), case.reference.is_some(), "{} needs a limit", case.name);
        assert!(report.max_abs_error_over_a.is_none_or(|error| Some(error) < limit), "{report}");
        let rows = fs::read_to_string(&csv).expect("a trajectory");
        assert_eq!(rows.lines().count(), 1 + 3);
        assert!(rows.lines().skip(1).all(|row| row.split(',').all(|cell| cell.parse::<f64>().is_ok())));
        // What steps cost, near pairs of many particles and the rheology have files of their own.
        let files = 2 + usize::from(case.particles.len() > 9) + usize::from(case.is_sheared());
        let found = fs::read_dir(csv.parent().expect("a folder")).expect("it").count();
        assert_eq!(found, files, "something is left over");
    }
}
