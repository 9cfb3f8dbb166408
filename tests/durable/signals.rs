//! Runs that are asked to stop, once, twice or by `kill -9`, at any moment: no row and no checkpoint is
//! lost, `gluey info` tells what is there, and what is gone on with ends with the bits of a run that nobody
//! stopped.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::program::told;
use crate::stopped::{DISCS, numbers, rows, same_results};
use gluey::CheckpointSummary;
use tempfile::TempDir;

const STEM: &str = "discs-gluey-unfitted";

/// How a run is stopped: signals, the second after so many milliseconds.
type Manner = (&'static str, Option<(&'static str, u64)>);

/// One signal and two, at once, soon, and so late that the second is a request of its own.
const MANNERS: [Manner; 12] = [
    ("-TERM", None),
    ("-TERM", Some(("-TERM", 0))),
    ("-INT", Some(("-INT", 300))),
    ("-KILL", None),
    ("-INT", Some(("-TERM", 0))),
    ("-HUP", None),
    ("-TERM", Some(("-KILL", 0))),
    ("-HUP", Some(("-TERM", 20))),
    ("-INT", None),
    ("-INT", Some(("-KILL", 50))),
    ("-TERM", Some(("-INT", 1100))),
    ("-HUP", Some(("-HUP", 0))),
];

/// How often a run is stopped: as often as there are manners, or as the environment says.
fn stop_count() -> usize {
    let count = std::env::var("GLUEY_SIGNALS");
    count.map_or(MANNERS.len(), |text| text.parse().expect("GLUEY_SIGNALS is a whole number"))
}

fn send(signal: &str, child: &Child) {
    // It may have ended.
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).stderr(Stdio::null()).status();
    sent.expect("a signal");
}

/// Starts `gluey` with these arguments in a folder.
fn started(folder: &Path, arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
    command.current_dir(folder).args(arguments).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().expect("it runs")
}

fn ended(mut child: Child) -> (ExitStatus, String) {
    let mut stderr = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut stderr).expect("text");
    (child.wait().expect("it ends"), stderr)
}

/// Steps of the best checkpoint that can be read; one that is there but cannot must not be.
fn saved(out: &Path) -> Option<usize> {
    let files = [".checkpoint", ".checkpoint.previous"].map(|suffix| out.join(format!("{STEM}{suffix}")));
    let step = |file: &PathBuf| CheckpointSummary::read(file).unwrap_or_else(|error| panic!("{error}")).step;
    files.iter().filter(|file| file.exists()).map(step).max()
}

/// All rows are still there, in the draft or the complete file.
fn has_kept(before: &BTreeMap<PathBuf, Vec<u8>>, out: &Path) {
    let after = rows(out);
    for (path, lines) in before {
        let complete = path.with_extension("");
        let mut kept = [path, &complete].into_iter().filter_map(|path| after.get(path));
        assert!(kept.any(|kept| kept.starts_with(lines)), "{}: rows were lost", path.display());
    }
}

/// What the run says of its own state.
fn state(out: &Path) -> String {
    let record = fs::read(out.join(format!("{STEM}-run.json"))).expect("a record");
    let record: serde_json::Value = serde_json::from_slice(&record).expect("JSON");
    record["state"].as_str().expect("a state").to_owned()
}

/// What `gluey info` says of a run is what lies there.
fn is_told(folder: &Path, state: &str) {
    let out = folder.join("out");
    let info: serde_json::Value =
        serde_json::from_str(&told(folder, &["info", "out", "--json"])).expect("JSON");
    let run = &info["runs"][0];
    assert_eq!(run["state"], state, "{run}");
    let steps = run["steps_done"].as_u64().expect("a number") as usize;
    let (file, count) =
        (run["rows"][0].as_str().expect("a file"), run["rows"][1].as_u64().expect("a number"));
    let lines = rows(&out)[&folder.join(file)].iter().filter(|&&byte| byte == b'\n').count();
    assert_eq!(count as usize, lines - 1, "{run}");
    let in_words = told(folder, &["info", "out"]);
    assert!(in_words.contains(&format!("{state}, {steps} of 20 steps done")), "{in_words}");
    match state {
        "killed" => assert!((lines - 2..lines).contains(&steps) || Some(steps) == saved(&out), "{run}"),
        _ => assert_eq!(Some(steps), saved(&out), "{run}"),
    }
}

