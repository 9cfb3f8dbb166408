//! Commands beside `gluey run`: what they tell and what they refuse.

use std::fs;
use std::path::Path;

use crate::program::{fails, gluey, told};
use serde_json::Value;
use tempfile::TempDir;

const STEM: &str = "pair-3d-mobility-gluey";
const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");

/// Nine discs in a sheared box.
const SUSPENSION: &str = "name = \"s\"\ndimension = 2\ndomain = { boundary = \"sheared\" }\n\
    suspension = { volume_fraction = 0.2, count = 9 }\ntime = { step = 0.01, end = 10.0 }\n\
    contact = { strategy = \"none\" }\nflow = { formulation = \"unfitted\" }\n";

fn json(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&told(folder, arguments)).expect("JSON and nothing else")
}

#[test]
fn cases_runs_and_checkpoints_say_what_they_are() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let case = json(folder, &["info", CASE, "--json"]);
    assert_eq!((&case["kind"], &case["particles"], &case["steps"]), (&"case".into(), &2.into(), &315.into()));
    assert!(told(folder, &["info", CASE]).contains("315 steps of 0.05 to t = 15.75"));
    told(folder, &["run", CASE, "--quiet", "--checkpoint-every", "100"]);
    let run = &json(folder, &["info", "out", "--json"])["runs"][0];
    assert_eq!((&run["name"], &run["state"]), (&STEM.into(), &"complete".into()));
    assert_eq!((&run["checkpoints"][0]["step"], &run["checkpoints"][1]["step"]), (&315.into(), &300.into()));
    let record = format!("out/{STEM}-run.json");
    assert_eq!(json(folder, &["info", &record, "--json"])["runs"][0], *run);
    let last = format!("out/{STEM}.checkpoint");
    let checkpoint = json(folder, &["info", &last, "--json"]);
    assert_eq!((&checkpoint["kind"], &checkpoint["step"]), (&"checkpoint".into(), &315.into()));
    assert_eq!(checkpoint["case"]["name"], "pair-3d-mobility");
    assert!(told(folder, &["info", &last]).contains("after step 315, t = 15.75,"));
    // A record that says `running` of a run that no process does any more.
    let record = folder.join(record);
    let text = fs::read_to_string(&record).expect("a record");
    fs::write(record, text.replace("\"complete\"", "\"running\"")).expect("a record");
    fs::write(folder.join(&last), "gluey-ck, cut").expect("a file");
    let run = told(folder, &["info", "out"]);
    assert!(run.contains("killed, 315 of 315 steps") && run.contains("damaged: it is cut short"), "{run}");
    fails(folder, &["info", &last], &["damaged"]);
    fails(folder, &["info", "nowhere"], &["nowhere: cannot be read", "give a case file"]);
    fails(folder, &["info", "."], &["no run is recorded there"]);
    fs::write(folder.join("bad.toml"), "name = 3").expect("a file");
    fails(folder, &["info", "bad.toml"], &["bad.toml"]);
}

#[test]
fn every_command_has_examples_and_exit_codes_are_told() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    for command in
        ["run", "resume", "check", "info", "analyse", "view", "plot", "new", "completions", "schema", "sweep"]
    {
        let help = told(folder, &[command, "--help"]);
        assert!(help.contains("Example") && help.contains(&format!("\n  gluey {command} ")), "{help}");
    }
    let help = told(folder, &["--help"]);
    for code in ["\n  0 ", "\n  1 ", "\n  2 ", "\n  130 "] {
        assert!(help.contains(code), "{help}");
    }
    assert_eq!(gluey(folder, &["sail"]).0, Some(2));
    assert_eq!(gluey(folder, &[]).0, Some(2));
}

#[test]
fn shells_are_told_what_to_complete() {
    let folder = TempDir::new().expect("a folder");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = told(folder.path(), &["completions", shell]);
        for part in ["resume", "checkpoint-minutes", "template"] {
            assert!(script.contains(part), "{shell}: `{part}` is not in:\n{script}");
        }
    }
    assert_eq!(gluey(folder.path(), &["completions", "cmd"]).0, Some(2));
}

#[test]
fn new_cases_run_as_they_are() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    for template in ["pair", "trio", "sedimentation", "suspension"] {
        for dimension in ["2", "3"] {
            let name = format!("{template}-{dimension}d");
            told(folder, &["new", &name, "--template", template, "--dimension", dimension]);
            let file = format!("{name}.toml");
            let case = gluey::Case::load(folder.join(&file)).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!((case.name.as_str(), case.dimension.to_string().as_str()), (&*name, dimension));
            let steps = if dimension == "2" { 2.0 } else { 1.0 };
            let end = format!("time.end={}", steps * case.time.step);
            let report = json(folder, &["run", &file, "--set", &end, "--json"]);
            assert!(report["steps"] == steps as u64 && report["dofs"].as_u64() > Some(1000), "{report}");
        }
    }
}

