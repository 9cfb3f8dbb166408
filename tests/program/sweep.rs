//! `gluey sweep`: a study of several points, complete, interrupted, failing and in the way of another.

use std::fs;
use std::path::Path;
use std::process;
use std::thread;
use std::time::Duration;

use crate::program::{fails, gluey, told};
use gluey::{RunRecord, RunState};
use tempfile::TempDir;

const STEM: &str = "pair-3d-mobility-gluey";
const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");

/// Standard output and standard error of a study, which ends with this exit code.
fn sweep(folder: &Path, arguments: &[&str], code: i32) -> (String, String) {
    let (found, out, error) = gluey(folder, &[&["sweep", CASE], arguments].concat());
    assert_eq!(found, Some(code), "{out}{error}");
    (out, error)
}

fn record(folder: &Path, point: &str) -> RunRecord {
    RunRecord::read(&folder.join(point).join(format!("{STEM}-run.json"))).expect("a record")
}

#[test]
fn every_point_is_a_run_and_the_table_has_them_all() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let set = ["--set", "time.step=0.1,0.2", "--set", "flow.pair-mobility.gap_offset=0,0.01"];
    let (out, _) = sweep(folder, &[&set[..], &["--jobs", "2", "--out", "study"]].concat(), 0);
    assert_eq!(out.lines().count(), 1 + 4, "{out}");
    let study = folder.join("study");
    let table = fs::read_to_string(study.join("sweep.csv")).expect("a table");
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].starts_with("time.step,flow.pair-mobility.gap_offset,state,steps,"), "{table}");
    assert!(
        lines[1].starts_with("0.1,0,complete,158,") && lines[4].starts_with("0.2,0.01,complete,79,"),
        "{table}"
    );
    // A point is what a run of its own gives.
    told(
        folder,
        &[
            "run",
            CASE,
            "--set",
            "time.step=0.2",
            "--set",
            "flow.pair-mobility.gap_offset=0.01",
            "--out",
            "one",
        ],
    );
    let read = |path: &str| fs::read(folder.join(path).join(format!("{STEM}.csv"))).expect("a trajectory");
    assert!(
        read("one") == read("study/time.step=0.2+flow.pair-mobility.gap_offset=0.01"),
        "another trajectory"
    );
    let json = sweep(folder, &[&set[..], &["--out", "study", "--json"]].concat(), 0).0;
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON and nothing else");
    assert_eq!(
        (&json[3]["values"]["flow.pair-mobility.gap_offset"], &json[3]["state"]),
        (&"0.01".into(), &"complete".into())
    );
    assert_eq!(json[3]["report"]["steps"], 79);
    let info = told(folder, &["info", "study"]);
    assert!(info.contains("4: 4 done, 0 failed, 0 left") && info.contains("time.step"), "{info}");
    for command in ["resume", "plot", "view", "analyse"] {
        fails(folder, &[command, "study"], &["of one of its points"]);
    }
}

#[test]
fn a_study_goes_on_where_it_was_and_takes_more_values() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let (one, both) =
        (["--set", "time.step=0.1"], ["--set", "time.step=0.1,0.2", "--checkpoint-every", "20"]);
    sweep(folder, &one, 0);
    let before = record(folder, "sweep/time.step=0.1");
    sweep(folder, &both, 0);
    assert_eq!(record(folder, "sweep/time.step=0.1"), before, "it was run again");
    // A point that was killed after its checkpoint at step 60.
    let point = folder.join("sweep/time.step=0.2");
    let whole = fs::read(point.join(format!("{STEM}.csv"))).expect("a trajectory");
    let [csv, draft] = ["csv", "csv.partial-1"].map(|ending| point.join(format!("{STEM}.{ending}")));
    fs::rename(&csv, draft).expect("a draft");
    let path = point.join(format!("{STEM}-run.json"));
    let text = fs::read_to_string(&path).expect("a record");
    fs::write(&path, text.replace("\"complete\"", "\"running\"")).expect("a record");
    let (_, error) = sweep(folder, &both, 0);
    assert!(error.contains("point 2 of 2, time.step=0.2: complete"), "{error}");
    let after = record(folder, "sweep/time.step=0.2");
    assert_eq!((after.state, after.resumed), (RunState::Complete, 1));
    assert!(fs::read(csv).expect("a trajectory") == whole, "another trajectory");
}

