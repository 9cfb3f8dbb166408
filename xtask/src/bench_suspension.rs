//! `cargo xtask bench-suspension`: the cost of a step of a sheared suspension, as one line of JSON.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::{Context, bail};
use gluey::output::solver_log::SolverRow;
use gluey::table::NumberTable;
use gluey::{Case, CaseError, PhaseTable, Progress, ProgressState, ResultPaths, RunOptions, RunReport};
use serde_json::{Map, Value, json};

/// Strain of a step.
const STEP: f64 = 0.025;

/// Tolerances of the linear solves: the default, and that of what errors are measured against.
const USUAL: f64 = 1e-6;
const REFERENCE: f64 = 1e-8;

/// The suspension and the steps that are measured.
#[derive(Clone, Debug, clap::Args)]
pub struct SuspensionBenchOptions {
    /// Number of particles.
    #[arg(long, default_value_t = 20, value_name = "N")]
    count: usize,
    /// Volume fraction (2D: of the area).
    #[arg(long, default_value_t = 0.3, value_name = "PHI")]
    fraction: f64,
    /// 2 or 3.
    #[arg(long, default_value_t = 3, value_name = "D")]
    dimension: usize,
    /// Cells in a radius, at least.
    #[arg(long, default_value_t = 2.0, value_name = "CELLS")]
    cells_per_radius: f64,
    /// Cells along an edge on the coarsest mesh, in place of what a case without them gets.
    #[arg(long, value_name = "N")]
    root_cells: Option<usize>,
    /// Steps that are measured, after a first one.
    #[arg(long, default_value = "3", value_name = "N")]
    steps: NonZeroUsize,
    /// Threads; with one, seconds are CPU seconds.
    #[arg(long, default_value = "1", value_name = "N")]
    threads: NonZeroUsize,
    /// Seed of the configuration.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Compares viscosity and motions with those on a mesh with so many cells in a radius, solved to 1e-8.
    #[arg(long, value_name = "CELLS", num_args = 0..=1, default_missing_value = "4.8")]
    error: Option<f64>,
}

/// Measures, and prints the line. Seconds are wall time unless their name says CPU.
pub fn run(options: &SuspensionBenchOptions) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads.get()).build();
    let pool = pool.context("no pool of threads")?;
    let Timed { report, start, ends, motion } =
        pool.install(|| timed_run(options, 1 + options.steps.get(), USUAL))?;
    let memory = gluey::memory::peak();
    let error = options.error.map(|cells| pool.install(|| errors(options, cells, &motion))).transpose()?;
    let [first, .., last] = &ends[..] else { bail!("the run ended after {} steps", ends.len()) };
    let steps = options.steps.get() as f64;
    let cpu = (last.cpu - first.cpu) / steps;
    let per_step = |name: &str| (seconds(&last.phases, name) - seconds(&first.phases, name)) / steps;
    let phases = last.phases.rows().iter().map(|(name, _)| (name.clone(), per_step(name).into()));
    let mut measured = json!({
        "dimension": options.dimension,
        "particles": options.count,
        "volume_fraction": options.fraction,
        "cells": report.cells,
        "cells_per_radius": report.cells_per_radius,
        "unknowns": report.dofs,
        "threads": options.threads,
        "steps": options.steps,
        "first_step_s": first.at.duration_since(start).as_secs_f64(),
        "step_s": last.at.duration_since(first.at).as_secs_f64() / steps,
        "step_cpu_s": cpu,
        "step_cpu_s_per_million_unknowns": cpu / (1e-6 * report.dofs as f64),
        // Of a step after the first.
        "phases_s": phases.collect::<Map<_, _>>(),
        "peak_memory_bytes": memory,
        "peak_bytes_per_unknown": memory.map(|bytes| bytes / report.dofs.max(1) as u64),
        "steps_to_strain_1": 1.0 / STEP,
        "sphere_steps_an_hour": 3600.0 * options.count as f64 / cpu,
        "viscosity": motion.viscosity,
    });
    if let (Some(error), Some(measured)) = (error, measured.as_object_mut()) {
        measured.extend(error);
    }
    println!("{measured}");
    Ok(())
}