/// Stops runs at random moments, each followed by another start, anew or from the last checkpoint.
/// `GLUEY_SIGNALS=200` stops them 200 times.
#[test]
fn nothing_is_lost_to_one_signal_or_two() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("discs.toml"), DISCS.replace("end = 2.0", "end = 1.0")).expect("a file");
    let run = |out| ["run", "discs.toml", "--out", out, "--vtk", "1", "--xyz", "1"];
    let start = Instant::now();
    let (status, stderr) = ended(started(folder, &run("whole")));
    assert!(status.success(), "{stderr}");
    let whole_ms = start.elapsed().as_millis() as u64;
    let (mut next, mut stopped, mut round) = (numbers(5), 0, 0);
    let out = folder.join("out");
    while stopped < stop_count() {
        let (first, second) = MANNERS[round % MANNERS.len()];
        round += 1;
        let before = saved(&out);
        let again = if before.is_some() { vec!["resume", "out"] } else { run("out").to_vec() };
        let child = started(folder, &again);
        sleep(Duration::from_millis(next(whole_ms / 3 + 1)));
        let written = rows(&out);
        send(first, &child);
        if let Some((signal, after_ms)) = second {
            sleep(Duration::from_millis(after_ms));
            send(signal, &child);
        }
        let (status, stderr) = ended(child);
        assert!(!stderr.contains("panicked"), "{stderr}");
        has_kept(&written, &out);
        if status.success() {
            same_results(&out, &folder.join("whole"));
            fs::remove_dir_all(&out).expect("removed");
            continue;
        }
        stopped += 1;
        assert!(saved(&out) >= before, "{first} {second:?}: a checkpoint was lost: {stderr}");
        let has_record = out.join(format!("{STEM}-run.json")).exists();
        match (status.code(), status.signal()) {
            (Some(130), None) => {
                assert!(saved(&out).is_some(), "{first} {second:?}: no checkpoint: {stderr}");
                assert!(
                    stderr.contains("interrupted after step") && stderr.contains("gluey resume out"),
                    "{stderr}"
                );
                is_told(folder, "interrupted");
            }
            // Before it listens to requests, or by one that cannot be listened to.
            (None, Some(_)) if has_record && before.is_none() && saved(&out).is_none() => {
                is_told(folder, "killed")
            }
            // Its process was still there, the run was not.
            (None, Some(9)) if has_record && state(&out) == "complete" => {
                is_told(folder, "complete");
                same_results(&out, &folder.join("whole"));
                fs::remove_dir_all(&out).expect("removed");
            }
            // It had not begun, or had done what the first signal asks for, and its process was still there.
            (None, Some(9)) if has_record && state(&out) == "interrupted" => is_told(folder, "interrupted"),
            (None, Some(9)) if has_record => is_told(folder, "killed"),
            (None, Some(_)) => {}
            _ => panic!("{first} {second:?}: {status}: {stderr}"),
        }
    }
    if out.join(format!("{STEM}.checkpoint")).exists() {
        let (status, stderr) = ended(started(folder, &["resume", "out"]));
        assert!(status.success(), "{stderr}");
        same_results(&out, &folder.join("whole"));
    }
}

/// A case whose first step takes seconds.
fn with_long_steps(folder: &Path) {
    let case = DISCS
        .replace("count = 12", "count = 40")
        .replace("cells_per_radius = 2.0", "cells_per_radius = 12.0");
    fs::write(folder.join("discs.toml"), case.replace("\"gluey\"", "\"none\"")).expect("a file");
}

fn wait_for(path: &Path) {
    let deadline = Instant::now() + Duration::from_secs(120);
    while !path.exists() {
        assert!(Instant::now() < deadline, "{} does not come", path.display());
        sleep(Duration::from_millis(2));
    }
}

/// The first request saves the last whole step at once, however long the present one takes; the second, if it
/// is not the first once more, ends the run without that.
#[test]
fn the_second_request_hurries_and_loses_nothing() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    with_long_steps(folder);
    let out = folder.join("out");
    let child = started(folder, &["run", "discs.toml"]);
    wait_for(&out.join("discs-none-unfitted-run.json"));
    send("-TERM", &child);
    wait_for(&out.join("discs-none-unfitted.checkpoint"));
    // This far from the first one it is another one.
    sleep(Duration::from_millis(1200));
    send("-TERM", &child);
    let (status, stderr) = ended(child);
    assert_eq!(status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("to go on: gluey resume out"), "{stderr}");
    let info = told(folder, &["info", "out"]);
    assert!(info.contains("interrupted, "), "{info}");
    let log = fs::read_to_string(out.join("discs-none-unfitted.log")).expect("a log");
    assert!(log.lines().last().is_some_and(|line| line.contains("interrupted after step")), "{log}");
    let file = out.join("discs-none-unfitted.checkpoint");
    CheckpointSummary::read(&file).unwrap_or_else(|error| panic!("{error}"));
}

/// `timeout` sends its signal to the run and then to the group in which the run is.
#[test]
fn a_run_that_times_out_is_gone_on_with() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("discs.toml"), DISCS.replace("end = 2.0", "end = 200.0")).expect("a file");
    let mut command = Command::new("timeout");
    let run = ["2", env!("CARGO_BIN_EXE_gluey"), "run", "discs.toml"];
    let output = command.current_dir(folder).args(run).output().expect("timeout");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(124), "{stderr}");
    assert!(stderr.contains("interrupted after step") && stderr.contains("gluey resume out"), "{stderr}");
    let step = saved(&folder.join("out")).expect("a checkpoint");
    assert!(told(folder, &["info", "out"]).contains(&format!("interrupted, {step} of 4000 steps done")));
}
