//! Meshes are as large as was estimated before they were built, and those that do not fit are refused.

use std::fs;

use gluey::case::ParticleSpec;
use gluey::flow::{MeshEstimate, MeshSize};
use gluey::{Case, Formulation, RunError, RunOptions, Silent};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::runs::run;

fn shipped() -> Vec<Case> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases");
    let mut files: Vec<_> =
        fs::read_dir(folder).expect("cases").map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files.iter().map(|file| Case::load(file).unwrap_or_else(|error| panic!("{error}"))).collect()
}

/// Cells there are over cells that were expected.
fn ratio(case: &Case) -> Option<f64> {
    let expected = MeshEstimate::of(case)?.cell_count;
    let built = MeshSize::of(case).unwrap_or_else(|error| panic!("{error}"));
    let built = built.expect("a mesh").cell_count;
    let ratio = built as f64 / expected;
    println!("{}, {}: {built} cells, {expected:.0} expected: {ratio:.2}", case.name, case.flow.formulation);
    Some(ratio)
}

#[test]
fn shipped_cases_have_as_many_cells_as_expected() {
    for mut case in shipped() {
        for formulation in [Formulation::Paper, Formulation::Unfitted] {
            case.flow.formulation = formulation;
            let ratio = ratio(&case);
            assert!(ratio.is_none_or(|ratio| (0.6..=1.6).contains(&ratio)), "{ratio:?}");
        }
    }
}

/// A case of some particles that do not overlap, at random.
fn random_case(seed: u64) -> Case {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let dimension = if seed.is_multiple_of(3) { 3 } else { 2 };
    let text = format!(
        "name = \"random-{seed}\"\ndimension = {dimension}\n[time]\nstep = 0.1\nend = 1.0\n[[particles]]\n\
         position = {:?}\nradius = 0.05\n",
        vec![0.5; dimension]
    );
    let mut case = Case::parse(&text, "random.toml").expect("a good case");
    let count = random.random_range(1..if dimension == 2 { 40 } else { 8 });
    for _ in 0..count {
        let radius = random.random_range(0.03..0.1);
        let position: Vec<f64> = (0..dimension).map(|_| random.random_range(radius..1.0 - radius)).collect();
        case.particles.push(ParticleSpec::new(position, radius));
        if case.check().is_err() {
            case.particles.pop();
        }
    }
    case.flow.mesh.cells_per_radius = Some(random.random_range(2.0..if dimension == 2 { 12.0 } else { 4.0 }));
    case.flow.mesh.coarsest_level = Some(random.random_range(0..4));
    case.flow.mesh.band = random.random_range(0.0..4.0);
    if random.random_range(0..2) == 0 {
        case.flow.formulation = Formulation::Paper;
    }
    case.check().unwrap_or_else(|error| panic!("{error}"));
    case
}

#[test]
fn random_cases_have_as_many_cells_as_expected() {
    for seed in 0..60 {
        let ratio = ratio(&random_case(seed)).expect("a mesh");
        assert!((0.6..=1.6).contains(&ratio), "seed {seed}: {ratio}");
    }
}

#[test]
fn meshes_that_do_not_fit_are_refused_before_they_are_built() {
    let case = |name: &str| shipped().into_iter().find(|case| case.name == name).expect("shipped");
    let mut spheres = case("pair-3d");
    spheres.flow.mesh.cells_per_radius = Some(5000.0);
    let mut uniform = case("pair-2d");
    uniform.flow.mesh.cells_per_radius = Some(13_000.0);
    uniform.flow.mesh.coarsest_level = Some(18);
    for mut case in [spheres, uniform] {
        case.reference = None;
        let folder = tempfile::TempDir::new().expect("a folder");
        let csv = folder.path().join("out.csv");
        let error = run(&case, &RunOptions::csv(&csv), &Silent).expect_err("too large");
        let RunError::TooLarge(too_large) = &error else { panic!("{error}") };
        assert!(too_large.estimate.cell_count > 1e8, "{error}");
        let message = error.to_string();
        for part in ["the mesh would have about", "cells", "unknowns", "GB of memory"] {
            assert!(message.contains(part), "{message}");
        }
        assert!(!csv.exists());
    }
}