/// A run, when its steps ended, and its first step.
struct Timed {
    report: RunReport,
    start: Instant,
    ends: Vec<StepEnd>,
    motion: FirstStep,
}

/// The end of a step.
struct StepEnd {
    at: Instant,
    /// Of this process.
    cpu: f64,
    /// Of the run so far.
    phases: PhaseTable,
}

/// Takes note of the ends of steps.
#[derive(Default)]
struct Clock(Mutex<Vec<StepEnd>>);

impl Progress for Clock {
    fn report(&self, _: &ProgressState) {}

    fn step(&self, row: &SolverRow<'_>) {
        // The last flow of a run moves nothing.
        if row.motion.parts > 0 {
            let end = StepEnd { at: Instant::now(), cpu: cpu_seconds(), phases: row.phases.clone() };
            self.0.lock().unwrap_or_else(PoisonError::into_inner).push(end);
        }
    }
}

/// The flow around the first configuration.
struct FirstStep {
    viscosity: f64,
    /// Mean velocities in the first step beyond those of the undisturbed flow, one component after another.
    velocities: Vec<f64>,
    /// Spins beyond that of the undisturbed flow.
    spins: Vec<f64>,
}

/// A run of so many steps.
fn timed_run(options: &SuspensionBenchOptions, steps: usize, tolerance: f64) -> anyhow::Result<Timed> {
    let case = case(options, steps, tolerance).context("these options make no case")?;
    let folder = tempfile::tempdir().context("no folder for the results")?;
    let csv = folder.path().join("bench.csv");
    let (start, clock) = (Instant::now(), Clock::default());
    let report = gluey::run(&case, &RunOptions::csv(&csv), &clock)?;
    let ends = clock.0.into_inner().unwrap_or_else(PoisonError::into_inner);
    let motion = FirstStep::read(&ResultPaths::of_csv(&csv), options)?;
    Ok(Timed { report, start, ends, motion })
}

/// What the first step differs by from that on a finer mesh: the viscosity over the finer one, velocities and
/// spins as root mean squares over those of the finer ones.
fn errors(
    options: &SuspensionBenchOptions,
    cells_per_radius: f64,
    motion: &FirstStep,
) -> anyhow::Result<Map<String, Value>> {
    let fine = SuspensionBenchOptions { cells_per_radius, root_cells: None, ..options.clone() };
    let Timed { report, motion: truth, .. } = timed_run(&fine, 1, REFERENCE)?;
    let off = |found: &[f64], exact: &[f64]| {
        let square = |x: f64| x * x;
        let error: f64 = found.iter().zip(exact).map(|(a, b)| square(a - b)).sum();
        (error / exact.iter().copied().map(square).sum::<f64>()).sqrt()
    };
    let errors = json!({
        "viscosity_error": motion.viscosity / truth.viscosity - 1.0,
        "velocity_error": off(&motion.velocities, &truth.velocities),
        "spin_error": off(&motion.spins, &truth.spins),
        "reference_cells_per_radius": report.cells_per_radius,
        "reference_viscosity": truth.viscosity,
    });
    Ok(errors.as_object().cloned().unwrap_or_default())
}

impl FirstStep {
    fn read(paths: &ResultPaths, options: &SuspensionBenchOptions) -> anyhow::Result<Self> {
        let table = |path: PathBuf| -> anyhow::Result<NumberTable> {
            Ok(NumberTable::parse(&std::fs::read_to_string(&path).context("no results")?)?)
        };
        let [trajectory, rheology] = [table(paths.csv())?, table(paths.rheology())?];
        let (mut velocities, mut spins) = (Vec::new(), Vec::new());
        for k in 1..=options.count {
            for axis in ["x", "y", "z"].iter().take(options.dimension) {
                let x = trajectory.column(&format!("{axis}{k}"))?;
                let shear = if *axis == "x" { trajectory.column(&format!("y{k}"))?[0] - 0.5 } else { 0.0 };
                velocities.push((x[1] - x[0]) / STEP - shear);
            }
            let axes: &[&str] = if options.dimension == 2 { &[""] } else { &["x", "y", "z"] };
            for axis in axes {
                let undisturbed = if matches!(*axis, "" | "z") { -0.5 } else { 0.0 };
                spins.push(trajectory.column(&format!("omega{k}{axis}"))?[0] - undisturbed);
            }
        }
        Ok(Self { viscosity: rheology.column("viscosity")?[0], velocities, spins })
    }
}

