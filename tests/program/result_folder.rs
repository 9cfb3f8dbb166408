//! A folder of results says what was run and how it went, and is not written over.

use std::fs;
use std::path::{Path, PathBuf};

use crate::program::{fails, gluey, told};
use gluey::{Case, CheckpointSummary, RunRecord, RunState};
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
    assert!(!folder.join(format!("out/{STEM}-xyz")).exists(), "an empty folder is left");
    assert!(vtk.join("view.pvsm").exists(), "a file of the user went");
}

/// All files in a folder and below it, but for what `kept` names.
fn files(folder: &Path, kept: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => found.extend(files(&path, kept)),
            false if kept.iter().any(|name| path.ends_with(name)) => {}
            false => found.push(path),
        }
    }
    found.sort();
    found
}

/// With `--force` nothing is left of the run that is replaced, nor of what was made of it: pictures, films,
/// pages, tables, checkpoints, rows of runs that were killed. What gluey did not write stays.
#[test]
fn nothing_is_left_of_a_run_that_is_replaced() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let case = "name = \"pair\"\ndimension = 2\nparticles = [{ position = [0.4, 0.53], radius = 0.05 }, \
                { position = [0.6, 0.47], radius = 0.05 }]\ntime = { step = 0.1, end = 0.4 }\n\
                contact = { strategy = \"none\" }\nflow = { mesh = { cells_per_radius = 2.0 } }\n\
                [[output]]\nkind = \"xyz\"\nlabel = \"often\"\nevery = 1\n";
    fs::write(folder.join("pair.toml"), case).expect("a case");
    let set = ["--set", "time.end=0.2", "--set", "output.0.label=seldom"];
    told(folder, &[&["run", "pair.toml", "--out", "alone"][..], &set].concat());
    told(folder, &["run", "pair.toml", "--xyz", "1", "--vtk", "1", "--checkpoint-every", "1"]);
    told(folder, &["plot", "out", "--frame", "last", "--animation"]);
    for of_frames in ["out/pair-none-unfitted-xyz", "out/pair-none-unfitted-often"] {
        told(folder, &["analyse", of_frames]);
        told(folder, &["view", of_frames]);
        told(folder, &["plot", of_frames, "--animation"]);
    }
    for command in ["analyse", "plot", "view"] {
        told(folder, &[command, "out"]);
    }
    let own = ["notes.txt", "pair-none-unfitted-plots/mine.svg", "structure-plots/mine.png", "report.html"];
    for name in own {
        fs::write(folder.join("out").join(name), "of a user").expect("a file");
    }
    fs::write(folder.join("out/pair-none-unfitted.csv.partial-3"), "t\n").expect("a file");
    told(folder, &[&["run", "pair.toml", "--force"][..], &set].concat());
    let names = |run: &str, kept: &[&str]| -> Vec<PathBuf> {
        let root = folder.join(run);
        files(&root, kept).iter().map(|file| file.strip_prefix(&root).expect("inside").to_owned()).collect()
    };
    assert_eq!(names("out", &own), names("alone", &[]));
    assert!(own.iter().all(|name| folder.join("out").join(name).exists()), "a file of the user went");
    assert!(!folder.join("out/pair-none-unfitted-xyz").exists(), "an empty folder is left");
}

/// Tables and pages of a folder are those of the run in it that has frames: another one that is replaced
/// leaves them, and its neighbours alone, also those whose names begin with its own.
#[test]
fn what_belongs_to_other_runs_stays() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let run = ["run", CASE, "--set", "time.end=0.5"];
    told(folder, &[&run[..], &["--xyz", "1"]].concat());
    for command in ["analyse", "plot", "view"] {
        told(folder, &[command, "out"]);
    }
    let other = [&run[..], &["--strategy", "none"]].concat();
    told(folder, &other);
    told(folder, &["plot", "out"]);
    let of_first = || {
        let all = files(&folder.join("out"), &[]).into_iter();
        all.filter(|path| !path.to_string_lossy().contains("mobility-none")).collect::<Vec<_>>()
    };
    let before = of_first();
    told(folder, &[&other[..], &["--force"]].concat());
    assert_eq!(of_first(), before);
    assert!(!folder.join("out/pair-3d-mobility-none-plots").exists(), "pictures of the run that went");
    assert!(folder.join("out/series.csv").exists() && folder.join("out/view.html").exists());
}

