//! A folder of results says what was run and how it went, and is not written over.

mod program;

use std::fs;
use std::path::Path;

use gluey::{Case, CheckpointSummary, RunRecord, RunState};
use program::{fails, gluey, told};
use tempfile::TempDir;

const STEM: &str = "pair-3d-mobility-gluey";
const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");

fn read(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(format!("{name}/{STEM}.csv"))).expect("a trajectory")
}

#[test]
fn the_case_as_run_repeats_the_run() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    told(folder, &["run", CASE, "--set", "time.step=0.04", "--out", "one"]);
    let case_file = format!("one/{STEM}-case.toml");
    let case = Case::load(folder.join(&case_file)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(case.time.step, 0.04);
    told(folder, &["run", &case_file, "--out", "two"]);
    assert!(read(folder, "one") == read(folder, "two"), "another trajectory");
    let record = RunRecord::read(&folder.join(format!("one/{STEM}-run.json"))).expect("a record");
    assert_eq!((record.state, record.steps_done), (RunState::Complete, case.step_count()));
    assert_eq!(record.report.expect("a report").steps, case.step_count());
    assert!(record.ended.is_some() && record.machine.cpus > 0 && record.threads > 0);
}

#[test]
fn results_of_other_runs_are_not_replaced() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    told(folder, &["run", CASE]);
    let before = read(folder, "out");
    fails(folder, &["run", CASE], &["complete run of this case", "--force", "--out DIR"]);
    let other = ["run", CASE, "--set", "time.step=0.02"];
    fails(folder, &other, &["a run of another case", "step = 0.05", "step = 0.02", "--force"]);
    assert!(read(folder, "out") == before);
    told(folder, &[&other[..], &["--force"]].concat());
    assert!(read(folder, "out") != before);
    fs::remove_file(folder.join(format!("out/{STEM}-run.json"))).expect("a record");
    fails(folder, &["run", CASE], &["no record of their run"]);
}

/// With `--force` no frame of the old run stays among those of the new one; files of others do.
#[test]
fn frames_of_a_replaced_run_go() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    told(folder, &["run", CASE, "--vtk", "10", "--xyz", "10"]);
    let vtk = folder.join(format!("out/{STEM}-vtk"));
    fs::write(vtk.join("view.pvsm"), "of a user").expect("a file");
    told(folder, &["run", CASE, "--force", "--vtk", "100"]);
    let frames = |kind: &str| {
        let entries = fs::read_dir(folder.join(format!("out/{STEM}-{kind}"))).expect("a folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("text"));
        let mut names: Vec<String> = names.filter(|name| !name.ends_with(".lock")).collect();
        names.sort();
        names
    };
    let particles: Vec<String> =
        frames("vtk").into_iter().filter(|name| name.starts_with("particles-")).collect();
    let expected = [0, 100, 200, 300].map(|step| format!("particles-{step:06}.vtu"));
    assert_eq!(particles, expected);
    assert!(frames("xyz").is_empty(), "{:?}", frames("xyz"));
    assert!(vtk.join("view.pvsm").exists(), "a file of the user went");
}

#[test]
fn arguments_are_named_in_errors() {
    let folder = TempDir::new().expect("a folder");
    let refused = |set: &str, expected: &[&str]| fails(folder.path(), &["run", CASE, "--set", set], expected);
    refused("time.dt=0.01", &["--set time.dt=0.01", "unknown key `dt`", "did you mean `step`?"]);
    refused("tme.step=0.01", &["--set tme.step=0.01", "unknown key `tme`", "did you mean `time`?"]);
    refused("time.step=-1", &["--set time.step=-1", "out of range", "greater than 0"]);
    refused("time.step=fast", &["--set time.step=fast", "wrong type", "a number"]);
    refused("contact.strategy=glue", &["--set contact.strategy=glue", "did you mean \"gluey\"?"]);
    refused("particles.7.radius=0.1", &["there is no entry 7", "0 to 1"]);
    refused("particles.1.radius=9.0", &["--set particles.1.radius=9.0", "radius"]);
    for usage in ["time.step", "=1", "time..step=1", "time.step=0.1.2"] {
        let (code, _, stderr) = gluey(folder.path(), &["run", CASE, "--set", usage]);
        assert_eq!(code, Some(2), "{stderr}");
    }
    assert!(!folder.path().join("out").exists());
}

/// The last checkpoint is cut short: it is refused, the one before it is offered, and leads to the same rows.
#[test]
fn the_checkpoint_before_the_last_is_offered() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    told(folder, &["run", CASE, "--checkpoint-every", "100"]);
    let last = format!("out/{STEM}.checkpoint");
    let older = format!("{last}.previous");
    let step = |file: &str| CheckpointSummary::read(&folder.join(file)).expect("whole").step;
    assert_eq!((step(&last), step(&older)), (300, 200));
    let whole = fs::read(folder.join(&last)).expect("a checkpoint");
    let before = read(folder, "out");
    for (bytes, reason) in
        [(&whole[..whole.len() / 2], "damaged"), (&whole[..10], "damaged"), (b"x", "not a gluey")]
    {
        fs::write(folder.join(&last), bytes).expect("a file");
        let command = "gluey resume out --previous";
        fails(folder, &["run", CASE, "--resume", &last], &[reason, "after step 200, is whole", command]);
    }
    told(folder, &["run", CASE, "--resume", &older, "--checkpoint-every", "100"]);
    assert!(read(folder, "out") == before);
    assert_eq!((step(&last), step(&older)), (300, 200));
    assert!(folder.join(format!("{last}.earlier-1")).exists(), "the damaged one was kept");
}

