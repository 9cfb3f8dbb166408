//! Pictures of a run: charts of its tables, the page for the browser.

use std::fs;
use std::path::Path;
use std::process;

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

const STEM: &str = "pair-3d-mobility-gluey";
const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");

/// Exit code, output and error output of the command.
fn gluey(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
    let output = command.current_dir(folder).args(arguments).output().expect("it runs");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let (code, stdout, stderr) = gluey(folder, arguments);
    assert_eq!(code, Some(0), "{stderr}");
    stdout
}

fn fails(folder: &Path, arguments: &[&str], expected: &[&str]) {
    let (code, _, stderr) = gluey(folder, arguments);
    assert_eq!(code, Some(1), "{stderr}");
    for part in expected {
        assert!(stderr.contains(part), "`{part}` is not in:\n{stderr}");
    }
}

/// A run with frames, in `out`.
fn run_with_frames() -> TempDir {
    let folder = TempDir::new().expect("a folder");
    succeeds(folder.path(), &["run", CASE, "--xyz", "20"]);
    folder
}

/// The frames that a page holds.
fn data(page: &str) -> Value {
    let (_, behind) = page.split_once("<script type=\"application/json\" id=\"run\">").expect("data");
    let (json, _) = behind.split_once("</script>").expect("an end");
    serde_json::from_str(json).expect("JSON")
}

#[test]
fn a_page_shows_the_frames_of_a_run_without_a_network() {
    let folder = run_with_frames();
    let stdout = succeeds(folder.path(), &["view", "out"]);
    assert!(stdout.contains("view.html: ") && stdout.contains(" frames of 2 particles"), "{stdout}");
    let page = fs::read_to_string(folder.path().join("out/view.html")).expect("a page");
    let data = data(&page);
    let frames = fs::read_dir(folder.path().join(format!("out/{STEM}-xyz"))).expect("frames").count();
    let shown = data["frames"].as_array().expect("frames");
    assert_eq!(shown.len(), frames);
    assert_eq!((data["dimension"].as_u64(), data["title"].as_str()), (Some(3), Some(STEM)));
    for numbers in ["positions", "velocities", "spins"] {
        assert!(shown.iter().all(|frame| frame[numbers].as_array().is_some_and(|all| all.len() == 6)));
    }
    assert_eq!(shown[0]["positions"][0].as_f64().map(|x| x as f32), Some(0.3));
    for outside in ["http:", "https:", " src=", "<link", "import ", "{{"] {
        assert!(!page.contains(outside), "`{outside}` in the page");
    }
    succeeds(folder.path(), &["view", "out", "--every", "2", "--out", "pages/two.html"]);
    let half = fs::read_to_string(folder.path().join("pages/two.html")).expect("a page");
    assert_eq!(self::data(&half)["frames"].as_array().map(Vec::len), Some(frames.div_ceil(2)));
}

#[test]
fn a_browser_draws_all_particles() {
    let found = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| process::Command::new(name).arg("--version").output().is_ok());
    let Some(browser) = found else {
        eprintln!("skipped: no Chromium to draw the page with");
        return;
    };
    let folder = run_with_frames();
    succeeds(folder.path(), &["view", "out"]);
    let page = folder.path().join("out/view.html");
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]);
    command.args(["--disable-background-networking", "--disable-component-update", "--disable-sync"]);
    command.arg(format!("--user-data-dir={}", folder.path().join("profile").display()));
    command.arg("--dump-dom").arg(format!("file://{}#frame=3&colour=gap", page.display()));
    let output = command.output().expect("it runs");
    let drawn = String::from_utf8(output.stdout).expect("text");
    assert!(drawn.contains("data-balls=\"2\"") && drawn.contains("data-frame=\"3\""), "{drawn}");
    assert!(drawn.contains("<span id=\"fault\" role=\"alert\"></span>"), "a fault in:\n{drawn}");
}

#[test]
fn runs_without_frames_cannot_be_shown() {
    let folder = TempDir::new().expect("a folder");
    fails(folder.path(), &["view", "nowhere"], &["nowhere: cannot be listed"]);
    fs::create_dir(folder.path().join("out")).expect("a folder");
    fails(folder.path(), &["view", "out"], &["out: no particles in extended XYZ", "--xyz N"]);
    fs::create_dir(folder.path().join("out/a-xyz")).expect("a folder");
    fs::write(folder.path().join("out/a-xyz/particles-000000.xyz"), "1\nDimension=2\n").expect("a file");
    fails(folder.path(), &["view", "out"], &["particles-000000.xyz:2"]);
    assert!(!folder.path().join("out/view.html").exists(), "a page of nothing");
}

#[test]
fn results_are_drawn() {
    let folder = TempDir::new().expect("a folder");
    succeeds(folder.path(), &["run", CASE]);
    let stdout = succeeds(folder.path(), &["plot", "out", "--width", "85"]);
    assert_eq!(stdout.lines().count(), 4, "{stdout}");
    let svg = |name: &str| {
        fs::read_to_string(folder.path().join(format!("out/{STEM}-plots/{name}.svg"))).expect("a picture")
    };
    let gaps = svg("gaps");
    assert!(gaps.contains("width=\"85.0mm\"") && gaps.contains("1 and 2"), "{}", &gaps[..300]);
    // One line through all of the contact, whose gaps are 0 but for rounding.
    assert_eq!(gaps.matches("stroke=\"#0b4f9e\"").count(), 2, "the curve and its sample");
    assert!(svg("trajectories").contains("particle 2"));
    let png = fs::read(folder.path().join(format!("out/{STEM}-plots/gaps.png"))).expect("a picture");
    assert!(png.starts_with(b"\x89PNG") && png[16..20] == 1275u32.to_be_bytes());
}