fn case(options: &SuspensionBenchOptions, steps: usize, tolerance: f64) -> Result<Case, CaseError> {
    let SuspensionBenchOptions { count, fraction, dimension, cells_per_radius, root_cells, seed, .. } =
        options;
    let end = STEP * steps as f64;
    let root_cells = root_cells.map_or_else(String::new, |count| format!("root_cells = {count}\n"));
    let text = format!(
        "name = \"bench\"\ndimension = {dimension}\n[domain]\nboundary = \"sheared\"\n\
         [suspension]\nvolume_fraction = {fraction:?}\ncount = {count}\nseed = {seed}\nmin_gap = 0.02\n\
         [time]\nstep = {STEP:?}\nend = {end:?}\n[contact]\nstrategy = \"none\"\n[flow]\nformulation = \"unfitted\"\n\
         tolerance = {tolerance:e}\n\
         [flow.mesh]\ncells_per_radius = {cells_per_radius:?}\n{root_cells}"
    );
    Case::parse(&text, "bench-suspension")
}

fn seconds(phases: &PhaseTable, phase: &str) -> f64 {
    phases.rows().iter().filter(|(name, _)| name == phase).map(|(_, seconds)| seconds).sum()
}

#[cfg(unix)]
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Not measured here.
#[cfg(not(unix))]
fn cpu_seconds() -> f64 {
    f64::NAN
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(count: usize, dimension: usize) -> SuspensionBenchOptions {
        SuspensionBenchOptions {
            count,
            fraction: 0.2,
            dimension,
            cells_per_radius: 2.0,
            root_cells: None,
            steps: NonZeroUsize::MIN,
            threads: NonZeroUsize::MIN,
            seed: 1,
            error: None,
        }
    }

    #[test]
    fn a_case_has_the_steps_asked_for() {
        for dimension in [2, 3] {
            let case = case(&options(10, dimension), 3, USUAL).unwrap();
            assert_eq!(case.particles.len(), 10);
            assert!((case.time.end / case.time.step - 3.0).abs() < 1e-9);
        }
    }

    #[test]
    fn options_that_make_no_case_are_told() {
        let error = case(&options(10, 4), 1, USUAL).unwrap_err().to_string();
        assert!(error.contains("dimension"), "{error}");
    }

    #[test]
    fn every_step_has_its_end() {
        let Timed { start, ends, .. } = timed_run(&options(10, 2), 3, USUAL).unwrap();
        assert_eq!(ends.len(), 3);
        let first = StepEnd { at: start, cpu: 0.0, phases: PhaseTable::default() };
        for (before, end) in std::iter::once(&first).chain(&ends).zip(&ends) {
            let step = end.at.duration_since(before.at).as_secs_f64();
            let phases = ["mesh and assembly", "solver set-up", "solve"]
                .map(|name| seconds(&end.phases, name) - seconds(&before.phases, name));
            assert!(phases.iter().all(|seconds| *seconds > 0.0), "{phases:?}");
            assert!(end.cpu > before.cpu || cfg!(not(unix)));
            assert!(phases.iter().sum::<f64>() < step, "{phases:?} of {step}");
        }
    }

    /// None on the same mesh but for the tolerance, some per cent on one with twice the cells in a radius.
    #[test]
    fn errors_are_those_of_the_mesh() {
        let options = options(10, 2);
        let motion = timed_run(&options, 1, USUAL).unwrap().motion;
        let error =
            |cells: f64, of: &str| errors(&options, cells, &motion).unwrap()[of].as_f64().unwrap().abs();
        for (of, least) in [("viscosity_error", 1e-4), ("velocity_error", 1e-3), ("spin_error", 1e-3)] {
            let [same, finer] = [2.0, 4.0].map(|cells| error(cells, of));
            assert!(same < 1e-5 && least < finer && finer < 0.2, "{of}: {same}, {finer}");
        }
    }
}