/// Ctrl-C ends the point that runs with a checkpoint, and begins no other.
#[test]
#[cfg(unix)]
fn a_study_that_is_interrupted_goes_on() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let arguments = ["--set", "time.step=0.00005,0.1", "--checkpoint-every", "1000"];
    let mut command = process::Command::new(env!("CARGO_BIN_EXE_gluey"));
    command.current_dir(folder).args(["sweep", CASE]).args(arguments).stderr(process::Stdio::null());
    let mut study = command.stdout(process::Stdio::piped()).spawn().expect("it runs");
    let checkpoint = folder.join(format!("sweep/time.step=0.00005/{STEM}.checkpoint"));
    while !checkpoint.exists() {
        thread::sleep(Duration::from_millis(1));
    }
    let sent = process::Command::new("kill").args(["-INT", &study.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
    assert_eq!(study.wait().expect("it ends").code(), Some(130));
    let table = fs::read_to_string(folder.join("sweep/sweep.csv")).expect("a table");
    let states: Vec<&str> = table.lines().skip(1).filter_map(|line| line.split(',').nth(1)).collect();
    assert_eq!(states, ["interrupted", "not run"]);
    sweep(folder, &arguments, 0);
    let record = record(folder, "sweep/time.step=0.00005");
    assert_eq!((record.state, record.resumed, record.steps), (RunState::Complete, 1, 315_000));
}

#[test]
fn a_point_that_fails_does_not_stop_the_others() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    // A file is where the second point would have its folder.
    fs::create_dir(folder.join("sweep")).expect("a folder");
    fs::write(folder.join("sweep/time.step=0.2"), "in the way").expect("a file");
    let (out, error) = sweep(folder, &["--set", "time.step=0.1,0.2,0.3", "--force"], 1);
    assert!(error.contains("1 of 3 points failed: time.step=0.2"), "{error}");
    assert!(error.contains("cannot create the folder"), "{error}");
    assert!(out.lines().nth(2).is_some_and(|line| line.contains("failed")), "{out}");
    assert_eq!(record(folder, "sweep/time.step=0.3").state, RunState::Complete);
    fs::remove_file(folder.join("sweep/time.step=0.2")).expect("a file");
    let (_, error) = sweep(folder, &["--set", "time.step=0.1,0.2,0.3", "--quiet"], 0);
    assert!(error.is_empty(), "{error}");
    assert_eq!(record(folder, "sweep/time.step=0.2").state, RunState::Complete);
}

#[test]
fn studies_of_something_else_are_left_alone() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    sweep(folder, &["--set", "time.step=0.1", "--quiet"], 0);
    let before = record(folder, "sweep/time.step=0.1");
    let refuse = |arguments: &[&str], expected: &str| {
        let (_, error) = sweep(folder, arguments, 1);
        assert!(error.contains(expected), "{error}");
    };
    refuse(&["--set", "shear_rate=1"], "a study of time.step is there, not of shear_rate");
    refuse(&["--set", "time.step=0.1", "--out", "."], "something else than a study is there");
    let other = folder.join("other.toml");
    let text = fs::read_to_string(CASE).expect("a case").replace("end = 15.75", "end = 1.0");
    fs::write(&other, text).expect("a case");
    let (_, _, error) = gluey(folder, &["sweep", "other.toml", "--set", "time.step=0.1"]);
    assert!(error.contains("a run of another case is there") && error.contains("--force"), "{error}");
    assert_eq!(record(folder, "sweep/time.step=0.1"), before);
    told(folder, &["sweep", "other.toml", "--set", "time.step=0.1", "--force"]);
    assert_eq!(record(folder, "sweep/time.step=0.1").steps, 10);
}

#[test]
fn studies_that_make_no_sense_are_refused_before_anything_is_run() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    for (set, code, expected) in [
        (&["--set", "time.step=0.1,0"][..], 1, "--set time.step=0: 0 is out of range"),
        (&["--set", "time.step=0.1,0.1"], 1, "two points of the study are called time.step=0.1"),
        (&["--set", "time.step=0.1", "--set", "time.step=0.2"], 1, "time.step is set twice"),
        (&["--set", "time.step"], 2, "expected KEY=VALUE"),
        (&["--set", "time.step=0.1,"], 2, "is not a value"),
        (&[], 2, "--set"),
    ] {
        let (_, error) = sweep(folder, set, code);
        assert!(error.contains(expected), "{error}");
    }
    assert!(!folder.join("sweep").exists(), "something was written");
}
