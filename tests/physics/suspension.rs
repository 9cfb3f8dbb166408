//! Particles that a case does not list, frames in extended XYZ, and what is made of them.

use std::fs;

use crate::program::gluey;
use gluey::case::Case;
use gluey::output::xyz::{XyzFrame, read_text};
use tempfile::TempDir;

/// A case around the table or key that says where its particles come from.
fn case(dimension: usize, boundary: &str, particles: &str) -> String {
    format!(
        "name = \"s\"\ndimension = {dimension}\n{particles}\n[domain]\nboundary = \"{boundary}\"\n[time]\n\
         step = 0.05\nend = 0.2\n[flow]\nformulation = \"unfitted\"\n[flow.mesh]\ncells_per_radius = 1.6\nroot_cells = 1\n"
    )
}

fn generated(keys: &str) -> String {
    // A table behind the root's keys.
    format!("suspension = {{ {keys} }}")
}

#[test]
fn generated_particles_fill_the_box_and_are_echoed() {
    for (dimension, boundary, keys) in [
        (2, "couette", "volume_fraction = 0.3, count = 20"),
        (2, "periodic", "volume_fraction = 0.5, radius = 0.05, arrangement = \"random\", seed = 7"),
        (2, "periodic", "volume_fraction = 0.3, count = 9, arrangement = \"square\", jitter = 1.0"),
        (3, "periodic", "count = 20, radius = 0.1, radii = { kind = \"lognormal\", deviation = 0.1 }"),
        (3, "couette", "volume_fraction = 0.1, count = 27, arrangement = \"simple-cubic\""),
        (3, "periodic", "volume_fraction = 0.2, count = 30, radii = { kind = \"bidisperse\", ratio = 1.4 }"),
    ] {
        let case = Case::parse(&case(dimension, boundary, &generated(keys)), "s.toml").expect(keys);
        assert!(case.suspension.is_none() && !case.particles.is_empty());
        // What is written down is the same case, but for the seed: its particles are listed.
        let echo = toml::to_string(&case).expect("text");
        let listed = Case::parse(&echo, "echo.toml").expect("a good case");
        assert_eq!(case.seed, Some(if keys.contains("seed = 7") { 7 } else { 1 }));
        assert_eq!(listed, Case { seed: None, ..case });
    }
}

#[test]
fn particles_are_read_from_a_file_beside_the_case() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("s.toml");
    fs::write(&path, case(2, "couette", "particles_file = \"discs.csv\"")).expect("a file");
    fs::write(folder.path().join("discs.csv"), "x,y,radius\n0.3,0.4,0.05\n0.7,0.6,0.06\n").expect("a file");
    let case = Case::load(&path).expect("a good case");
    assert_eq!(case.particles.len(), 2);
    assert_eq!((case.particles[1].position[1], case.particles[1].radius), (0.6, 0.06));
    // A program that made the case fills it itself.
    let mut made = Case { particles: Vec::new(), particles_file: Some("discs.csv".into()), ..case.clone() };
    assert!(made.check().is_err());
    made.fill_particles(folder.path()).expect("the file");
    assert_eq!(made, case);
}

