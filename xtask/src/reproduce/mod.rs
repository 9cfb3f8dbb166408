//! `cargo xtask reproduce-figures`: makes the runs, draws the figures, says how they compare.

pub mod findings;
pub mod known;
pub mod measures;
pub mod page;
pub mod plan;
pub mod reference;
pub mod rows;
mod runner;
pub mod settings;
pub mod summary;
pub mod trajectory;
pub mod verdict;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use gluey::RunReport;

use crate::book::files::{self, WriteError};
use crate::book::progress::Board;
use crate::book::{Failure, schedule, write_drawing};
use crate::figures::{self, Data};
use page::Section;
use plan::{CaseName, FigureName, RunKey};
use rows::Evidence;
use settings::Settings;
use summary::{Run, Summary};
use trajectory::Trajectory;

/// Times shown by figures of the 2D pair end here; its exact orbit is continued to this time.
const LATEST_END: f64 = 30.0;

/// Figures to reproduce, and where to put them.
#[derive(Clone, Debug)]
pub struct Options {
    /// Coarse and fast.
    pub quick: bool,
    /// The figures to make.
    pub figures: Vec<FigureName>,
    /// Folder of the workspace, where `data` lies.
    pub root: PathBuf,
    /// Output folder.
    pub out: PathBuf,
    /// Runs at a time.
    pub jobs: usize,
}

/// Makes the runs and figures. Failures of single runs or figures are part of the summary; an error means
/// that nothing could be written.
pub fn reproduce(options: &Options) -> Result<Summary, WriteError> {
    let start = Instant::now();
    let runs_folder = options.out.join("runs");
    files::prepare_folder(&options.out)?;
    files::prepare_folder(&runs_folder)?;

    let mut failures = Vec::new();
    let settings = settings(options, &mut failures);
    let reports = make_runs(options, &runs_folder, &settings, &mut failures);
    let data = Data { settings, ..load(options, &runs_folder, &reports, &mut failures) };
    let evidence = Evidence { data: &data, reports: &reports };
    let sections: Vec<Section> = options.figures.iter().map(|&figure| section(figure, &evidence)).collect();
    let rows = rows::all(&options.figures, &evidence);
    for section in &sections {
        write_drawing(&options.out, section.figure.as_str(), &section.drawing, &mut failures)?;
    }

    let summary = Summary {
        version: env!("CARGO_PKG_VERSION"),
        quick: options.quick,
        wall_s: start.elapsed().as_secs_f64(),
        figures: options.figures.clone(),
        rows,
        runs: runs(reports, &data.settings),
        failures,
    };
    write_summary(&options.out, &summary)?;
    files::write(&options.out.join("index.html"), page::html(&summary, &sections).as_bytes())?;
    Ok(summary)
}

/// The settings of all runs whose case can be read.
fn settings(options: &Options, failures: &mut Vec<Failure>) -> BTreeMap<RunKey, Settings> {
    let mut settings = BTreeMap::new();
    for key in plan::runs_for(&options.figures, options.quick) {
        match runner::case(&options.root, key, options.quick) {
            Ok(case) => drop(settings.insert(key, Settings::of(&case))),
            Err(error) => failures.push(Failure::new(format!("run {key}"), &error)),
        }
    }
    settings
}

fn runs(reports: BTreeMap<RunKey, RunReport>, settings: &BTreeMap<RunKey, Settings>) -> Vec<Run> {
    let run = |(key, report): (RunKey, RunReport)| {
        Some(Run { name: key.name(), settings: settings.get(&key)?.clone(), report })
    };
    reports.into_iter().filter_map(run).collect()
}

/// Makes the runs whose case could be read, the longest first.
fn make_runs(
    options: &Options,
    folder: &Path,
    settings: &BTreeMap<RunKey, Settings>,
    failures: &mut Vec<Failure>,
) -> BTreeMap<RunKey, RunReport> {
    let mut keys = plan::runs_for(&options.figures, options.quick);
    keys.retain(|key| settings.contains_key(key));
    let board = Board::new();
    let results = schedule::in_parallel(&keys, options.jobs, |&key| {
        runner::run(&options.root, folder, key, options.quick, &board)
    });
    let mut reports = BTreeMap::new();
    for (key, result) in keys.into_iter().zip(results) {
        match result {
            Ok(report) => drop(reports.insert(key, report)),
            Err(error) => failures.push(Failure::new(format!("run {key}"), &error)),
        }
    }
    reports
}

/// The trajectories of the runs that succeeded, and the exact ones.
fn load(
    options: &Options,
    folder: &Path,
    reports: &BTreeMap<RunKey, RunReport>,
    failures: &mut Vec<Failure>,
) -> Data {
    let mut data = Data { quick: options.quick, ..Data::default() };
    let mut keep = |what: String, result: Result<Trajectory, trajectory::TrajectoryError>| {
        result.map_err(|error| failures.push(Failure::new(what, &error))).ok()
    };
    for &key in reports.keys() {
        let run = keep(format!("run {key}"), Trajectory::read(&folder.join(format!("{key}.csv"))));
        data.runs.extend(run.map(|run| (key, run)));
    }
    let mut cases: Vec<CaseName> = options.figures.iter().map(|figure| figure.case()).collect();
    cases.sort();
    cases.dedup();
    for case in cases {
        let exact =
            keep(format!("exact solution of {case}"), reference::load(&options.root, case, LATEST_END));
        data.exact.extend(exact.map(|exact| (case, exact)));
    }
    data
}

fn section(figure: FigureName, evidence: &Evidence<'_>) -> Section {
    Section {
        figure,
        drawing: figures::draw(figure, evidence.data),
        table: findings::table(figure, evidence),
    }
}

fn write_summary(out: &Path, summary: &Summary) -> Result<(), WriteError> {
    let path = out.join("summary.json");
    match summary.to_json() {
        Ok(json) => files::write(&path, json.as_bytes()),
        Err(error) => Err(WriteError { path, source: error.into() }),
    }
}
