//! `cargo xtask bench-suspension`: the cost of a step of a sheared suspension, as one line of JSON.

use std::num::NonZeroUsize;

use anyhow::Context;
use gluey::{Case, CaseError, RunOptions, RunReport, Silent};
use serde_json::{Map, json};

/// Strain of a step.
const STEP: f64 = 0.025;

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
    /// Cells along an edge on the coarsest mesh.
    #[arg(long, default_value_t = 1, value_name = "N")]
    root_cells: usize,
    /// Steps that are measured, after a first one.
    #[arg(long, default_value = "3", value_name = "N")]
    steps: NonZeroUsize,
    /// Threads; with one, seconds are CPU seconds.
    #[arg(long, default_value = "1", value_name = "N")]
    threads: NonZeroUsize,
    /// Seed of the configuration.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Measures, and prints the line. Seconds are wall time unless their name says CPU.
pub fn run(options: &SuspensionBenchOptions) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads.get()).build();
    let pool = pool.context("no pool of threads")?;
    let (first, one) = pool.install(|| timed_run(options, 1))?;
    let (report, all) = pool.install(|| timed_run(options, 1 + options.steps.get()))?;
    let steps = options.steps.get() as f64;
    let cpu = (all - one) / steps;
    let per_step = |name: &str| (seconds(&report, name) - seconds(&first, name)) / steps;
    let phases = report.phases.iter().map(|(name, _)| (name.clone(), per_step(name).into()));
    let memory = gluey::memory::peak();
    let measured = json!({
        "dimension": options.dimension,
        "particles": options.count,
        "volume_fraction": options.fraction,
        "cells": report.cells,
        "unknowns": report.dofs,
        "threads": options.threads,
        "steps": options.steps,
        "first_step_s": first.wall_s,
        "step_s": (report.wall_s - first.wall_s) / steps,
        "step_cpu_s": cpu,
        "step_cpu_s_per_million_unknowns": cpu / (1e-6 * report.dofs as f64),
        // Of a step after the first.
        "phases_s": phases.collect::<Map<_, _>>(),
        "peak_memory_bytes": memory,
        "peak_bytes_per_unknown": memory.map(|bytes| bytes / report.dofs.max(1) as u64),
        "steps_to_strain_1": 1.0 / STEP,
    });
    println!("{measured}");
    Ok(())
}

/// A run of so many steps, and its CPU seconds.
fn timed_run(options: &SuspensionBenchOptions, steps: usize) -> anyhow::Result<(RunReport, f64)> {
    let case = case(options, steps).context("these options make no case")?;
    let folder = tempfile::tempdir().context("no folder for the results")?;
    let start = cpu_seconds();
    let report = gluey::run(&case, &RunOptions::csv(folder.path().join("bench.csv")), &Silent)?;
    Ok((report, cpu_seconds() - start))
}

fn case(options: &SuspensionBenchOptions, steps: usize) -> Result<Case, CaseError> {
    let SuspensionBenchOptions { count, fraction, dimension, cells_per_radius, root_cells, seed, .. } =
        options;
    let end = STEP * steps as f64;
    let text = format!(
        "name = \"bench\"\ndimension = {dimension}\n[domain]\nboundary = \"sheared\"\n\
         [suspension]\nvolume_fraction = {fraction:?}\ncount = {count}\nseed = {seed}\nmin_gap = 0.02\n\
         [time]\nstep = {STEP:?}\nend = {end:?}\n[contact]\nstrategy = \"none\"\n[flow]\nformulation = \"unfitted\"\n\
         [flow.mesh]\ncells_per_radius = {cells_per_radius:?}\nroot_cells = {root_cells}\n"
    );
    Case::parse(&text, "bench-suspension")
}

fn seconds(report: &RunReport, phase: &str) -> f64 {
    report.phases.iter().filter(|(name, _)| name == phase).map(|(_, seconds)| seconds).sum()
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
            root_cells: 1,
            steps: NonZeroUsize::MIN,
            threads: NonZeroUsize::MIN,
            seed: 1,
        }
    }

    #[test]
    fn a_case_has_the_steps_asked_for() {
        for dimension in [2, 3] {
            let case = case(&options(10, dimension), 3).unwrap();
            assert_eq!(case.particles.len(), 10);
            assert!((case.time.end / case.time.step - 3.0).abs() < 1e-9);
        }
    }

    #[test]
    fn options_that_make_no_case_are_told() {
        let error = case(&options(10, 4), 1).unwrap_err().to_string();
        assert!(error.contains("dimension"), "{error}");
    }
}