/// Without a mesh there are no iterations of the flow, and the picture is drawn only if asked for.
#[test]
fn the_cost_of_steps_is_drawn() {
    let folder = TempDir::new().expect("a folder");
    succeeds(folder.path(), &["run", CASE]);
    let stdout = succeeds(folder.path(), &["plot", "out", "--only", "solver", "--format", "svg"]);
    let drawn = |stdout: &str| fs::read_to_string(folder.path().join(stdout.trim())).expect("a picture");
    let svg = drawn(&stdout);
    assert!(svg.contains("seconds per step") && !svg.contains("iterations per step"), "{stdout}");
    let table = folder.path().join(format!("out/{STEM}-solver.csv"));
    let text = fs::read_to_string(&table).expect("a table");
    assert!(text.contains(",0,0,0,0,"), "{text}");
    fs::write(&table, text.replace(",0,0,0,0,", ",64,900,2,7,")).expect("a file");
    let stdout = succeeds(folder.path(), &["plot", "out", "--only", "solver", "--format", "svg"]);
    assert!(drawn(&stdout).contains("iterations per step"), "{stdout}");
}

#[test]
fn particles_of_a_frame_are_drawn() {
    let folder = run_with_frames();
    let stdout = succeeds(folder.path(), &["plot", "out", "--frame", "20", "--format", "svg"]);
    assert_eq!(stdout, format!("out/{STEM}-plots/particles-000020.svg\n"));
    let svg = fs::read_to_string(folder.path().join(stdout.trim())).expect("a picture");
    assert_eq!(svg.matches("<circle").count(), 2);
    assert_eq!(svg.matches("<line").count(), 12, "the edges of the box");
    let stdout = succeeds(folder.path(), &["plot", "out", "--frame", "last", "--only", "gaps"]);
    assert_eq!(stdout.lines().count(), 4, "{stdout}");
    fails(folder.path(), &["plot", "out", "--frame", "21"], &["no frame of this step", "0, 20, ..."]);
    fs::remove_dir_all(folder.path().join(format!("out/{STEM}-xyz"))).expect("a folder");
    fails(folder.path(), &["plot", "out", "--frame", "last"], &["run with --xyz N"]);
}

#[test]
fn results_that_are_missing_or_malformed_are_named() {
    let folder = TempDir::new().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
    fails(folder.path(), &["plot", "nowhere"], &["nowhere: cannot be listed"]);
    fs::write(folder.path().join("other.csv"), b"\xff\xfe, not ours").expect("a file");
    fails(folder.path(), &["plot", "."], &["no complete trajectory"]);
    write("a.csv", "t,x1,y1,min_gap_over_a\n0,0.5,0.5,0.1\n1,0.5,half,0.1\n");
    fails(folder.path(), &["plot", "."], &["a.csv: line 3: expected 4 numbers"]);
    write("a.csv", "t,x1,y1,min_gap_over_a\n0,0.5,0.5,0.1\n");
    fails(folder.path(), &["plot", "."], &["a.csv: 1 rows", "at least 2"]);
    write("a.csv", "t,x1,y1,min_gap_over_a\n0,0.5,0.5,0.1\n1,0.6,0.5,0.1\n");
    fails(folder.path(), &["plot", ".", "--only", "rheology"], &["a-rheology.csv: not there", "sheared"]);
    fails(folder.path(), &["plot", ".", "--only", "solver"], &["a-solver.csv: not there"]);
    write("a-rheology.csv", "t,strain,viscosity\n0,0,2\n1,1,2\n");
    fails(folder.path(), &["plot", "."], &["a-rheology.csv: column `viscosity_by_dissipation` is missing"]);
    write("a-gaps.csv", "t,i,j,gap_over_a,partner\n0,1,2,0.5,ghost\n");
    fails(folder.path(), &["plot", ".", "--only", "gaps"], &["a-gaps.csv: line 2: expected 5 numbers"]);
    let (code, _, stderr) = gluey(folder.path(), &["plot", ".", "--only", "speed"]);
    assert!(
        code == Some(2) && stderr.contains("expected one of gaps, trajectories, rheology, solver"),
        "{stderr}"
    );
}

#[test]
fn frames_become_an_animation() {
    let folder = run_with_frames();
    let stdout = succeeds(folder.path(), &["plot", "out", "--animation", "--pixels", "150", "--rate", "20"]);
    assert_eq!(stdout.trim(), format!("out/{STEM}-plots/particles.gif"));
    let file = fs::File::open(folder.path().join(stdout.trim())).expect("an animation");
    let mut decoder = gif::DecodeOptions::new().read_info(file).expect("a header");
    assert_eq!(decoder.width(), 150);
    let mut count = 0;
    while let Some(frame) = decoder.read_next_frame().expect("a frame") {
        assert_eq!((frame.delay, frame.width), (5, 150));
        count += 1;
    }
    let frames = fs::read_dir(folder.path().join(format!("out/{STEM}-xyz"))).expect("frames").count();
    assert_eq!(count, frames);
}
