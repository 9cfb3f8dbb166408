//! `cargo xtask reproduce-figures`: makes the runs, draws the figures, says how they compare.

mod figures;
mod findings;
mod measures;
mod page;
pub mod plan;
mod reference;
mod rows;
mod runner;
pub mod settings;
mod summary;
pub mod trajectory;
mod verdict;

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use gluey::RunReport;

use crate::book::progress::Board;
use crate::book::{BookFailure, files, jobs, keep, schedule, write_drawing};
use figures::Data;
use page::Section;
use plan::{CaseName, FigureName, RunKey};
use rows::Evidence;
use runner::Runner;
use settings::Settings;
use summary::{CompletedRun, Summary};
use trajectory::Trajectory;

/// Times shown by figures of the 2D pair end here; its exact orbit is continued to this time.
const LATEST_END: f64 = 30.0;

/// Figures to reproduce, and where to put them.
#[derive(clap::Args)]
pub struct ReproductionOptions {
    /// A coarse mesh, large time steps and shorter runs: half the time.
    #[arg(long)]
    quick: bool,
    /// Only these figures, separated by commas.
    #[arg(long, value_delimiter = ',', value_name = "FIGURES", value_parser = FigureName::named)]
    only: Vec<FigureName>,
    /// Output folder.
    #[arg(long, default_value = "target/figures", value_name = "DIR")]
    out: PathBuf,
    /// Runs at a time [default: number of cores].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

/// Makes the runs and figures; whether all is well. Failures of single runs or figures are part of the
/// summary; an error means that nothing could be written.
pub fn run(options: ReproductionOptions) -> anyhow::Result<bool> {
    let start = Instant::now();
    let ReproductionOptions { quick, only, out, jobs: wanted } = options;
    // Each once, in the paper's order.
    let figures: Vec<FigureName> =
        FigureName::all().filter(|figure| only.is_empty() || only.contains(figure)).collect();
    let runs_folder = out.join("runs");
    files::prepare_folder(&out)?;
    files::prepare_folder(&runs_folder)?;

    let mut failures = Vec::new();
    let keys = plan::runs_for(&figures, quick);
    let settings = settings(&keys, quick, &mut failures);
    let keys: Vec<RunKey> = keys.into_iter().filter(|key| settings.contains_key(key)).collect();
    let reports = make_runs(&keys, quick, &runs_folder, jobs(wanted), &mut failures);
    let data = Data { settings, quick, ..load(&figures, &runs_folder, &reports, &mut failures) };
    let evidence = Evidence { data: &data, reports: &reports };
    let sections: Vec<Section> = figures.iter().map(|&figure| section(figure, &evidence)).collect();
    let rows = rows::all(&figures, &evidence);
    for section in &sections {
        write_drawing(&out, &section.figure.to_string(), &section.drawing, &mut failures)?;
    }

    let wall_s = start.elapsed().as_secs_f64();
    let runs = runs(reports, &data.settings);
    let version = env!("CARGO_PKG_VERSION");
    let summary = Summary { version, quick, wall_s, figures, runs, failures, rows };
    let json = summary.to_json().context("cannot write summary.json")?;
    files::write(&out.join("summary.json"), json.as_bytes())?;
    files::write(&out.join("index.html"), page::html(&summary, &sections).as_bytes())?;
    summary.print(&out);
    Ok(summary.succeeded())
}

/// The settings of all runs whose case can be read.
fn settings(keys: &[RunKey], quick: bool, failures: &mut Vec<BookFailure>) -> BTreeMap<RunKey, Settings> {
    let case =
        |&key| Some((key, Settings::of(&keep(format!("run {key}"), runner::case(key, quick), failures)?)));
    keys.iter().filter_map(case).collect()
}

fn runs(reports: BTreeMap<RunKey, RunReport>, settings: &BTreeMap<RunKey, Settings>) -> Vec<CompletedRun> {
    let run = |(key, report): (RunKey, RunReport)| {
        Some(CompletedRun { name: key.name(), settings: settings.get(&key)?.clone(), report })
    };
    reports.into_iter().filter_map(run).collect()
}

/// Makes the runs.
fn make_runs(
    keys: &[RunKey],
    quick: bool,
    folder: &Path,
    jobs: usize,
    failures: &mut Vec<BookFailure>,
) -> BTreeMap<RunKey, RunReport> {
    let board = Board::new();
    let runner = Runner::new(folder, quick, &board);
    let results = schedule::in_parallel(keys, jobs, |&key| runner.run(key));
    let report = |(&key, result)| Some((key, keep(format!("run {key}"), result, failures)?));
    keys.iter().zip(results).filter_map(report).collect()
}

/// The trajectories of the runs that succeeded, and the exact ones.
fn load(
    figures: &[FigureName],
    folder: &Path,
    reports: &BTreeMap<RunKey, RunReport>,
    failures: &mut Vec<BookFailure>,
) -> Data {
    let run = |&key| {
        let run = Trajectory::read(&folder.join(format!("{key}.csv")));
        Some((key, keep(format!("run {key}"), run, failures)?))
    };
    let runs = reports.keys().filter_map(run).collect();
    let mut cases: Vec<CaseName> = figures.iter().map(|figure| figure.case()).collect();
    cases.sort();
    cases.dedup();
    let exact = |case| {
        let exact = reference::load(case, LATEST_END);
        Some((case, keep(format!("exact solution of {case}"), exact, failures)?))
    };
    Data { runs, exact: cases.into_iter().filter_map(exact).collect(), ..Data::default() }
}

fn section(figure: FigureName, evidence: &Evidence<'_>) -> Section {
    Section {
        figure,
        drawing: figures::draw(figure, evidence.data),
        table: findings::table(figure, evidence),
    }
}
