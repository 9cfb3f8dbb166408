//! Cases whose flow and contact ranks share, here threads: the numbers in their tables are those of one
//! process.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use gluey::{
    Case, Ended, Progress, ProgressState, RecordOptions, ResultPaths, RunError, RunOptions, RunRecord,
    RunState, Silent, VtkOptions, run_shared,
};
use gluey_parallel::{Communicator, Ranks, Threads};
use gluey_testkit::failing::{Failing, TOLD, within_a_minute};
use tempfile::TempDir;

use crate::runs::{case, column, run_named};

/// A case that steps twice.
fn in_steps(dimension: usize, rest: &str) -> Case {
    case(&format!(
        "name = \"r\"\ndimension = {dimension}\n{rest}\ncontact = {{ strategy = \"none\" }}\n\
         [flow]\nsolver = \"multigrid\"\ntolerance = 1e-11\n\
         [flow.mesh]\ncells_per_radius = {}\nroot_cells = 1\ncoarsest_level = 2\n",
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

/// What comes of a run on so many ranks, on each.
fn run_on(size: usize, case: &Case, options: &RunOptions) -> Vec<Result<(), String>> {
    let done = Threads::run(size, |ranks| {
        run_shared(case, options, &Silent, ranks).map(|_| ()).map_err(|error| error.to_string())
    });
    done.expect("no rank fails")
}

fn ranks_are_as_one_process(what: &str, case: &Case, tables: &[&str], limit: f64) {
    let folder = TempDir::new().expect("a folder");
    let serial = run_named(case, folder.path(), "t");
    for size in [1, 3] {
        let beside = TempDir::new().expect("a folder");
        let csv = beside.path().join("t.csv");
        run_on(size, case, &RunOptions::csv(&csv)).into_iter().for_each(|done| done.expect("a run"));
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
    ranks_are_as_one_process("driven discs", &flat, &tables, 7.5e-10);
    let solid = in_steps(3, &particles([", 0.5", ", 0.0"]));
    ranks_are_as_one_process("driven spheres", &solid, &tables, 1.4e-10);
}

/// Rough spheres that touch, with friction: forces of contacts act in a flow that ranks share.
#[test]
fn forces_of_rough_contacts_act_on_all_ranks() {
    let case = case(
        "name = \"r\"\ndimension = 3\ndomain = { boundary = \"sheared\" }\n\
         particles = [{ position = [0.4, 0.58, 0.5], radius = 0.12 },\n\
                      { position = [0.5695, 0.4085, 0.5], radius = 0.12 },\n\
                      { position = [0.2, 0.2, 0.3], radius = 0.1 }]\n\
         time = { step = 0.05, end = 0.2 }\ncontact = { strategy = \"rough\", flow_tolerance = 1e-4 }\n\
         [flow]\nsolver = \"multigrid\"\ntolerance = 1e-11\n\
         [flow.mesh]\ncells_per_radius = 1.6\nroot_cells = 1\ncoarsest_level = 2\n",
    );
    ranks_are_as_one_process("rough spheres", &case, &["", "-rheology"], 1e-7);
}

/// A line of discs that nearly touch, each faster than the next one. Multigrid does not converge to 1e-10 on
/// every mesh of such a line; on this one it does.
fn line_of_discs(end: f64) -> Case {
    let disc = |k: usize| {
        let (x, y) = (0.2 + 0.098 * k as f64, 0.55 - 0.02 * k as f64);
        format!("{{ position = [{x}, {y}], radius = 0.05 }}")
    };
    let discs: Vec<String> = (0..6).map(disc).collect();
    case(&format!(
        "name = \"r\"\ndimension = 2\nparticles = [{}]\ndomain = {{ boundary = \"periodic\" }}\n\
         time = {{ step = 0.03, end = {end} }}\ncontact = {{ strategy = \"gluey\" }}\n\
         [flow]\nlubrication = \"none\"\nsolver = \"multigrid\"\ntolerance = 1e-10\n\
         [flow.mesh]\ncells_per_radius = 3.2\ncoarsest_level = 2\nband = 3\n",
        discs.join(", ")
    ))
}

/// What comes of two steps with contact, frames of the fields and a checkpoint after each when a rank is told
/// to fail, on each rank, with the number of agreements.
fn with_a_fault(fault: (usize, usize)) -> Vec<(Result<(), String>, usize)> {
    let folder = TempDir::new().expect("a folder");
    let vtk = VtkOptions::new(folder.path().join("vtk"), 1);
    let options = RunOptions { vtk: Some(vtk), ..with_checkpoints(folder.path()) };
    let case = line_of_discs(0.06);
    let done = Threads::run(3, |ranks| {
        let ranks = Failing::new(ranks, fault.0, fault.1);
        let agreements = ranks.agreements();
        let said = run_shared(&case, &options, &Silent, &Ranks::new(ranks)).map(|_| ());
        (said.map_err(|error| whole(&error)), agreements.load(Ordering::Relaxed))
    });
    done.expect("no rank panics")
}

/// With all that it says of its causes.
fn whole(error: &dyn std::error::Error) -> String {
    let cause = error.source().map_or(String::new(), |cause| format!(": {}", whole(cause)));
    format!("{error}{cause}")
}

/// Wherever a rank fails all end, and rank zero says why: in flows, contact, fields and checkpoints.
#[test]
fn a_rank_that_fails_anywhere_in_a_run_ends_all() {
    let sound = within_a_minute("a run", || with_a_fault((0, usize::MAX)));
    assert!(sound.iter().all(|(said, _)| said.is_ok()), "{sound:?}");
    let count = sound[0].1;
    println!("{count} agreements");
    // Too many for a test: every fifth, on one rank after the other.
    for at in (0..count).step_by(5) {
        let fault = (at % 3, at);
        let ends = within_a_minute("a run with a fault", move || with_a_fault(fault));
        let first = ends[0].0.as_ref().expect_err("the run fails");
        assert!(first.contains(TOLD), "rank and agreement {fault:?}: {first}");
    }
}

/// One rank is asked to stop: all do after the same step.
#[test]
fn all_stop_when_one_is_asked_to() {
    let (folder, case) = (TempDir::new().expect("a folder"), line_of_discs(0.09));
    let ends = Threads::run(3, |ranks| {
        let interrupt = Some(Arc::new(AtomicBool::new(ranks.rank() == 1)));
        let options = RunOptions { interrupt, ..with_checkpoints(folder.path()) };
        run_shared(&case, &options, &Silent, ranks).err()
    });
    for end in ends.expect("no rank panics") {
        assert!(matches!(end, Some(RunError::Interrupted(Ended { step: 1, steps: 3, .. }))), "{end:?}");
    }
}

/// A listener at fault.
struct Faulty;

impl Progress for Faulty {
    fn report(&self, state: &ProgressState) {
        assert!(state.step == 0, "the listener is at fault");
    }
}

/// A rank that panics ends the others, who wait for it, and its run is known to have failed.
#[test]
fn a_rank_that_panics_ends_all() {
    let (folder, case) = (TempDir::new().expect("a folder"), line_of_discs(0.06));
    let record = Some(RecordOptions::default());
    let options = RunOptions { record, ..RunOptions::csv(folder.path().join("t.csv")) };
    let paths = ResultPaths::of_csv(&options.csv);
    let run = move || Threads::run(3, |ranks| run_shared(&case, &options, &Faulty, ranks).is_ok());
    let failure = within_a_minute("a panic", run).expect_err("a rank panics");
    assert_eq!((failure.rank, &failure.message[..]), (0, "the listener is at fault"));
    assert_eq!(RunRecord::read(&paths.record()).expect("a record").state, RunState::Failed);
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
    ranks_are_as_one_process("channel", &channel, &[""], 5.1e-13);
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

/// Discs in a channel that touch, in islands that reach across ranks: tables and contacts are those of one
/// process, the bits the same run after run, and a checkpoint goes on with another number of ranks.
#[test]
fn contacts_are_shared_too() {
    let until = line_of_discs;
    let long = until(0.09);
    ranks_are_as_one_process("contacts", &long, &[""], 1.3e-7);
    let [whole, again, stopped] = [(); 3].map(|()| TempDir::new().expect("a folder"));
    for folder in [&whole, &again] {
        assert!(run_on(3, &long, &with_checkpoints(folder.path())).iter().all(Result::is_ok));
    }
    let rows = |folder: &Path| fs::read_to_string(folder.join("t.csv")).expect("rows");
    assert_eq!(rows(whole.path()), rows(again.path()), "the same bits");
    let pairs = column(&whole.path().join("t-solver.csv"), "contact_pairs");
    assert!(pairs.iter().copied().fold(0.0, f64::max) >= 4.0, "{pairs:?}");
    assert!(run_on(3, &until(0.06), &with_checkpoints(stopped.path())).iter().all(Result::is_ok));
    for size in [3, 2, 1] {
        let folder = copy_of(stopped.path());
        let options = with_checkpoints(folder.path());
        let options = RunOptions { resume: options.checkpoint.clone(), ..options };
        assert!(run_on(size, &long, &options).iter().all(Result::is_ok), "{size} ranks");
        assert!(
            size != 3 || rows(folder.path()) == rows(whole.path()),
            "the bits of a run that nothing stopped"
        );
        let csv = [whole.path(), folder.path()].map(|folder| folder.join("t.csv"));
        let difference = largest_difference(&csv[0], &csv[1], &[""]);
        println!("contacts, gone on with by {size} ranks: {difference:.1e}");
        assert!(difference < 8.6e-8, "{size} ranks: {difference:e}");
    }
}

/// Options of a run with a checkpoint after each step.
fn with_checkpoints(folder: &Path) -> RunOptions {
    RunOptions {
        checkpoint: Some(folder.join("t.checkpoint")),
        checkpoint_every: Some(1),
        ..RunOptions::csv(folder.join("t.csv"))
    }
}

/// Files with pieces of a flow.
fn pieces_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut pieces: Vec<PathBuf> = entries.filter(|path| path.to_string_lossy().contains(".flow-")).collect();
    pieces.sort();
    pieces
}

fn copy_of(folder: &Path) -> TempDir {
    let copy = TempDir::new().expect("a folder");
    for entry in fs::read_dir(folder).expect("a folder") {
        let from = entry.expect("an entry").path();
        fs::copy(&from, copy.path().join(from.file_name().expect("a name"))).expect("a copy");
    }
    copy
}

/// Steps of a run on ranks that is gone on with on as many have the bits of one that nothing stopped, on
/// others its numbers. Each rank has a file for each of two checkpoints.
#[test]
fn a_run_goes_on_from_the_pieces_of_its_ranks() {
    let until = |end: f64| {
        in_steps(
            2,
            &format!(
                "domain = {{ boundary = \"sheared\" }}\ntime = {{ step = 0.02, end = {end} }}\n\
                 suspension = {{ volume_fraction = 0.3, count = 4, seed = 5, min_gap = 0.02 }}"
            ),
        )
    };
    let [whole, stopped] = [(); 2].map(|()| TempDir::new().expect("a folder"));
    let (long, short) = (until(0.12), until(0.08));
    assert!(run_on(3, &long, &with_checkpoints(whole.path())).iter().all(Result::is_ok));
    assert!(run_on(3, &short, &with_checkpoints(stopped.path())).iter().all(Result::is_ok));
    assert_eq!(pieces_in(stopped.path()).len(), 2 * 3, "two generations");
    let resuming = |folder: &Path| {
        let options = with_checkpoints(folder);
        RunOptions { resume: options.checkpoint.clone(), ..options }
    };
    let rows = |folder: &Path| fs::read_to_string(folder.join("t.csv")).expect("rows");
    for size in [3, 2, 5, 1] {
        let folder = copy_of(stopped.path());
        let done = run_on(size, &long, &resuming(folder.path()));
        assert!(done.iter().all(Result::is_ok), "{size} ranks: {done:?}");
        assert_eq!(size == 3, rows(folder.path()) == rows(whole.path()), "{size} ranks");
        let csv = [whole.path(), folder.path()].map(|folder| folder.join("t.csv"));
        let difference = largest_difference(&csv[0], &csv[1], &["", "-rheology"]);
        println!("gone on with by {size} ranks: {difference:.1e}");
        assert!(difference < 9.6e-11, "{size} ranks: {difference:e}");
        assert_eq!(pieces_in(folder.path()).len(), 2 * size, "{size} ranks");
    }
    a_piece_that_cannot_be_used_is_named(stopped.path(), &long, &resuming);
}

fn a_piece_that_cannot_be_used_is_named(folder: &Path, case: &Case, resuming: &dyn Fn(&Path) -> RunOptions) {
    let before = copy_of(folder);
    let newest = |folder: &Path| {
        let modified = |path: &PathBuf| fs::metadata(path).and_then(|file| file.modified()).expect("a time");
        let last = pieces_in(folder).into_iter().filter(|path| path.to_string_lossy().ends_with("-0001"));
        last.max_by_key(modified).expect("a piece")
    };
    let piece = newest(folder);
    let name = piece.file_name().expect("a name").to_string_lossy().into_owned();
    let here = before.path().join(&name);
    for (what, text) in [("is cut short", "damaged"), ("is gone", "cannot be read")] {
        match what {
            "is gone" => fs::remove_file(&here).expect("it was there"),
            _ => fs::write(&here, &fs::read(&piece).expect("a piece")[..100]).expect("a shorter one"),
        }
        let rows = fs::read_to_string(before.path().join("t.csv")).expect("rows");
        for (rank, done) in run_on(3, case, &resuming(before.path())).into_iter().enumerate() {
            let error = done.expect_err("there is no run");
            assert!(error.contains(&name) && error.contains(text), "rank {rank}, {what}: {error}");
        }
        assert_eq!(fs::read_to_string(before.path().join("t.csv")).expect("rows"), rows, "nothing is lost");
    }
}