#[test]
fn what_cannot_be_made_is_refused_with_its_key() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("bad.csv"), "x,y,radius\n0.3,0.4,0.05\n0.7,six,0.06\n").expect("a file");
    let refused = |particles: &str, expected: &[&str]| {
        let path = folder.path().join("s.toml");
        fs::write(&path, case(2, "periodic", particles)).expect("a file");
        let (code, _, stderr) = gluey(folder.path(), &["run", "s.toml"]);
        // Messages are broken into lines.
        let message = stderr.replace("\n  │ ", " ");
        assert_eq!(code, Some(1), "{stderr}");
        for part in expected {
            assert!(message.contains(part), "`{part}` is not in:\n{stderr}");
        }
    };
    let list = "particles = [{ position = [0.5, 0.5], radius = 0.1 }]\n";
    refused("", &["missing key `particles`"]);
    refused(&(list.to_owned() + &generated("count = 5")), &["s.toml:4:", "[[particles]] and from"]);
    refused(&generated("count = 5"), &["s.toml:3:", "1 of `volume_fraction`, `count` and `radius`"]);
    refused(
        &generated("volume_fraction = 0.9, count = 50"),
        &["suspension.volume_fraction = 0.9", "too high"],
    );
    refused(&generated("volume_fraction = 0.5, count = 1"), &["suspension.count = 1", "is too large"]);
    refused(
        &generated("volume_fraction = 0.3, count = 8, arrangement = \"square\""),
        &["suspension.count = 8", "4 or 9 do"],
    );
    refused(
        &generated("volume_fraction = 0.3, count = 8, arrangement = \"fcc\""),
        &["suspension.arrangement", "not one in 2D", "hexagonal"],
    );
    refused(&generated("count = 9, raduis = 0.1"), &["did you mean `radius`?"]);
    refused(
        &generated("count = 9, radius = 0.1, radii = { kind = \"lognormal\" }"),
        &["suspension.radii.deviation", "is missing"],
    );
    refused(
        &generated("count = 9, radius = 0.1, radii = { ratio = 2.0 }"),
        &["suspension.radii.ratio = 2.0", "has no meaning", "leave out"],
    );
    refused("particles_file = \"none.csv\"", &["particles_file", "none.csv: cannot be read"]);
    refused("particles_file = \"bad.csv\"", &["bad.csv:3: found `six`", "expected a finite number"]);
}

#[test]
fn frames_are_written_and_analysed() {
    let folder = TempDir::new().expect("a folder");
    let keys = "volume_fraction = 0.3, count = 12, min_gap = 0.1";
    fs::write(folder.path().join("s.toml"), case(2, "periodic", &generated(keys))).expect("a file");
    let (code, _, stderr) = gluey(folder.path(), &["run", "s.toml", "--xyz", "1", "--xyz-gzip"]);
    assert_eq!(code, Some(0), "{stderr}");
    let frames = folder.path().join("out/s-gluey-unfitted-xyz");
    let last = frames.join("particles-000004.xyz.gz");
    let last = XyzFrame::<2>::parse(&last, &read_text(&last).expect("text")).expect("a frame");
    assert!((last.time - 0.2).abs() < 1e-12 && (last.strain - 0.2).abs() < 1e-12);
    assert!(!last.container.is_walled(0) && last.container.is_walled(1));
    let (code, stdout, stderr) = gluey(folder.path(), &["analyse", "out", "--skip", "1"]);
    assert_eq!(code, Some(0), "{stderr}");
    assert!(
        stdout.contains("12 particles at the fraction 0.3000") && stdout.contains("median gap / a"),
        "{stdout}"
    );
    for (table, rows) in [
        ("series.csv", 5),
        ("g_of_theta.csv", 36),
        ("g_of_r.csv", 1),
        ("profile_y.csv", 1),
        ("diffusion.csv", 2),
        ("structure_factor.csv", 1),
    ] {
        let text = fs::read_to_string(folder.path().join("out").join(table)).expect(table);
        let width = text.lines().next().expect("a header").split(',').count();
        assert!(text.lines().all(|line| line.split(',').count() == width), "{table}");
        assert!(text.lines().count() > rows, "{table}");
    }
    let summary = fs::read_to_string(folder.path().join("out/summary.txt")).expect("a summary");
    assert_eq!(summary, stdout);
}

#[test]
fn runs_without_frames_cannot_be_analysed() {
    let folder = TempDir::new().expect("a folder");
    fs::create_dir_all(folder.path().join("a-xyz")).expect("a folder");
    let analyse = || gluey(folder.path(), &["analyse", "."]);
    let (code, _, stderr) = analyse();
    assert!(code == Some(1) && stderr.contains("no particles in extended XYZ"), "{stderr}");
    fs::write(folder.path().join("a-xyz/particles-000000.xyz"), "1\nDimension=2\n").expect("a file");
    let (code, _, stderr) = analyse();
    assert!(code == Some(1) && stderr.contains("particles-000000.xyz:2"), "{stderr}");
    fs::create_dir_all(folder.path().join("b-xyz")).expect("a folder");
    assert!(analyse().2.contains("several runs"));
    let (code, _, stderr) = gluey(folder.path(), &["analyse", "nowhere"]);
    assert!(code == Some(1) && stderr.contains("nowhere: cannot be listed"), "{stderr}");
}
