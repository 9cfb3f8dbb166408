//! What runs whose contacts act in the flow tell of them: pairs, particles, numbers of contacts, pictures.

use std::fs;
use std::path::Path;

use crate::program::{fails, told};
use gluey::output::xyz::{XyzFrame, read_text};
use gluey::table::NumberTable;
use gluey_geom::Vector;
use tempfile::TempDir;

const STEM: &str = "rub-rough-unfitted";
/// Twelve discs, of which some touch from the first step on.
const CASE: &str = "name = \"rub\"\ndimension = 2\ndomain = { boundary = \"sheared\" }\n\
    suspension = { volume_fraction = 0.6, count = 12, seed = 3, min_gap = 0.02 }\n\
    contact = { strategy = \"rough\", roughness = 0.05, friction = 0.5 }\n\
    time = { step = 0.05, end = 0.3 }\n[flow.mesh]\ncells_per_radius = 1.0\n";
const COUNT: usize = 12;

/// A run with frames, in `out`.
fn run() -> TempDir {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("rub.toml"), CASE).expect("a file");
    told(folder.path(), &["run", "rub.toml", "--xyz", "1"]);
    folder
}

fn table(folder: &Path, end: &str) -> NumberTable {
    let text = fs::read_to_string(folder.join(format!("out/{STEM}-{end}.csv"))).expect("a table");
    NumberTable::parse(&text.replace(",particle", ",0").replace(",image", ",0")).expect("numbers")
}

/// Coulomb's law, pair by pair: what sticks does not slip and holds less than the coefficient times the
/// normal force, what slides holds as much, and surfaces are as near as their roughness. What does not touch
/// has no such numbers.
#[test]
fn pairs_have_friction_and_slip() {
    let folder = run();
    let gaps = table(folder.path(), "gaps");
    let [force, friction, slip, slides, roughness, gap] =
        ["contact_force", "friction_force", "slip_speed", "slides", "roughness_over_a", "gap_over_a"]
            .map(|name| gaps.column(name).expect("a column"));
    let mut counts = [0, 0];
    for row in 0..gaps.row_count() {
        if force[row] == 0.0 {
            assert!([friction, slip, slides, roughness].iter().all(|column| column[row].is_nan()));
            continue;
        }
        let most = 0.5 * force[row];
        assert!((roughness[row] - 0.05).abs() < 1e-12 && gap[row] > 0.02);
        match slides[row] {
            1.0 => assert!((friction[row] / most - 1.0).abs() < 1e-8 && slip[row] > 1e-6),
            _ => assert!(friction[row] < most && slip[row] < 1e-6, "{} {most} {}", friction[row], slip[row]),
        }
        counts[slides[row] as usize] += 1;
    }
    assert!(counts.iter().all(|count| *count > 0), "some stick and some slide: {counts:?}");
    let rheology = table(folder.path(), "rheology");
    let sum = |name: &str| rheology.column(name).expect("a column").iter().sum::<f64>() * COUNT as f64 / 2.0;
    let numbers = ["sticking_contacts", "sliding_contacts"].map(|name| sum(name).round() as usize);
    assert_eq!(numbers, counts, "each pair counts for both");
}

/// The forces on all particles add up to nothing, and friction is a part of them: they do not lie along lines
/// of centres.
#[test]
fn frames_have_the_whole_force_of_contacts() {
    let folder = run();
    let path = folder.path().join(format!("out/{STEM}-xyz/particles-000006.xyz"));
    let frame = XyzFrame::<2>::parse(&path, &read_text(&path).expect("text")).expect("a frame");
    let forces = frame.contact_forces.expect("a column");
    let largest = forces.iter().map(|force| force.norm()).fold(0.0, f64::max);
    assert!(largest > 0.1 && forces.iter().sum::<Vector<2>>().norm() < 1e-12 * largest, "{forces:?}");
    let gaps = table(folder.path(), "gaps");
    let [t, i, j, normal, friction] =
        ["t", "i", "j", "contact_force", "friction_force"].map(|name| gaps.column(name).expect("a column"));
    let touches = |row: usize| t[row] == frame.time && normal[row] > 0.0;
    // Particles with one contact have its force.
    let mut alone = 0;
    for (particle, force) in forces.iter().enumerate() {
        let number = (particle + 1) as f64;
        let own: Vec<usize> =
            (0..t.len()).filter(|row| touches(*row) && [i[*row], j[*row]].contains(&number)).collect();
        if let [row] = own[..] {
            alone += 1;
            assert!((force.norm() / normal[row].hypot(friction[row]) - 1.0).abs() < 1e-12);
        }
    }
    assert!(alone > 0, "some have one contact");
}

