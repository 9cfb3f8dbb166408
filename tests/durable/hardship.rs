//! What machines do to a run: disks that are full, limits, threads that panic. The last checkpoint stays
//! whole, the message names the file, and what is gone on with ends with the bits of a run that nothing
//! stopped.
#![cfg(unix)]

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicBool, Ordering};

use gluey::{Case, Progress, ProgressState, RunError, RunOptions, Silent, run};
use tempfile::TempDir;

const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");
const CSV: &str = "pair-3d-mobility-gluey.csv";

/// The signal of a file that has become too large, on Linux and macOS.
const SIGXFSZ: i32 = 25;

/// Runs a script in `folder`, where `$GLUEY` is the program and `$CASE` a case of 315 quick steps.
fn shell(folder: &Path, script: &str) -> Output {
    let mut command = Command::new("sh");
    command.current_dir(folder).args(["-c", script]).env("LC_ALL", "C");
    command.env("GLUEY", env!("CARGO_BIN_EXE_gluey")).env("CASE", CASE).output().expect("a shell")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The trajectory of a run that nothing stops.
fn whole(folder: &Path) -> Vec<u8> {
    let output = shell(folder, "$GLUEY run $CASE --quiet --out whole");
    assert!(output.status.success(), "{}", text(&output.stderr));
    fs::read(folder.join("whole").join(CSV)).expect("a trajectory")
}

/// Goes on with the run in `out`, without what stopped it: it ends as one that was not stopped.
fn goes_on(folder: &Path) {
    let output = shell(folder, "$GLUEY resume out --quiet");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let resumed = fs::read(folder.join("out").join(CSV)).expect("a trajectory");
    assert!(resumed == whole(folder), "the run ends otherwise");
}

fn says(output: &Output, parts: &[&str]) {
    let stderr = text(&output.stderr);
    assert!(!stderr.contains("panicked"), "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "`{part}` is not in:\n{stderr}");
    }
}

#[test]
fn a_file_that_may_not_grow_stops_the_run_at_its_last_step() {
    let folder = TempDir::new().expect("a folder");
    let script = "trap '' XFSZ; ulimit -f 16; exec $GLUEY run $CASE --out out --checkpoint-every 10";
    let output = shell(folder.path(), script);
    assert_eq!(output.status.code(), Some(1));
    let parts = ["holds it after", ".partial-1: cannot write a row", "File too large"];
    says(&output, &parts);
    says(&output, &["make room on that disk; then, to go on: gluey resume out"]);
    goes_on(folder.path());
}

#[test]
fn a_run_that_is_killed_for_a_large_file_leaves_its_last_checkpoint() {
    let folder = TempDir::new().expect("a folder");
    let script = "ulimit -f 16; exec $GLUEY run $CASE --out out --checkpoint-every 10";
    let output = shell(folder.path(), script);
    assert_eq!(output.status.signal(), Some(SIGXFSZ), "{}", text(&output.stderr));
    goes_on(folder.path());
}

/// Runs a script that may mount disks; none where the system does not let it.
fn with_disks(folder: &Path, script: &str) -> Option<Output> {
    let mount = "mkdir -p out && mount -t tmpfs -o size=64k tmpfs out";
    if !shell(folder, &format!("unshare -rm sh -c '{mount}'")).status.success() {
        println!("no disk can be mounted here: not tried");
        return None;
    }
    Some(shell(folder, &format!("unshare -rm sh -c '{mount} && {script}'")))
}

#[test]
fn a_full_disk_leaves_the_last_checkpoint_and_room_lets_the_run_go_on() {
    let folder = TempDir::new().expect("a folder");
    let script = "($GLUEY run $CASE --out out --checkpoint-every 10; echo code $?; \
        ls out; $GLUEY info out; mount -o remount,size=4m out; $GLUEY resume out --quiet; \
        echo code $?; cp out/*.csv .)";
    let Some(output) = with_disks(folder.path(), script) else { return };
    let stdout = text(&output.stdout);
    assert!(stdout.contains("code 1\n") && stdout.ends_with("code 0\n"), "{stdout}{}", text(&output.stderr));
    assert!(stdout.contains("out/pair-3d-mobility-gluey.checkpoint, after step"), "{stdout}");
    says(&output, &["No space left on device", "out/pair-3d-mobility-gluey"]);
    says(&output, &["make room on that disk; then, to go on", ": gluey resume out"]);
    let resumed = fs::read(folder.path().join(CSV)).expect("a trajectory");
    assert!(resumed == whole(folder.path()), "the run ends otherwise");
}

#[test]
fn a_disk_that_is_read_only_is_refused_before_the_first_step() {
    let folder = TempDir::new().expect("a folder");
    let script = "(mount -o remount,ro out; $GLUEY run $CASE --out out; echo code $?)";
    let Some(output) = with_disks(folder.path(), script) else { return };
    assert_eq!(text(&output.stdout), "code 1\n");
    says(&output, &["out/pair-3d-mobility-gluey.csv", "cannot write", "Read-only", "--out DIR"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_log_that_cannot_be_written_ends_no_run() {
    let folder = TempDir::new().expect("a folder");
    let script =
        "mkdir out; ln -s /dev/full out/pair-3d-mobility-gluey.log; $GLUEY run $CASE --out out --quiet";
    let output = shell(folder.path(), script);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let written = fs::read(folder.path().join("out").join(CSV)).expect("a trajectory");
    assert!(written == whole(folder.path()));
}

#[test]
fn the_log_tells_what_a_run_took() {
    let folder = TempDir::new().expect("a folder");
    whole(folder.path());
    let log = fs::read_to_string(folder.path().join("whole/pair-3d-mobility-gluey.log")).expect("a log");
    let lines: Vec<&str> = log.lines().collect();
    assert!(lines[0].contains(": pair-3d-mobility, 315 steps, "), "{log}");
    let last = lines.last().expect("lines");
    assert!(last.contains("complete after 315 steps in ") && last.ends_with(" %"), "{log}");
    assert!(["flow", "contact", "motion", "output"].iter().all(|phase| last.contains(phase)), "{log}");
}

/// By an estimate, before anything is written.
#[test]
fn a_case_beyond_a_limit_of_memory_is_refused() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("discs.toml"), DISCS).expect("a file");
    for command in ["run discs.toml", "check discs.toml", "sweep discs.toml --set time.step=0.1"] {
        let output = shell(folder.path(), &format!("$GLUEY {command} --memory-limit 0.01"));
        assert_eq!(output.status.code(), Some(1));
        says(&output, &["of memory; the limit is 10 MB", "raise --memory-limit"]);
        assert!(!folder.path().join("out").exists());
    }
    let output = shell(folder.path(), "$GLUEY run discs.toml --memory-limit nothing");
    assert_eq!(output.status.code(), Some(2));
    says(&output, &["a number of gigabytes, greater than 0"]);
    let output = shell(folder.path(), "$GLUEY run discs.toml --memory-limit 2 --quiet");
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
#[cfg(target_os = "linux")]
fn a_case_beyond_the_limit_of_the_shell_is_refused() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("discs.toml"), DISCS).expect("a file");
    let fine = "--set flow.mesh.cells_per_radius=1000.0";
    let output = shell(folder.path(), &format!("ulimit -v 1000000; $GLUEY run discs.toml {fine}"));
    assert_eq!(output.status.code(), Some(1));
    says(&output, &["of memory; ", " MB are there", "fewer cells per radius"]);
}

const DISCS: &str = "name = \"discs\"\ndimension = 2\n\
    particles = [{ position = [0.3, 0.5], radius = 0.1 }, { position = [0.7, 0.5], radius = 0.1 }]\n\
    time = { step = 0.1, end = 0.1 }\n\
    flow = { formulation = \"unfitted\", mesh = { cells_per_radius = 2.0 } }\n";

/// A thread of the pool that panics in the fifth step, once.
struct Fault(AtomicBool);

impl Progress for Fault {
    fn report(&self, state: &ProgressState) {
        if state.step == 5 && !self.0.swap(true, Ordering::Relaxed) {
            rayon::join(|| (), || panic!("a fault of the program"));
        }
    }
}

#[test]
fn a_thread_that_panics_leaves_a_checkpoint_of_the_step_before() {
    let folder = TempDir::new().expect("a folder");
    let case = Case::load(CASE).expect("a case");
    let checkpoint = folder.path().join("c.checkpoint");
    let options =
        RunOptions { checkpoint: Some(checkpoint.clone()), ..RunOptions::csv(folder.path().join("t.csv")) };
    match run(&case, &options, &Fault(AtomicBool::new(false))) {
        Err(RunError::Stopped { step: 5, checkpoint: path, cause }) => {
            assert_eq!(path, checkpoint);
            let cause = cause.to_string();
            assert_eq!(cause, "an internal error in step 5 (t = 0.25): a fault of the program");
        }
        other => panic!("{other:?}"),
    }
    let resumed = run(&case, &RunOptions { resume: Some(checkpoint), ..options }, &Silent);
    assert_eq!(resumed.unwrap_or_else(|error| panic!("{error}")).steps, 315);
    let rows = fs::read(folder.path().join("t.csv")).expect("a trajectory");
    assert!(rows == whole(folder.path()), "the run ends otherwise");
}

#[test]
fn a_thread_that_panics_ends_a_run_without_checkpoints() {
    let folder = TempDir::new().expect("a folder");
    let case = Case::load(CASE).expect("a case");
    let outcome = run(&case, &RunOptions::csv(folder.path().join("t.csv")), &Fault(AtomicBool::new(false)));
    assert!(matches!(outcome, Err(RunError::Panicked { step: 5, .. })), "{outcome:?}");
}
