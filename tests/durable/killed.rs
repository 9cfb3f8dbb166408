//! Runs that are killed, told to stop or started twice lose no row that was written.
#![cfg(unix)]

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::stopped::{DISCS, numbers, results, rows, same_results};
use tempfile::TempDir;

const STEM: &str = "out/pair-3d-mobility-gluey";

/// A folder with a case of so many steps, 100 000 of which take about a second.
fn folder(step_count: u32) -> TempDir {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");
    let step = 15.75 / f64::from(step_count);
    let case = fs::read_to_string(file).expect("a case");
    let case =
        case.replace("step = 0.05", &format!("step = {step}")).replace("reference = ", "# reference = ");
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("long.toml"), case).expect("a file");
    folder
}

fn gluey(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
    command.current_dir(folder).args(["run", "long.toml"]).args(arguments).stdout(Stdio::null());
    command
}

/// Waits until a run has written some rows.
fn wait_for_rows(path: &Path) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while fs::metadata(path).map_or(0, |file| file.len()) < 10_000 {
        assert!(Instant::now() < deadline, "the run does not get going");
        sleep(Duration::from_millis(5));
    }
}

fn in_folder(folder: &Path, suffix: &str) -> PathBuf {
    folder.join(format!("{STEM}{suffix}"))
}

/// A run that writes rows, and the end of it.
struct Started(Child);

impl Started {
    fn new(folder: &Path) -> Self {
        let run = Self(gluey(folder, &[]).stderr(Stdio::piped()).spawn().expect("it runs"));
        wait_for_rows(&in_folder(folder, ".csv.partial-1"));
        run
    }

    fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([name, &self.0.id().to_string()]).status();
        assert!(sent.expect("a signal").success());
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The step is finished, a checkpoint written, the way to go on told.
#[test]
fn every_request_to_stop_leaves_a_checkpoint_to_go_on_from() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let folder = folder(10_000_000);
        let mut run = Started::new(folder.path());
        run.signal(signal);
        let mut stderr = String::new();
        let mut pipe = run.0.stderr.take().expect("piped");
        std::io::Read::read_to_string(&mut pipe, &mut stderr).expect("text");
        assert_eq!(run.0.wait().expect("it ends").code(), Some(130), "{signal}: {stderr}");
        assert!(stderr.contains("interrupted after step"), "{stderr}");
        let checkpoint = format!("{STEM}.checkpoint");
        assert!(stderr.contains("to go on: gluey resume out\n"), "{stderr}");
        assert!(folder.path().join(checkpoint).is_file(), "{signal}");
    }
}

/// A terminal that was closed takes nothing that is written to it.
#[test]
fn a_run_that_nobody_listens_to_leaves_a_checkpoint() {
    let folder = folder(10_000_000);
    let mut run = Started::new(folder.path());
    drop(run.0.stderr.take());
    run.signal("-HUP");
    assert_eq!(run.0.wait().expect("it ends").code(), Some(130));
    assert!(in_folder(folder.path(), ".checkpoint").is_file());
}

#[test]
fn results_that_are_being_written_are_refused() {
    let folder = folder(10_000_000);
    let run = Started::new(folder.path());
    let second = gluey(folder.path(), &[]).output().expect("it runs");
    let stderr = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(1), "{stderr}");
    let holder = format!("{STEM}.csv: in use by the run of process {}", run.0.id());
    assert!(stderr.contains(&holder) && stderr.contains("--out DIR"), "{stderr}");
    assert!(!in_folder(folder.path(), ".csv.partial-2").exists(), "the second run wrote rows");
    // Another strategy has results of its own.
    let end = fs::read_to_string(folder.path().join("long.toml")).expect("a case");
    fs::write(folder.path().join("long.toml"), end.replace("end = 15.75", "end = 0.01")).expect("a file");
    let beside = gluey(folder.path(), &["--strategy", "inelastic"]).output().expect("it runs");
    assert!(beside.status.success(), "{}", String::from_utf8_lossy(&beside.stderr));
}

/// A start that comes to nothing takes nothing away.
#[test]
fn a_failing_start_leaves_the_rows_of_a_killed_run() {
    let folder = folder(10_000_000);
    drop(Started::new(folder.path()));
    let draft = in_folder(folder.path(), ".csv.partial-1");
    let rows = fs::read(&draft).expect("rows");
    let failed = gluey(folder.path(), &["--resume", "nowhere"]).output().expect("it runs");
    assert_eq!(failed.status.code(), Some(1));
    assert!(fs::read(&draft).expect("rows") == rows, "rows were lost");
    let mut fresh = gluey(folder.path(), &[]).stderr(Stdio::piped()).spawn().expect("it runs");
    wait_for_rows(&in_folder(folder.path(), ".csv.partial-2"));
    fresh.kill().expect("killed");
    let output = fresh.wait_with_output().expect("it ends");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("rows of earlier runs") && stderr.contains(".csv.partial-1"), "{stderr}");
    assert!(fs::read(&draft).expect("rows") == rows, "rows were lost");
}