/// The first case that a newcomer sees.
#[test]
fn the_new_pair_meets_and_parts() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    told(folder, &["new", "doublet"]);
    let text = fs::read_to_string(folder.join("doublet.toml")).expect("a case");
    let columns: Vec<usize> = text.lines().skip(1).take(3).filter_map(|line| line.find('#')).collect();
    assert_eq!(columns, [24, 24], "comments have a column");
    let report = json(folder, &["run", "doublet.toml", "--set", "time.step=0.1", "--json", "--quiet"]);
    let [least, last] = ["min_gap_over_a", "end_gap_over_a"].map(|key| report[key].as_f64().expect("a gap"));
    assert!((0.1..0.5).contains(&least) && last > 3.0, "{report}");
}

/// Particles that are generated are generated by as many threads as were asked for.
#[test]
fn threads_are_those_asked_for_where_particles_are_generated() {
    let folder = TempDir::new().expect("a folder");
    let (folder, case) = (folder.path(), SUSPENSION.replace("end = 10.0", "end = 0.01"));
    fs::write(folder.join("s.toml"), case).expect("a case");
    told(folder, &["run", "s.toml", "--quiet", "--threads", "1"]);
    let run = &json(folder, &["info", "out", "--json"])["runs"][0];
    assert_eq!((&run["record"]["threads"], &run["state"]), (&1.into(), &"complete".into()));
}

#[test]
fn new_cases_replace_nothing() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    told(folder, &["new", "mine.toml"]);
    let text = fs::read_to_string(folder.join("mine.toml")).expect("a case");
    assert!(text.contains("name = \"mine\"") && text.contains("# "), "{text}");
    fs::write(folder.join("mine.toml"), "mine").expect("a file");
    fails(folder, &["new", "mine"], &["mine.toml: there is such a file already", "another name"]);
    assert_eq!(fs::read_to_string(folder.join("mine.toml")).expect("a file"), "mine");
    for name in ["", "a b", "../up", "x.y"] {
        fails(folder, &["new", name], &["cannot be the name of a case", "letters, digits"]);
    }
    for usage in [["new", "x", "--dimension", "4"], ["new", "x", "--template", "moon"]] {
        assert_eq!(gluey(folder, &usage).0, Some(2));
    }
    assert_eq!(fs::read_dir(folder).expect("a folder").count(), 1);
}

/// Without shear nothing moves: the mesh of the report, which is the last, is the first one.
#[test]
fn unknowns_are_those_of_the_first_step() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    for (dimension, template) in [("2", "pair"), ("2", "trio"), ("3", "trio")] {
        let name = format!("{template}-{dimension}");
        told(folder, &["new", &name, "--template", template, "--dimension", dimension]);
        let file = format!("{name}.toml");
        let set = ["--set", "shear_rate=0.0", "--set", "time.end=0.05"];
        let report = json(folder, &[&["run", &file, "--json", "--quiet"], &set[..]].concat());
        let check = json(folder, &[&["check", &file, "--json"], &set[..]].concat());
        assert_eq!(
            (&check["mesh"]["cells"], &check["mesh"]["unknowns"]),
            (&report["cells"], &report["dofs"])
        );
        assert_eq!(check["steps"], report["steps"]);
    }
}

#[test]
fn memory_is_estimated_and_time_found_by_trial() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    for dimension in ["2", "3"] {
        let file = format!("trio-{dimension}.toml");
        told(folder, &["new", &file, "--template", "trio", "--dimension", dimension]);
        let check = json(folder, &["check", &file, "--json", "--quiet"]);
        let number = |check: &Value, key: &str| check.pointer(key).and_then(Value::as_f64).expect("a number");
        let (first, step, run) = ("/trial/first_s", "/trial/step_s", "/trial/run_s");
        let [first, step, run] = [first, step, run].map(|key| number(&check, key));
        assert!(first > 0.0 && step > 0.0 && (run - first - 200.0 * step).abs() < 1e-6 * run, "{check}");
        let estimate = json(folder, &["check", &file, "--no-trial", "--json"]);
        let ratio = number(&estimate, "/memory_bytes") / number(&check, "/memory_bytes");
        assert!(estimate["trial"].is_null() && (0.6..1.6).contains(&ratio), "{ratio}: {check}");
    }
}

#[test]
fn checks_find_what_a_run_would() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let check = told(folder, &["check", CASE]);
    assert!(check.contains("315 steps") && check.contains("time ") && !check.contains("mesh"), "{check}");
    assert!(!told(folder, &["check", CASE, "--no-trial"]).contains("time  "));
    fails(folder, &["check", CASE, "--set", "time.step=-1"], &["--set time.step=-1", "greater than 0"]);
    fails(folder, &["check", "nowhere.toml"], &["nowhere.toml"]);
    told(folder, &["new", "fine"]);
    let fine = [
        "check",
        "fine.toml",
        "--set",
        "flow.mesh.cells_per_radius=9000",
        "--set",
        "flow.mesh.coarsest_level=16",
    ];
    fails(folder, &fine, &["GB of memory", "fewer cells per radius"]);
    assert_eq!(fs::read_dir(folder).expect("a folder").count(), 1, "a check left files");
}