/// A complete run goes on to a later end, to the bits of one that was that long, and says how.
#[test]
fn a_complete_run_goes_on_to_a_later_end() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    told(folder, &["run", CASE, "--out", "long", "--xyz", "20"]);
    told(folder, &["run", CASE, "--set", "time.end=5", "--xyz", "20"]);
    let longer = "gluey resume out --set time.end=15.75";
    fails(folder, &["run", CASE], &["a complete run of this case is there", longer, "--out DIR", "--force"]);
    fails(folder, &["resume", "out"], &["the run is complete (100 steps)", "--set time.end=T"]);
    fails(folder, &["resume", "out", "--set", "time.end=4"], &["the run is complete (100 steps)"]);
    fails(
        folder,
        &["resume", "out", "--set", "time.end=9", "--set", "time.step=0.02"],
        &["another case", "only its end"],
    );
    assert!(read(folder, "out").len() < read(folder, "long").len(), "what was refused changed rows");
    told(folder, &["resume", "out", "--set", "time.end=15.75"]);
    assert!(read(folder, "out") == read(folder, "long"), "another trajectory");
    let frames = |run: &str| files(&folder.join(format!("{run}/{STEM}-xyz")), &[]).len();
    assert_eq!(frames("out"), frames("long"));
    let info = told(folder, &["info", "out"]);
    assert!(info.contains("complete, 315 of 315 steps done"), "{info}");
    // An end that is not later has nothing to go on to.
    fails(folder, &["run", CASE, "--set", "time.end=5"], &["a complete run of this case", "--force"]);
}

/// Keys that do nothing for what other keys say are told, once, and by `gluey check`, too.
#[test]
fn keys_without_effect_are_told() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let set = ["--set", "contact.threshold=0.01", "--set", "flow.tolerance=1e-3", "--set", "time.end=0.5"];
    let expected =
        ["without effect: flow.tolerance (flow.hydrodynamics = \"pair-mobility\")", "contact.threshold"];
    for command in
        [&["run", CASE][..], &["check", CASE], &["check", CASE, "--no-trial"], &["run", CASE, "--force"]]
    {
        let (code, _, stderr) = gluey(folder, &[command, &set].concat());
        assert_eq!(code, Some(0), "{stderr}");
        for part in expected {
            assert_eq!(stderr.matches(part).count(), 1, "{command:?}: {stderr}");
        }
    }
    let log = fs::read_to_string(folder.join(format!("out/{STEM}.log"))).expect("a log");
    assert!(log.contains(expected[0]), "{log}");
    for options in [
        &["run", CASE, "--vtk-precision", "f32"][..],
        &["run", CASE, "--vtk-compression", "0"],
        &["plot", "out", "--view", "0,0"],
        &["plot", "out", "--colour", "gap"],
        &["plot", "out", "--contacts", "0.1"],
    ] {
        let (code, _, stderr) = gluey(folder, options);
        assert_eq!(code, Some(2), "{options:?}: {stderr}");
    }
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
    assert_eq!((step(&last), step(&older)), (315, 300));
    let whole = fs::read(folder.join(&last)).expect("a checkpoint");
    let before = read(folder, "out");
    for (bytes, reason) in
        [(&whole[..whole.len() / 2], "damaged"), (&whole[..10], "damaged"), (b"x", "not a gluey")]
    {
        fs::write(folder.join(&last), bytes).expect("a file");
        let command = "gluey resume out --previous";
        fails(folder, &["run", CASE, "--resume", &last], &[reason, "after step 300, is whole", command]);
    }
    told(folder, &["run", CASE, "--resume", &older, "--checkpoint-every", "100"]);
    assert!(read(folder, "out") == before);
    assert_eq!((step(&last), step(&older)), (315, 300));
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
    fs::remove_file(folder.join(format!("out/{STEM}.checkpoint"))).expect("a checkpoint");
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
