//! `cargo xtask study NAME`: a table, pictures and a page from many runs of one case, beside the literature.
//!
//! Cases are those of `data/studies`. Points that are complete are not run again, and points that were
//! stopped go on from their last checkpoint.

mod drawing;
mod page;
mod point;
mod reversibility;
mod settling;
mod viscosity;

use std::path::PathBuf;
use std::time::Instant;

use clap::ValueEnum;
use gluey_pictures::Canvas;

use crate::book::files::{self, WriteError};
use crate::book::progress::Board;
use crate::book::{Failure, schedule, write_drawing};
use point::{Done, Point};

/// The studies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Name {
    /// Relative viscosity of sheared spheres against their fraction.
    Viscosity,
    /// Particles that do not come back in an oscillating shear, against its amplitude.
    Reversibility,
    /// Settling velocity of spheres against their fraction.
    Settling,
}

/// What to compute, and where to put it.
#[derive(Clone, Debug)]
pub struct Options {
    /// The study.
    pub name: Name,
    /// Few points and short runs.
    pub quick: bool,
    /// Folder of the workspace, where `data` lies.
    pub root: PathBuf,
    /// Output folder; `target/studies/NAME` when absent.
    pub out: PathBuf,
    /// Runs at a time.
    pub jobs: usize,
}

/// A study.
struct Study {
    title: &'static str,
    /// What is computed and beside what, as HTML.
    text: &'static str,
    /// The runs.
    points: fn(quick: bool) -> Vec<Point>,
    /// What comes out of the runs that succeeded.
    findings: fn(&[Done]) -> Result<Findings, point::PointError>,
}

/// What comes out of a study.
struct Findings {
    /// Names of the columns, and rows.
    columns: Vec<&'static str>,
    rows: Vec<Vec<String>>,
    /// Pictures with names.
    drawings: Vec<(&'static str, Canvas)>,
    /// What the numbers say, as HTML.
    remarks: Vec<String>,
}

impl Name {
    fn study(self) -> Study {
        match self {
            Self::Viscosity => viscosity::STUDY,
            Self::Reversibility => reversibility::STUDY,
            Self::Settling => settling::STUDY,
        }
    }

    /// Name of its folder.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Viscosity => "viscosity",
            Self::Reversibility => "reversibility",
            Self::Settling => "settling",
        }
    }
}

/// Makes the runs and writes `table.csv`, pictures and `index.html`. What failed is told and on the page.
///
/// # Errors
/// If nothing can be written.
pub fn study(options: &Options) -> Result<Vec<Failure>, WriteError> {
    let start = Instant::now();
    let study = options.name.study();
    let out = &options.out;
    files::prepare_folder(out)?;
    let points = (study.points)(options.quick);
    let board = Board::new();
    let results = schedule::in_parallel(&points, options.jobs, |point| {
        point.run(&options.root.join("data/studies"), &out.join("runs"), &board)
    });
    let (mut done, mut failures) = (Vec::new(), Vec::new());
    for (point, result) in points.iter().zip(results) {
        match result {
            Ok(run) => done.push(run),
            Err(error) => failures.push(Failure::new(point.name.clone(), &error)),
        }
    }
    let findings = (study.findings)(&done).unwrap_or_else(|error| {
        failures.push(Failure::new("what comes out".to_owned(), &error));
        Findings { columns: Vec::new(), rows: Vec::new(), drawings: Vec::new(), remarks: Vec::new() }
    });
    files::write(&out.join("table.csv"), page::csv(&findings).as_bytes())?;
    for (name, drawing) in &findings.drawings {
        write_drawing(out, name, drawing, &mut failures)?;
    }
    let effort = page::Effort::of(&done, start.elapsed().as_secs_f64());
    let html = page::html(&study, &findings, &effort, &failures, options.quick);
    files::write(&out.join("index.html"), html.as_bytes())?;
    Ok(failures)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    #[test]
    fn all_points_are_good_cases_with_names_of_their_own() {
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/studies");
        for name in Name::value_variants() {
            let quick = (name.study().points)(true);
            for point in &quick {
                point.case(&data).unwrap_or_else(|error| panic!("{}: {error}", point.name));
            }
            let all = (name.study().points)(false);
            assert!(quick.len() < all.len());
            let names: BTreeSet<&str> = all.iter().map(|point| &point.name[..]).collect();
            assert_eq!(names.len(), all.len());
        }
    }
}
