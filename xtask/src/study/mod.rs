//! `cargo xtask study NAME`: a table, pictures and a page from many runs of one case, beside the literature.
//!
//! Cases are those of `data/studies`. Points that are complete are not run again, and points that were
//! stopped go on from their last checkpoint.

mod drawing;
mod findings;
mod friction;
mod page;
mod point;
mod reversal;
mod reversibility;
mod rough;
mod settling;
mod steady;
mod thickening;
mod viscosity;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::bail;
use clap::ValueEnum;

use crate::book::progress::Board;
use crate::book::{files, jobs, keep, schedule, write_drawing};
use crate::workspace_root;
use findings::Study;
use point::{Done, StudyPoint};

/// The studies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Name {
    /// Relative viscosity of sheared spheres against their fraction.
    Viscosity,
    /// Rheology of rough spheres with friction against their fraction.
    Friction,
    /// Viscosity of smooth and rough spheres after the shear is reversed.
    Reversal,
    /// Viscosity of spheres whose friction has a critical load, against the shear rate.
    Thickening,
    /// Particles that do not come back in an oscillating shear, against its amplitude.
    Reversibility,
    /// Settling velocity of spheres against their fraction.
    Settling,
}

/// The study to compute, and where to put it.
#[derive(clap::Args)]
pub struct StudyOptions {
    /// The study.
    name: Name,
    /// Few points and short runs: minutes.
    #[arg(long)]
    quick: bool,
    /// Of the runs only these, by the names of their folders.
    #[arg(long, value_name = "RUN", value_delimiter = ',')]
    only: Vec<String>,
    /// Output folder [default: target/studies/NAME].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Runs at a time [default: number of cores].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

impl Name {
    fn study(self) -> Study {
        match self {
            Self::Viscosity => viscosity::STUDY,
            Self::Friction => friction::STUDY,
            Self::Reversal => reversal::STUDY,
            Self::Thickening => thickening::STUDY,
            Self::Reversibility => reversibility::STUDY,
            Self::Settling => settling::STUDY,
        }
    }
}

/// Makes the runs and writes `table.csv`, pictures and `index.html`; whether all is well. What failed is told
/// and on the page.
///
/// # Errors
/// If there is no such run, or nothing can be written.
pub fn run(options: &StudyOptions) -> anyhow::Result<bool> {
    let start = Instant::now();
    let (study, quick) = (options.name.study(), options.quick);
    let folder = Path::new(if quick { "target/studies/quick" } else { "target/studies" });
    let name = options.name.to_possible_value().expect("every study has a name");
    let out = &options.out.clone().unwrap_or_else(|| folder.join(name.get_name()));
    let all = (study.points)(quick);
    let (points, board) = (among(&all, &options.only)?, Board::new());
    files::prepare_folder(out)?;
    let data = workspace_root().join("data/studies");
    let run = |point: &StudyPoint| point.run(&data, &out.join("runs"), &board);
    let results = schedule::in_parallel(&points, jobs(options.jobs), run);
    let mut failures = Vec::new();
    let results = points.iter().zip(results);
    let done: Vec<Done> =
        results.filter_map(|(point, result)| keep(point.name.clone(), result, &mut failures)).collect();
    let findings = (study.findings)(&done);
    let findings = keep("what comes out".to_owned(), findings, &mut failures).unwrap_or_default();
    files::write(&out.join("table.csv"), page::csv(&findings).as_bytes())?;
    for (name, drawing) in &findings.drawings {
        write_drawing(out, name, drawing, &mut failures)?;
    }
    let effort = page::effort(&done, all.len(), start.elapsed().as_secs_f64());
    let html = page::html(&study, &findings, &failures, quick, &effort);
    files::write(&out.join("index.html"), html.as_bytes())?;
    println!("table.csv, pictures and index.html are in {}", out.display());
    failures.iter().for_each(|failure| eprintln!("error: {}: {}", failure.what, failure.error));
    Ok(failures.is_empty())
}

/// Of all points those with these names, or all where none is given.
fn among(all: &[StudyPoint], names: &[String]) -> anyhow::Result<Vec<StudyPoint>> {
    if let Some(unknown) = names.iter().find(|name| all.iter().all(|point| point.name != **name)) {
        let all = all.iter().map(|point| point.name.as_str()).collect::<Vec<_>>().join(", ");
        bail!("--only: the study has no run `{unknown}`; its runs are {all}");
    }
    Ok(all.iter().filter(|point| names.is_empty() || names.contains(&point.name)).cloned().collect())
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
            let [first, last] = [&all[0], &all[all.len() - 1]].map(|point| point.name.clone());
            let some = among(&all, &[last.clone(), first.clone()]).unwrap();
            assert_eq!(some.iter().map(|point| &point.name).collect::<Vec<_>>(), [&first, &last]);
            assert_eq!(among(&all, &[]).unwrap().len(), all.len());
            let error = among(&all, &["none".to_owned()]).unwrap_err().to_string();
            assert!(error.contains("no run `none`") && error.contains(&last), "{error}");
        }
    }
}