#[test]
fn means_and_charts_tell_of_contacts() {
    let folder = run();
    let summary = told(folder.path(), &["analyse", "out"]);
    for name in ["share of contacts", "share of friction", "sticking contacts", "sliding contacts"] {
        assert!(summary.contains(name), "{summary}");
    }
    let stdout = told(folder.path(), &["plot", "out", "--only", "rheology", "--format", "svg"]);
    let svg = fs::read_to_string(folder.path().join(stdout.trim())).expect("a picture");
    for label in ["contacts, normal", "friction", "that stick", "that slip"] {
        assert!(svg.contains(label), "no `{label}`");
    }
    assert!(!svg.contains(">repulsion"), "there is none");
}

/// Lines of contacts, solid where they stick and dashed where they slip, in pictures, animations and pages.
#[test]
fn force_chains_are_drawn() {
    let folder = run();
    let gaps = table(folder.path(), "gaps");
    let [t, slides] = ["t", "slides"].map(|name| gaps.column(name).expect("a column"));
    let last = t[t.len() - 1];
    let count = |state: f64| (0..t.len()).filter(|row| t[*row] == last && slides[*row] == state).count();
    let picture = ["plot", "out", "--frame", "last", "--contacts", "force", "--format", "svg"];
    let svg =
        fs::read_to_string(folder.path().join(told(folder.path(), &picture).trim())).expect("a picture");
    let dashed = svg.matches("stroke-dasharray=\"5 2.5\"").count();
    // Those across a border have two lines, and one more is in the legend.
    assert!((count(1.0)..=2 * count(1.0)).contains(&(dashed - 1)), "{dashed} lines of {}", count(1.0));
    assert!(svg.contains(">sticks<") && svg.contains("widest: force"), "a legend");
    told(folder.path(), &["plot", "out", "--animation", "--pixels", "150", "--contacts", "force"]);
    told(folder.path(), &["view", "out"]);
    let page = fs::read_to_string(folder.path().join("out/view.html")).expect("a page");
    let (_, json) = page.split_once("id=\"run\">").expect("data");
    let data: serde_json::Value =
        serde_json::from_str(json.split_once("</script>").expect("an end").0).expect("JSON");
    let frames = data["frames"].as_array().expect("frames");
    let contacts = frames[frames.len() - 1]["contacts"].as_array().expect("contacts");
    assert_eq!(contacts.len(), 7 * (count(0.0) + count(1.0)));
    let page = folder.path().join("out/view.html");
    if let Some(drawn) = crate::viewer::drawn(folder.path(), &page, "frame=6&lines=forces") {
        let lines = format!("data-pairs=\"{}\"", count(0.0) + count(1.0));
        assert!(drawn.contains("data-lines=\"forces\"") && drawn.contains(&lines), "{drawn}");
    }
    fs::remove_file(folder.path().join(format!("out/{STEM}-gaps.csv"))).expect("a table");
    fails(folder.path(), &picture, &["no <name>-gaps.csv with forces of contacts"]);
    let near = fails_of_name(folder.path());
    assert!(near.contains("must be a number from 0 to 10 (mean radii), or force"), "{near}");
}

fn fails_of_name(folder: &Path) -> String {
    let arguments = ["plot", "out", "--frame", "last", "--contacts", "forces"];
    let (code, _, stderr) = crate::program::gluey(folder, &arguments);
    assert_eq!(code, Some(2));
    stderr
}