/// `kill -9` at twenty moments, each followed by another start, anew or from the last checkpoint.
#[test]
fn no_row_is_lost_to_twenty_kills() {
    let folder = folder(100_000);
    let folder = folder.path();
    let checkpoint = format!("{STEM}.checkpoint");
    let mut next = numbers(7);
    let mut resumed = 0;
    for _ in 0..20 {
        let before = rows(&folder.join("out"));
        let resume = folder.join(&checkpoint).exists() && next(3) > 0;
        let arguments = ["--checkpoint-every", "1000", "--resume", &checkpoint];
        let mut command = gluey(folder, &arguments[..if resume { 4 } else { 2 }]);
        let mut run = command.stderr(Stdio::null()).spawn().expect("it runs");
        sleep(Duration::from_millis(next(200)));
        run.kill().expect("killed");
        run.wait().expect("it ends");
        resumed += usize::from(resume);
        let after = rows(&folder.join("out"));
        for (path, lines) in &before {
            let complete = path.with_extension("");
            let kept = [path, &complete].into_iter().filter_map(|path| after.get(path));
            assert!(
                kept.into_iter().any(|kept| kept.starts_with(lines)),
                "{}: rows were lost",
                path.display()
            );
        }
    }
    assert!(resumed > 5, "only {resumed} runs were resumed");
    let last = gluey(folder, &["--resume", &checkpoint]).output().expect("it runs");
    assert!(last.status.success(), "{}", String::from_utf8_lossy(&last.stderr));
    let whole = gluey(folder, &["--out", "whole"]).output().expect("it runs");
    assert!(whole.status.success());
    let read = |folder_name: &str| {
        fs::read(folder.join(folder_name).join("pair-3d-mobility-gluey.csv")).expect("a trajectory")
    };
    assert!(read("out") == read("whole"), "the run that was killed ends otherwise");
}

/// With the options of the run: frames for ParaView and in extended XYZ are those of a run without a stop.
#[test]
fn a_killed_run_is_resumed_by_its_folder() {
    let folder = folder(100_000);
    let folder = folder.path();
    let options = ["--checkpoint-every", "1000", "--vtk", "20000", "--xyz", "20000"];
    let mut run = gluey(folder, &options).stderr(Stdio::null()).spawn().expect("it runs");
    let deadline = Instant::now() + Duration::from_secs(60);
    while !in_folder(folder, ".checkpoint.previous").exists() {
        assert!(Instant::now() < deadline, "no checkpoint is written");
        sleep(Duration::from_millis(1));
    }
    run.kill().expect("killed");
    run.wait().expect("it ends");
    assert!(!in_folder(folder, ".csv").exists(), "it was killed too late");
    let resume = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
        let output = command.current_dir(folder).args(["resume", "out"]).args(arguments).output();
        let output = output.expect("it runs");
        (output.status.code(), String::from_utf8(output.stderr).expect("text"))
    };
    let (code, stderr) = resume(&["--previous", "--case", "pair-3d-mobility-gluey", "--threads", "1"]);
    assert_eq!(code, Some(0), "{stderr}");
    let whole = gluey(folder, &[&options[..], &["--out", "whole"]].concat()).output().expect("it runs");
    assert!(whole.status.success());
    let (resumed, whole) = (results(&folder.join("out")), results(&folder.join("whole")));
    assert_eq!(resumed.keys().collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>());
    assert!(whole.len() > 12, "{:?}", whole.keys());
    for (path, bytes) in &whole {
        assert!(resumed[path] == *bytes, "{} differs", path.display());
    }
    let (code, stderr) = resume(&[]);
    assert_eq!(code, Some(1));
    assert!(stderr.contains("the run is complete (100000 steps)"), "{stderr}");
}

/// How often a run is killed: six times, or as the environment says.
fn kill_count() -> usize {
    std::env::var("GLUEY_KILLS").map_or(6, |text| text.parse().expect("GLUEY_KILLS is a whole number"))
}

/// Killed again and again, with a checkpoint and frames at every step, so that these are often cut short.
/// Trajectory, gaps, rheology, cost of the steps (but for the seconds) and frames are those of a run that
/// was not, and nothing else is left.
#[test]
fn a_killed_run_ends_as_one_that_was_not() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("discs.toml"), DISCS).expect("a file");
    let command = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
        command.current_dir(folder).args(arguments).stdout(Stdio::null());
        command
    };
    let options = ["--checkpoint-every", "1", "--vtk", "1", "--xyz", "1"];
    let run = |out| [&["run", "discs.toml", "--out", out][..], &options[..]].concat();
    let start = Instant::now();
    let whole = command(&run("whole")).output().expect("it runs");
    assert!(whole.status.success(), "{}", String::from_utf8_lossy(&whole.stderr));
    let whole_ms = start.elapsed().as_millis() as u64;
    let (mut next, mut kills) = (numbers(11), 0);
    let count = kill_count();
    let out = folder.join("out");
    while kills < count {
        let is_begun = out.join("discs-gluey-unfitted.checkpoint").exists();
        let again = if is_begun { vec!["resume", "out"] } else { [&run("out")[..], &["--force"]].concat() };
        let mut child = command(&again).stderr(Stdio::null()).spawn().expect("it runs");
        // Short enough that there are several kills before the end, at any part of a step.
        sleep(Duration::from_millis(20 + next(whole_ms / 4 + 1)));
        child.kill().expect("killed");
        let status = child.wait().expect("it ends");
        match status.signal() {
            Some(9) => kills += 1,
            _ => {
                assert!(status.success(), "{status} after {kills} kills");
                same_results(&out, &folder.join("whole"));
                fs::remove_dir_all(&out).expect("removed");
            }
        }
    }
    if out.join("discs-gluey-unfitted.checkpoint").exists() {
        let last = command(&["resume", "out"]).output().expect("it runs");
        assert!(last.status.success(), "{}", String::from_utf8_lossy(&last.stderr));
        same_results(&out, &folder.join("whole"));
    }
}
