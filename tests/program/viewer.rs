//! The page that shows a run in a browser, and the forces of contacts in its frames.

use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use crate::program::{fails, told};
use assert_cmd::Command;
use gluey::output::xyz::{XyzFrame, read_text};
use serde_json::Value;
use tempfile::TempDir;

const STEM: &str = "pair-3d-mobility-gluey";
const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");

/// A run with frames, in `out`.
fn run_with_frames() -> TempDir {
    let folder = TempDir::new().expect("a folder");
    told(folder.path(), &["run", CASE, "--xyz", "20"]);
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
    let stdout = told(folder.path(), &["view", "out"]);
    assert!(stdout.contains("view.html: ") && stdout.contains(" frames of 2 particles"), "{stdout}");
    let page = fs::read_to_string(folder.path().join("out/view.html")).expect("a page");
    let data = data(&page);
    let frames = fs::read_dir(folder.path().join(format!("out/{STEM}-xyz"))).expect("frames").count();
    let shown = data["frames"].as_array().expect("frames");
    assert_eq!(shown.len(), frames);
    assert_eq!((data["dimension"].as_u64(), data["title"].as_str()), (Some(3), Some(STEM)));
    for numbers in ["positions", "velocities", "spins", "forces"] {
        assert!(shown.iter().all(|frame| frame[numbers].as_array().is_some_and(|all| all.len() == 6)));
    }
    assert_eq!(shown[0]["positions"][0].as_f64().map(|x| x as f32), Some(0.3));
    for outside in ["http:", "https:", " src=", "<link", "import ", "{{"] {
        assert!(!page.contains(outside), "`{outside}` in the page");
    }
    told(folder.path(), &["view", "out", "--every", "2", "--out", "pages/two.html"]);
    let half = fs::read_to_string(folder.path().join("pages/two.html")).expect("a page");
    assert_eq!(self::data(&half)["frames"].as_array().map(Vec::len), Some(frames.div_ceil(2)));
}

/// What a browser makes of a page, opened with what stands behind `#`; nothing where there is no browser.
/// Nothing may stand on its console.
pub fn drawn(folder: &Path, page: &Path, fragment: &str) -> Option<String> {
    let found = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| process::Command::new(name).arg("--version").output().is_ok());
    let Some(browser) = found else {
        eprintln!("skipped: no Chromium to draw the page with");
        return None;
    };
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]);
    command.args(["--disable-background-networking", "--disable-component-update", "--disable-sync"]);
    command.args(["--enable-logging=stderr"]);
    command.arg(format!("--user-data-dir={}", folder.join("profile").display()));
    command.arg("--dump-dom").arg(format!("file://{}#{fragment}", page.display()));
    let output = command.output().expect("it runs");
    let console = String::from_utf8_lossy(&output.stderr);
    let said: Vec<&str> = console.lines().filter(|line| line.contains(":CONSOLE")).collect();
    assert!(said.is_empty(), "on the console: {said:?}");
    let drawn = String::from_utf8(output.stdout).expect("text");
    assert!(drawn.contains("<span id=\"fault\" role=\"alert\"></span>"), "a fault in:\n{drawn}");
    Some(drawn)
}

#[test]
fn a_browser_draws_all_particles() {
    let folder = run_with_frames();
    told(folder.path(), &["view", "out"]);
    let page = folder.path().join("out/view.html");
    for colour in ["speed", "spin", "gap", "contact-force", "id"] {
        let Some(drawn) = drawn(folder.path(), &page, &format!("frame=3&colour={colour}")) else { return };
        assert!(drawn.contains("data-balls=\"2\"") && drawn.contains("data-frame=\"3\""), "{drawn}");
        assert!(drawn.contains(&format!("data-colour=\"{colour}\"")), "{drawn}");
        assert!(drawn.contains(">contact force</option>"), "{drawn}");
    }
    // What the console would say is heard.
    let broken = folder.path().join("broken.html");
    fs::write(&broken, "<span id=\"fault\" role=\"alert\"></span><script>console.error('heard')</script>")
        .expect("a file");
    let heard = std::panic::catch_unwind(|| drawn(folder.path(), &broken, ""));
    assert!(heard.is_err(), "errors on the console go unheard");
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

/// The frame of a step.
fn frame(folder: &Path, stem: &str, step: usize) -> (PathBuf, XyzFrame<3>) {
    let path = folder.join(format!("out/{stem}-xyz/particles-{step:06}.xyz"));
    let frame = XyzFrame::parse(&path, &read_text(&path).expect("text")).expect("a frame");
    (path, frame)
}

/// Two spheres push each other apart, along the line of their centres, while they touch, and not before.
#[test]
fn frames_have_the_forces_of_contacts() {
    let folder = run_with_frames();
    let mut touching = 0;
    for step in (0..=240).step_by(20) {
        let (path, frame) = frame(folder.path(), STEM, step);
        let forces = frame.contact_forces.expect("a column");
        let arm = frame.positions[1] - frame.positions[0];
        let gap = arm.norm() - frame.radii[0] - frame.radii[1];
        if forces[0].norm() > 0.0 {
            touching += 1;
            assert!(
                (forces[0] + forces[1]).norm() < 1e-12 * forces[0].norm(),
                "{}: {forces:?}",
                path.display()
            );
            assert!(forces[0].cross(&arm).norm() < 1e-9 * forces[0].norm() * arm.norm(), "{forces:?}");
            // They touch at the end of the step that begins here.
            assert!(gap < 0.1 * frame.radii[0], "{gap}");
        }
    }
    assert!(touching > 0, "they touch");
    let picture = ["plot", "out", "--frame", "0", "--colour", "contact-force", "--format", "svg"];
    let stdout = told(folder.path(), &picture);
    let svg = fs::read_to_string(folder.path().join(stdout.trim())).expect("a picture");
    assert!(svg.contains(">contact force / 6"), "{svg}");
}

/// Nothing is drawn where there is no contact model.
#[test]
fn frames_without_a_contact_model_say_so() {
    let folder = TempDir::new().expect("a folder");
    told(folder.path(), &["run", CASE, "--strategy", "none", "--xyz", "20"]);
    let (_, frame) = frame(folder.path(), "pair-3d-mobility-none", 20);
    assert_eq!(frame.contact_forces, None);
    let expected = ["particles-000020.xyz: no column `contact_force`", "strategy = \"none\""];
    fails(folder.path(), &["plot", "out", "--frame", "20", "--colour", "contact-force"], &expected);
    let expected = ["particles-000000.xyz: no column `contact_force`"];
    fails(folder.path(), &["plot", "out", "--animation", "--colour", "contact-force"], &expected);
    told(folder.path(), &["view", "out"]);
    let page = folder.path().join("out/view.html");
    let data = data(&fs::read_to_string(&page).expect("a page"));
    assert_eq!(data["frames"][0]["forces"].as_array().map(Vec::len), Some(0));
    let Some(drawn) = drawn(folder.path(), &page, "colour=contact-force") else { return };
    assert!(drawn.contains("contact force (none in the frames)</option>"), "{drawn}");
    assert!(drawn.contains("data-colour=\"speed\""), "another colour instead: {drawn}");
}
