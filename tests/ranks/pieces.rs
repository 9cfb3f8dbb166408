//! Runs whose flow ranks share, here threads: the files for ParaView hold in pieces what one process writes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use gluey::output::vtk::{read_fields, read_particles};
use gluey::{Case, RunError, RunOptions, RunReport, Silent, VtkOptions, run, run_shared};
use gluey_contact::{ContactModel, PairContact};
use gluey_geom::Vector;
use gluey_motion::Fields;
use gluey_parallel::{RankFailure, Threads};
use tempfile::TempDir;

/// Three particles, one of them across the border of the box, or none there; two streams of frames besides.
fn case(dimension: usize, boundary: &str) -> Case {
    let place = |x: f64, y: f64| if dimension == 2 { format!("{x}, {y}") } else { format!("{x}, {y}, 0.5") };
    let (first, second) = (place(0.4, 0.35), place(0.55, 0.76));
    let third = if boundary == "periodic" { place(0.98, 0.6) } else { place(0.75, 0.5) };
    let cells = if dimension == 2 { 3.2 } else { 1.6 };
    let text = format!(
        r#"name = "three"
dimension = {dimension}
particles = [
    {{ position = [{first}], radius = 0.14 }},
    {{ position = [{second}], radius = 0.11 }},
    {{ position = [{third}], radius = 0.12 }},
]
[domain]
boundary = "{boundary}"
[time]
step = 0.02
end = 0.02
[flow]
solver = "multigrid"
tolerance = 1e-11
[flow.mesh]
cells_per_radius = {cells}
root_cells = 1
coarsest_level = 2
band = 1
[[output]]
kind = "xyz"
every = 1
[[output]]
kind = "vtk"
label = "single"
every = 1
precision = "f32"
"#
    );
    Case::parse(&text, "three.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn options(folder: &Path) -> RunOptions {
    let vtk = VtkOptions::new(folder.join("vtk"), 1);
    RunOptions { vtk: Some(vtk), ..RunOptions::csv(folder.join("t.csv")) }
}

type Outcome = Result<Option<RunReport>, String>;

/// What a run on so many ranks says on each of them.
fn shared(case: &Case, folder: &Path, size: usize) -> Result<Vec<Outcome>, RankFailure> {
    let whole = |error: &RunError| {
        let mut text = error.to_string();
        let mut cause = std::error::Error::source(error);
        while let Some(error) = cause {
            text.push_str(&format!(": {error}"));
            cause = error.source();
        }
        text
    };
    let options = options(folder);
    Threads::run(size, |ranks| run_shared(case, &options, &Silent, ranks).map_err(|error| whole(&error)))
}

/// The cells by their first and last points, to the bit. None is there twice.
fn cells<const D: usize>(fields: &Fields<D>) -> BTreeMap<Vec<u64>, &[u32]> {
    let count = 3usize.pow(D as u32);
    let mut cells = BTreeMap::new();
    for nodes in fields.cells.chunks_exact(count) {
        let ends = [0, count - 1].map(|place| fields.points[nodes[place] as usize]);
        let key: Vec<u64> = ends.iter().flatten().map(|x| x.to_bits()).collect();
        assert!(cells.insert(key, nodes).is_none(), "a cell at {} is there twice", ends[0]);
    }
    cells
}

/// Nearer to bodies than this there may be points whose pressure nothing flows to.
const SKIN: f64 = 0.01;

/// Largest differences at the points of the same cells: of velocities and pressures over the largest of them,
/// of level sets. Pressures may differ by a constant, which comes last: the solver of one process keeps that
/// of the step before.
fn differences<const D: usize>(one: &Fields<D>, other: &Fields<D>) -> [f64; 4] {
    let (cells_of_one, cells_of_other) = (cells(one), cells(other));
    assert!(cells_of_one.keys().eq(cells_of_other.keys()), "the same cells");
    let largest = |m: f64, x: f64| if x.is_nan() { f64::NAN } else { m.max(x.abs()) };
    let fastest = one.velocity.iter().map(Vector::norm).fold(0.0, largest);
    let highest = one.pressure.iter().copied().fold(0.0, largest);
    let (mut found, mut of_pressure) = ([0.0; 4], Vec::new());
    for (nodes, others) in cells_of_one.values().zip(cells_of_other.values()) {
        for (&a, &b) in nodes.iter().zip(*others) {
            let (a, b) = (a as usize, b as usize);
            assert_eq!(one.points[a], other.points[b]);
            assert_eq!((one.viscosity[a], one.multiplier[a]), (other.viscosity[b], other.multiplier[b]));
            found[0] = largest(found[0], (one.velocity[a] - other.velocity[b]).norm() / fastest);
            found[2] = largest(found[2], one.level_set[a] - other.level_set[b]);
            of_pressure.push((one.level_set[a] < -SKIN, (one.pressure[a] - other.pressure[b]) / highest));
        }
    }
    let in_fluid = of_pressure.iter().filter(|of| of.0).map(|of| of.1);
    found[3] = in_fluid.clone().sum::<f64>() / in_fluid.clone().count() as f64;
    // Elsewhere pressures are means of the fluid's and of zeros.
    let elsewhere = of_pressure.iter().map(|of| (of.1.abs() - found[3].abs()).max(0.0));
    found[1] = in_fluid.map(|x| x - found[3]).chain(elsewhere).fold(0.0, largest);
    found
}

fn pieces_hold_what_one_process_writes<const D: usize>(boundary: &str)
where
    PairContact<D>: ContactModel<D>,
{
    let case = case(D, boundary);
    let alone = TempDir::new().expect("a folder");
    run(&case, &options(alone.path()), &Silent).unwrap_or_else(|error| panic!("{error}"));
    for size in [1, 2, 3] {
        let folder = TempDir::new().expect("a folder");
        let outcomes = shared(&case, folder.path(), size).expect("no rank fails");
        let reports: Vec<bool> =
            outcomes.into_iter().map(|outcome| outcome.expect("a run").is_some()).collect();
        assert!(reports.iter().enumerate().all(|(rank, is_there)| *is_there == (rank == 0)));
        let vtk = |folder: &TempDir, file: &str| folder.path().join("vtk").join(file);
        for step in 0..2 {
            let whole = read_fields::<D>(&vtk(&alone, &format!("fields-{step:06}.vtu"))).expect("fields");
            let index = vtk(&folder, &format!("fields-{step:06}.pvtu"));
            let joined = read_fields::<D>(&index).expect("fields in pieces");
            let [velocity, pressure, level_set, constant] = differences(&whole, &joined);
            println!(
                "{D}D, {boundary}, {size} ranks, step {step}: {velocity:.1e}, {pressure:.1e} but for {constant:.0e}"
            );
            assert!(velocity < 1e-9, "{size} ranks, step {step}: velocities {velocity:e}");
            assert!(pressure < 1e-8, "{size} ranks, step {step}: pressures {pressure:e}");
            assert!(level_set < 1e-11, "{size} ranks, step {step}: level sets {level_set:e}");
            // No row of the system knows the constant of the pressures: 1.0e-8 in 2D, 9e-10 in 3D.
            assert!(
                constant.abs() < if step == 0 { 3e-8 } else { 1e-2 },
                "{size} ranks: pressures {constant:e}"
            );
            let piece = |rank: usize| vtk(&folder, &format!("fields-{step:06}-{rank:04}.vtu"));
            let of_ranks = (0..size).map(|rank| read_fields::<D>(&piece(rank)).expect("a piece").cells.len());
            assert_eq!(of_ranks.sum::<usize>(), whole.cells.len());
            assert!(!piece(size).exists() && !vtk(&folder, &format!("fields-{step:06}.vtu")).exists());
            let particles = |folder| read_particles::<D>(&vtk(folder, &format!("particles-{step:06}.vtu")));
            assert_eq!(
                particles(&alone).expect("particles").len(),
                particles(&folder).expect("particles").len()
            );
            // The stream of the case has half the digits.
            let single = folder.path().join("t-single").join(format!("fields-{step:06}.pvtu"));
            let single = read_fields::<D>(&single).expect("fields");
            assert_eq!(joined.cells, single.cells);
            let differences = joined.velocity.iter().zip(&single.velocity).map(|(a, b)| (a - b).norm());
            assert!(differences.fold(0.0, f64::max) < 1e-6);
        }
        let collection = std::fs::read_to_string(vtk(&folder, "fields.pvd")).expect("a collection");
        assert_eq!(collection.matches("<DataSet").count(), 2, "{collection}");
        assert!(
            collection.contains("timestep=\"0.02\" part=\"0\" file=\"fields-000001.pvtu\""),
            "{collection}"
        );
    }
}

#[test]
fn pieces_hold_what_one_process_writes_in_2d() {
    pieces_hold_what_one_process_writes::<2>("couette");
    pieces_hold_what_one_process_writes::<2>("periodic");
}

#[test]
fn pieces_hold_what_one_process_writes_in_3d() {
    pieces_hold_what_one_process_writes::<3>("couette");
    pieces_hold_what_one_process_writes::<3>("periodic");
}

/// Names of the frames of fields that are there.
fn frames(folder: &Path) -> Vec<PathBuf> {
    let listed = std::fs::read_dir(folder.join("vtk")).expect("a folder").map(|entry| entry.expect("a file"));
    let mut paths: Vec<PathBuf> = listed.map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    paths.sort();
    paths
}

/// One rank cannot write: all end, and say which file it is and why.
#[test]
fn a_rank_that_cannot_write_ends_the_run() {
    let case = case(2, "couette");
    for rank in [0, 1, 2] {
        let folder = TempDir::new().expect("a folder");
        // Where a file should be there is a folder.
        let file = folder.path().join(format!("vtk/fields-000001-{rank:04}.vtu"));
        std::fs::create_dir_all(&file).expect("a folder");
        let outcomes = shared(&case, folder.path(), 3).expect("no rank panics");
        let said = outcomes[0].as_ref().expect_err("a piece is missing");
        let from = if rank == 0 { String::new() } else { format!(", on rank {rank}") };
        assert!(said.contains(&file.display().to_string()), "{said}");
        assert!(said.contains("cannot write the file: Is a directory (os error 21)"), "{said}");
        assert!(said.ends_with(&format!("(os error 21){from}")), "{said}");
        for other in &outcomes[1..] {
            let other = other.as_ref().expect_err("all end");
            assert!(other.contains(&file.display().to_string()) && other.contains("os error 21"), "{other}");
        }
        let there = frames(folder.path());
        let is_there = |name: &str| there.iter().any(|path| path.ends_with(name));
        assert!(is_there("fields-000000.pvtu"), "the step before is whole");
        assert!(!is_there("fields-000001.pvtu"), "a step without a piece is not named");
        assert!(there.iter().all(|path| !path.display().to_string().contains("partial")), "{there:?}");
    }
}