#[test]
fn what_cannot_be_resumed_is_said() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    fails(folder, &["resume", "nowhere"], &["nowhere: cannot be read", "--out"]);
    fails(folder, &["resume", "."], &["no run is recorded there", "--out"]);
    told(folder, &["run", CASE, "--set", "time.end=0.5"]);
    fails(folder, &["resume", "out"], &["the run is complete (10 steps)"]);
    fails(folder, &["resume", "out", "--case", "trio"], &["no run `trio`", STEM, "--case"]);
    told(folder, &["run", CASE, "--set", "time.end=0.5", "--strategy", "none"]);
    fails(folder, &["resume", "out"], &["2 runs", "pair-3d-mobility-none", "--case"]);
    let record = folder.join(format!("out/{STEM}-run.json"));
    let text = fs::read_to_string(&record).expect("a record");
    fs::write(&record, text.replace("\"complete\"", "\"running\"")).expect("a record");
    let resume = ["resume", "out", "--case", STEM];
    let anew = format!("start again: gluey run out/{STEM}-case.toml --out out");
    fails(folder, &resume, &["there is no such checkpoint", &anew]);
    fs::write(&record, "{}").expect("a record");
    fails(folder, &resume, &["not the record of a run"]);
}

#[test]
fn reports_are_for_people_for_programs_or_for_nobody() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let said = |arguments: &[&str]| {
        let (code, stdout, stderr) = gluey(folder, arguments);
        assert_eq!((code, &*stderr), (Some(0), ""));
        stdout
    };
    let run = ["run", CASE, "--set", "time.end=0.5", "--force"];
    assert!(said(&run).contains("10 steps in"));
    assert_eq!(said(&[&run[..], &["--quiet"]].concat()), "");
    let report = said(&[&run[..], &["--json", "--quiet", "--threads", "2"]].concat());
    let report: gluey::RunReport = serde_json::from_str(&report).expect("a report and nothing else");
    assert_eq!((report.case.as_str(), report.steps), ("pair-3d-mobility", 10));
    let record = RunRecord::read(&folder.join(format!("out/{STEM}-run.json"))).expect("a record");
    assert_eq!(record.threads, 2);
    let (code, stdout, stderr) = gluey(folder, &["run", CASE, "--json"]);
    assert!(code == Some(1) && stdout.is_empty() && !stderr.is_empty(), "{stderr}");
}

#[test]
fn a_log_says_when_a_run_began_and_how_it_ended() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let log = || fs::read_to_string(folder.join(format!("out/{STEM}.log"))).expect("a log");
    let (code, _, stderr) = gluey(folder, &["run", CASE, "--set", "time.step=0.05", "--verbose"]);
    assert_eq!(code, Some(0), "{stderr}");
    let record = RunRecord::read(&folder.join(format!("out/{STEM}-run.json"))).expect("a record");
    let lines = |text: &str, of: &str| text.lines().filter(|line| line.contains(of)).count();
    assert_eq!(lines(&stderr, "contacts act"), record.steps + 1, "{stderr}");
    let text = log();
    let [first, .., last] = text.lines().collect::<Vec<_>>()[..] else { panic!("{text}") };
    assert!(first.contains("pair-3d-mobility") && first.starts_with(&record.started[..17]), "{text}");
    assert!(last.contains(&format!("complete after {} steps in ", record.steps)), "{text}");
    // Another run begins another log.
    told(folder, &["run", CASE, "--force", "--set", "time.step=0.1"]);
    assert_eq!(lines(&log(), "complete after"), 1, "{}", log());
    assert!(log().contains(&format!("complete after {} steps", record.steps.div_ceil(2))), "{}", log());
}

/// Names of the files in a folder of frames, sorted.
fn frames(folder: &Path, label: &str) -> Vec<String> {
    let entries = fs::read_dir(folder.join(format!("out/{STEM}-{label}"))).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"));
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

#[test]
fn a_case_has_streams_of_frames_with_intervals_of_their_own() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let streams = r#"
        [[output]]
        kind = "xyz"
        every_strain = 0.25
        compression = 0
        [[output]]
        kind = "vtk"
        label = "coarse"
        every = 60
        [[output]]
        kind = "xyz"
        label = "often"
        every = 10
        [[output]]
        kind = "xyz"
        label = "clock"
        every_time = 2.5
        compression = 0
    "#;
    let text = fs::read_to_string(CASE).expect("a case") + streams;
    fs::write(folder.join("case.toml"), text).expect("a case");
    let run = ["run", "case.toml", "--set", "time.step=0.1", "--set", "time.end=12"];
    told(folder, &run);
    // Steps of 0.1 get to strains of 0.25, 0.5, 0.75, 1, ... in turn.
    let of_strain = frames(folder, "xyz");
    let expected = [0, 3, 5, 8, 10, 13].map(|step| format!("particles-{step:06}.xyz"));
    assert_eq!(of_strain[..6], expected);
    assert_eq!(of_strain.len(), 49);
    let of_steps: Vec<String> = (0..=12).map(|frame| format!("particles-{:06}.xyz.gz", 10 * frame)).collect();
    assert_eq!(frames(folder, "often"), of_steps);
    let of_time = [0, 25, 50, 75, 100].map(|step| format!("particles-{step:06}.xyz"));
    assert_eq!(frames(folder, "clock"), of_time);
    let coarse = frames(folder, "coarse");
    assert_eq!(coarse.iter().filter(|name| name.starts_with("particles-")).count(), 3, "{coarse:?}");
    // An option takes the place of the stream in the same folder; frames of the run before are gone.
    told(folder, &[&run[..], &["--force", "--xyz", "40"]].concat());
    assert_eq!(frames(folder, "xyz"), [0, 40, 80, 120].map(|step| format!("particles-{step:06}.xyz")));
    assert_eq!(frames(folder, "often"), of_steps);
}
