//! Suspensions that are sheared for ever.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use gluey::{Case, Progress, ProgressState, RunError, RunOptions, Silent, run};
use tempfile::TempDir;

/// Six discs at 0.2, or three spheres, in a box that is sheared.
fn case(dimension: usize, rest: &str) -> Case {
    let (count, fraction) = if dimension == 2 { (6, 0.2) } else { (3, 0.1) };
    let text = format!(
        "name = \"s\"\ndimension = {dimension}\ndomain = {{ boundary = \"sheared\" }}\n\
         suspension = {{ volume_fraction = {fraction}, count = {count}, seed = 3, min_gap = 0.05 }}\n\
         contact = {{ strategy = \"none\" }}\n{rest}\n\
         [flow]\nformulation = \"unfitted\"\n[flow.mesh]\ncells_per_radius = 2.0\ncoarsest_level = 2\n"
    );
    Case::parse(&text, "s.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// Columns of a file by name.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).expect("a table");
    let place = text.lines().next().expect("a header").split(',').position(|n| n == name).expect(name);
    let number =
        |line: &str| line.split(',').nth(place).and_then(|cell| cell.parse().ok()).expect("a number");
    text.lines().skip(1).map(number).collect()
}

/// Runs to the end; trajectory and rheology.
fn files(case: &Case, folder: &Path, name: &str) -> [std::path::PathBuf; 2] {
    let csv = folder.join(format!("{name}.csv"));
    run(case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error}"));
    [csv, folder.join(format!("{name}-rheology.csv"))]
}

/// Over more than a unit of strain, with the tilt wrapped round twice.
#[test]
fn the_viscosity_is_continuous_and_the_same_by_two_routes() {
    let folder = TempDir::new().expect("a folder");
    let case = case(2, "time = { step = 0.05, end = 1.6 }\nrheology = { every = 2 }");
    let [_, rheology] = files(&case, folder.path(), "two");
    let viscosity = column(&rheology, "viscosity");
    assert_eq!(viscosity.len(), 17);
    let other = column(&rheology, "viscosity_by_dissipation");
    let miss = viscosity.iter().zip(&other).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    assert!(miss < 5e-3, "{miss}");
    // Second differences see a jump where the tilt wraps round, at a strain of 0.5 and of 1.5.
    let bend = viscosity.windows(3).map(|v| (v[0] - 2.0 * v[1] + v[2]).abs()).fold(0.0, f64::max);
    let range = viscosity.iter().fold(0.0f64, |range, v| range.max((v - viscosity[0]).abs()));
    println!("routes {miss:.1e}, bend {bend:.1e}, range {range:.1e}");
    assert!(bend < 0.5 * range && viscosity.iter().all(|v| (1.3..2.5).contains(v)), "{viscosity:?}");
}

/// Forward and back: the error is of second order in the time step.
#[test]
fn sheared_back_the_discs_return() {
    let folder = TempDir::new().expect("a folder");
    let error = |step: f64| {
        let case = case(2, &format!("time = {{ step = {step}, end = 1.2, reverse_at = 0.6 }}"));
        let name = format!("back-{step}");
        let [csv, _] = files(&case, folder.path(), &name);
        let a = case.mean_radius();
        let of_disc = |k: usize| {
            let [x, y] = ["x", "y"].map(|axis| column(&csv, &format!("{axis}{}", k + 1)));
            let last = x.len() - 1;
            ((x[last] - x[0]).powi(2) + (y[last] - y[0]).powi(2)) / (a * a)
        };
        ((0..6).map(of_disc).sum::<f64>() / 6.0).sqrt()
    };
    let [coarse, fine] = [0.1, 0.05].map(error);
    println!("rms distance from the start: {coarse:.2e} {fine:.2e}");
    assert!(fine < 5e-3 && coarse > 2.5 * fine, "{coarse} {fine}");
}

#[test]
fn in_an_oscillating_shear_the_discs_return_in_every_cycle() {
    let folder = TempDir::new().expect("a folder");
    let case = case(2, "time = { step = 0.05, end = 1.6, strain_amplitude = 0.2 }");
    let [csv, rheology] = files(&case, folder.path(), "cycles");
    let strains = column(&rheology, "strain");
    let expected = (0..=32).map(|step| case.strain_after(step));
    assert!(strains.iter().zip(expected).all(|(found, exact)| (found - exact).abs() < 1e-12), "{strains:?}");
    let largest = strains.iter().fold(0.0f64, |largest, strain| largest.max(strain.abs()));
    assert!((largest - 0.2).abs() < 1e-12, "{largest}");
    let moved = |step: usize| {
        let of_column = |k: usize, axis: &str| {
            let x = column(&csv, &format!("{axis}{}", k + 1));
            (x[step] - x[0]).powi(2)
        };
        let squares: f64 = (0..6).map(|k| of_column(k, "x") + of_column(k, "y")).sum();
        (squares / 6.0).sqrt() / case.mean_radius()
    };
    let [quarter, first, second] = [4, 16, 32].map(moved);
    println!("rms distance in radii: after a quarter {quarter:.1e}, one cycle {first:.1e}, two {second:.1e}");
    assert!(quarter > 0.1 && first < 1e-3 && second < 1e-3, "{quarter} {first} {second}");
}

/// Interrupts a run when it has reached a step.
struct StopAt(usize, Arc<AtomicBool>);

impl Progress for StopAt {
    fn report(&self, state: &ProgressState<'_>) {
        if state.step >= self.0 {
            self.1.store(true, Ordering::Relaxed);
        }
    }
}

#[test]
fn runs_resume_bit_by_bit_with_their_rheology() {
    for dimension in [2, 3] {
        let folder = TempDir::new().expect("a folder");
        let steps = if dimension == 2 { 12.0 } else { 4.0 };
        let time = format!("shear_rate = 2.0\ntime = {{ step = 0.05, end = {} }}", 0.05 * steps);
        let case = case(dimension, &time);
        let whole = files(&case, folder.path(), "whole");
        let csv = folder.path().join("t.csv");
        let checkpoint = folder.path().join("c.checkpoint");
        let interrupt = Arc::new(AtomicBool::new(false));
        let options = RunOptions { checkpoint: Some(checkpoint.clone()), ..RunOptions::csv(&csv) };
        let stopped = RunOptions { interrupt: Some(interrupt.clone()), ..options.clone() };
        match run(&case, &stopped, &StopAt(2, interrupt)) {
            Err(RunError::Interrupted { .. }) => {}
            other => panic!("{other:?}"),
        }
        let resumed = RunOptions { resume: Some(checkpoint), ..options };
        run(&case, &resumed, &Silent).unwrap_or_else(|error| panic!("{error}"));
        let parts = [csv, folder.path().join("t-rheology.csv")];
        for (whole, part) in whole.iter().zip(&parts) {
            let read = |path: &Path| fs::read_to_string(path).expect("a file");
            assert_eq!(read(whole), read(part), "{dimension}D");
        }
    }
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let case = case(3, "time = { step = 0.1, end = 0.2 }");
    let [one, two] = [1, 2].map(|threads| {
        let folder = TempDir::new().expect("a folder");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let paths = pool.install(|| files(&case, folder.path(), "t"));
        paths.map(|path| fs::read_to_string(path).expect("a file"))
    });
    assert_eq!(one, two);
}

/// Spheres that settle in a periodic box: the mean velocity of fluid and spheres is zero, so they fall slower
/// than one alone.
#[test]
fn weight_is_balanced_by_a_gradient_of_the_pressure() {
    let folder = TempDir::new().expect("a folder");
    let case = case(3, "shear_rate = 1e-3\ngravity = [0.0, 0.0, -1.0]\ntime = { step = 0.01, end = 0.02 }");
    let [csv, _] = files(&case, folder.path(), "falls");
    let a = case.mean_radius();
    let fall = |k: usize| {
        let z = column(&csv, &format!("z{k}"));
        (z[1] - z[0]) / 0.01
    };
    let mean = (1..=3).map(fall).sum::<f64>() / 3.0;
    let alone = -2.0 / 9.0 * a * a;
    assert!(mean / alone > 0.2 && mean / alone < 0.8, "{mean} {alone}");
}

#[test]
fn what_does_not_go_together_is_refused() {
    let text = |boundary: &str, flow: &str| {
        format!(
            "name = \"s\"\ndimension = 2\nparticles = [{{ position = [0.5, 0.5], radius = 0.1 }}]\n\
             time = {{ step = 0.1, end = 1.0 }}\ndomain = {{ boundary = \"{boundary}\" }}\n{flow}"
        )
    };
    for (flow, wanted) in [
        ("flow = { formulation = \"paper\" }", "unfitted"),
        ("flow = { formulation = \"unfitted\" }\nrheology = { every = 0 }", "1 or more"),
    ] {
        let error = Case::parse(&text("sheared", flow), "s.toml").expect_err("refused");
        let message = format!("{error:?}{error}");
        assert!(message.contains(wanted), "{message}");
    }
}
