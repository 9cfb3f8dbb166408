//! Cases whose flow ranks share, here threads: the numbers in their tables are those of one process.

use std::path::Path;

use gluey::{Case, RunOptions, Silent, run_shared};
use gluey_parallel::Threads;
use tempfile::TempDir;

#[path = "runs/mod.rs"]
mod runs;
use runs::{case, run_named};

/// A case that steps twice.
fn in_steps(dimension: usize, rest: &str) -> Case {
    case(&format!(
        "name = \"r\"\ndimension = {dimension}\n{rest}\ncontact = {{ strategy = \"none\" }}\n\
         [flow]\nsolver = \"multigrid\"\ntolerance = 1e-11\n\
         [flow.mesh]\ncells_per_radius = {}\ncoarsest_level = 2\n",
        if dimension == 2 { 3.2 } else { 1.6 }
    ))
}

/// Columns of a table by their names.
fn columns(path: &Path) -> Vec<(String, Vec<f64>)> {
    let text = std::fs::read_to_string(path).expect("a table");
    let mut lines = text.lines();
    let names = lines.next().expect("a header").split(',');
    let mut columns: Vec<(String, Vec<f64>)> = names.map(|name| (name.to_owned(), Vec::new())).collect();
    for line in lines {
        let cells = line.split(',').zip(&mut columns);
        cells.for_each(|(cell, column)| column.1.push(cell.parse().unwrap_or(f64::NAN)));
    }
    columns
}

/// Largest difference of a column over its largest entry, or over one where that is less, in the tables
/// beside a trajectory.
fn largest_difference(one: &Path, other: &Path, tables: &[&str]) -> f64 {
    let mut largest = 0.0f64;
    for table in tables {
        let [a, b] = [one, other].map(|csv| columns(&csv.with_file_name(format!("t{table}.csv"))));
        assert_eq!(a.len(), b.len(), "{table}");
        for ((name, a), (_, b)) in a.iter().zip(&b).filter(|((name, _), _)| !name.contains("iteration")) {
            assert_eq!(a.len(), b.len(), "{table}, {name}");
            let scale = a.iter().fold(1.0f64, |m, x| m.max(x.abs()));
            for (a, b) in a.iter().zip(b).filter(|(a, b)| !(a.is_nan() && b.is_nan())) {
                let difference = (a - b).abs() / scale;
                assert!(!difference.is_nan(), "{table}, {name}: {a} and {b}");
                largest = largest.max(difference);
            }
        }
    }
    largest
}

fn ranks_are_as_one_process(what: &str, case: &Case, tables: &[&str], limit: f64) {
    let folder = TempDir::new().expect("a folder");
    let serial = run_named(case, folder.path(), "t");
    for size in [1, 3] {
        let beside = TempDir::new().expect("a folder");
        let csv = beside.path().join("t.csv");
        let options = RunOptions::csv(&csv);
        let done = Threads::run(size, |ranks| {
            run_shared(case, &options, &Silent, ranks).map(|_| ()).map_err(|error| error.to_string())
        });
        done.expect("no rank fails").into_iter().for_each(|done| done.expect("a run"));
        let difference = largest_difference(&serial, &csv, tables);
        println!("{what}, {size} ranks: {difference:.1e}");
        assert!(difference < limit, "{what}, {size} ranks: {difference:e}");
    }
}

/// One is driven past one that is held and a free one, through fluid whose mean is at rest.
#[test]
fn held_and_driven_particles_are_carried_by_the_same_forces() {
    let particles = |z: [&str; 2]| {
        let [middle, zero] = z;
        format!(
            "shear_rate = 0.0\ndomain = {{ boundary = \"sheared\" }}\ntime = {{ step = 0.05, end = 0.1 }}\n\
             particles = [\n\
             {{ position = [0.3, 0.5{middle}], radius = 0.12, velocity = [0.5, 0.1{zero}] }},\n\
             {{ position = [0.62, 0.6{middle}], radius = 0.1, held = true }},\n\
             {{ position = [0.55, 0.2{middle}], radius = 0.1 }} ]"
        )
    };
    let tables = ["", "-forces"];
    let flat = in_steps(2, &particles(["", ""]));
    ranks_are_as_one_process("driven discs", &flat, &tables, 1.8e-8);
    let solid = in_steps(3, &particles([", 0.5", ", 0.0"]));
    ranks_are_as_one_process("driven spheres", &solid, &tables, 7e-10);
}

/// A force on the fluid drives a channel with free particles, one of them across its border.
#[test]
fn a_channel_is_driven_by_the_same_flow() {
    let channel = in_steps(
        2,
        "shear_rate = 0.0\nbody_force = [8.0, 0.0]\ndomain = { boundary = \"periodic\" }\n\
         time = { step = 0.02, end = 0.04 }\nparticles = [\n\
         { position = [0.97, 0.3], radius = 0.12 }, { position = [0.4, 0.6], radius = 0.12 } ]",
    );
    ranks_are_as_one_process("channel", &channel, &[""], 9e-12);
}

/// Rates, times and viscosities at a stress that is given, with forces between the particles.
#[test]
fn at_a_given_stress_the_rate_is_the_same() {
    for (what, repulsion) in [("alone", ""), ("repelled", "repulsion = { force = 5.0, range = 0.2 }\n")] {
        let text = format!(
            "shear_stress = 20.0\n{repulsion}domain = {{ boundary = \"sheared\" }}\n\
             time = {{ step = 0.02, end = 0.04 }}\n\
             suspension = {{ volume_fraction = 0.3, count = 6, seed = 5, min_gap = 0.05 }}"
        );
        ranks_are_as_one_process(what, &in_steps(2, &text), &["", "-rheology"], 7.8e-9);
    }
}
