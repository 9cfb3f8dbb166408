//! Runs of cases, and what they wrote.

#![allow(dead_code, reason = "each test that shares this needs another part of it")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use gluey::{Case, Progress, ProgressState, RunError, RunOptions, RunReport, Silent};
use gluey_geom::Vector;
use gluey_testkit::compute_alone;
use tempfile::TempDir;

/// The case of a text.
pub fn case(text: &str) -> Case {
    Case::parse(text, "case.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// Runs on the thread of the test.
pub fn run(case: &Case, options: &RunOptions, progress: &dyn Progress) -> Result<RunReport, RunError> {
    compute_alone();
    gluey::run(case, options, progress)
}

/// Runs to the end with a trajectory of this name.
pub fn run_named(case: &Case, folder: &Path, name: &str) -> PathBuf {
    let csv = folder.join(format!("{name}.csv"));
    run(case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error}"));
    csv
}

/// Runs to the end and reads with `read` what the files beside the trajectory say.
pub fn ran<T>(case: &Case, read: impl FnOnce(&Path) -> T) -> T {
    let folder = TempDir::new().expect("a folder");
    read(&run_named(case, folder.path(), "t"))
}

/// Why a run ends.
pub fn failure(case: &Case) -> RunError {
    let folder = TempDir::new().expect("a folder");
    run(case, &RunOptions::csv(folder.path().join("t.csv")), &Silent).expect_err("it fails")
}

/// The file `<stem>-<what>.csv` beside a trajectory.
pub fn beside(csv: &Path, what: &str) -> PathBuf {
    let stem = csv.file_stem().and_then(|stem| stem.to_str()).expect("a name");
    csv.with_file_name(format!("{stem}-{what}.csv"))
}

/// A column of a file by name.
pub fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).expect("a table");
    let place = text.lines().next().expect("a header").split(',').position(|n| n == name).expect(name);
    let number =
        |line: &str| line.split(',').nth(place).and_then(|cell| cell.parse().ok()).expect("a number");
    text.lines().skip(1).map(number).collect()
}

/// Columns `<name>x`, `<name>y`... as vectors.
pub fn vectors<const D: usize>(path: &Path, name: &str) -> Vec<Vector<D>> {
    let columns: Vec<Vec<f64>> =
        ["x", "y", "z"][..D].iter().map(|axis| column(path, &format!("{name}{axis}"))).collect();
    (0..columns[0].len()).map(|row| Vector::from_fn(|d, _| columns[d][row])).collect()
}

/// Centres in every row.
pub fn centers<const D: usize>(csv: &Path, count: usize) -> Vec<Vec<Vector<D>>> {
    let columns: Vec<Vec<Vec<f64>>> = (1..=count)
        .map(|k| ["x", "y", "z"][..D].iter().map(|axis| column(csv, &format!("{axis}{k}"))).collect())
        .collect();
    let row = |row: usize| columns.iter().map(|x| Vector::from_fn(|d, _| x[d][row])).collect();
    (0..columns[0][0].len()).map(row).collect()
}

/// Root of the mean square distance between two lists of points.
pub fn rms_distance<const D: usize>(a: &[Vector<D>], b: &[Vector<D>]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum();
    (sum / a.len() as f64).sqrt()
}

/// Interrupts a run when it has reached a step.
struct StopAt(usize, Arc<AtomicBool>);

impl Progress for StopAt {
    fn report(&self, state: &ProgressState) {
        if state.step >= self.0 {
            self.1.store(true, Ordering::Relaxed);
        }
    }
}

/// The trajectory and the files `<stem>-<what>.csv`.
fn texts(csv: &Path, what: &[&str]) -> Vec<String> {
    let paths = std::iter::once(csv.to_owned()).chain(what.iter().map(|what| beside(csv, what)));
    paths.map(|path| fs::read_to_string(path).expect("a file")).collect()
}

/// Asserts that a run that stops at a step and goes on writes the bits of one that does not.
pub fn resumes_bit_by_bit(case: &Case, step: usize, what: &[&str]) {
    let folder = TempDir::new().expect("a folder");
    let whole = run_named(case, folder.path(), "whole");
    let (csv, checkpoint) = (folder.path().join("parts.csv"), folder.path().join("c.checkpoint"));
    let interrupt = Arc::new(AtomicBool::new(false));
    let options = RunOptions { checkpoint: Some(checkpoint.clone()), ..RunOptions::csv(&csv) };
    let stopped = RunOptions { interrupt: Some(interrupt.clone()), ..options.clone() };
    match run(case, &stopped, &StopAt(step, interrupt)) {
        Err(RunError::Interrupted(_)) => {}
        other => panic!("{other:?}"),
    }
    let resumed = RunOptions { resume: Some(checkpoint), ..options };
    run(case, &resumed, &Silent).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(texts(&whole, what), texts(&csv, what), "{}D", case.dimension);
}

/// Asserts that one thread and two write the same bits.
pub fn threads_give_the_same_bits(case: &Case, what: &[&str]) {
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| ran(case, |csv| texts(csv, what)))
    });
    assert_eq!(one, two);
}
