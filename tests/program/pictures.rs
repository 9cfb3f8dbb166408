//! Pictures of a run: charts of its tables, its particles, its flow.

use std::fs;
use std::io::Read;
use std::path::Path;

use crate::program::{fails, gluey, told};
use assert_cmd::Command;
use flate2::read::ZlibDecoder;
use gluey::output::vtk::{VtkFrame, VtkWriter};
use gluey_contact::Domain;
use gluey_geom::{Particle, Twist, Vector};
use gluey_motion::Fields;
use gluey_pictures::{Rgb, color_scale};
use tempfile::TempDir;

const STEM: &str = "pair-3d-mobility-gluey";
const CASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/cases/pair-3d-mobility.toml");

/// The pixels of a PNG with eight bits of red, green, blue and opacity each (W3C, Portable Network Graphics,
/// third edition).
struct Pixels {
    width: usize,
    rows: Vec<Vec<u8>>,
}

impl Pixels {
    fn read(path: &Path) -> Self {
        let bytes = fs::read(path).expect("a picture");
        let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four")) as usize;
        let (width, height) = (number(16), number(20));
        assert_eq!(bytes[24..29], [8, 6, 0, 0, 0], "eight bits, four channels, not interlaced");
        let (mut at, mut data) = (8, Vec::new());
        while at < bytes.len() {
            let length = number(at);
            if &bytes[at + 4..at + 8] == b"IDAT" {
                data.extend_from_slice(&bytes[at + 8..at + 8 + length]);
            }
            at += length + 12;
        }
        let mut lines = Vec::new();
        ZlibDecoder::new(&data[..]).read_to_end(&mut lines).expect("a stream");
        let mut rows: Vec<Vec<u8>> = vec![vec![0; 4 * width]];
        for line in lines.chunks_exact(4 * width + 1) {
            rows.push(unfiltered(line[0], &line[1..], &rows[rows.len() - 1]));
        }
        rows.remove(0);
        assert_eq!(rows.len(), height);
        Self { width, rows }
    }

    fn at(&self, (x, y): (f64, f64)) -> Rgb {
        let first = 4 * (x as usize).min(self.width - 1);
        std::array::from_fn(|k| self.rows[y as usize][first + k])
    }
}

/// A row without its filter, which predicts bytes from the left, from above, or from both.
fn unfiltered(filter: u8, line: &[u8], above: &[u8]) -> Vec<u8> {
    let mut row = vec![0_u8; line.len()];
    for n in 0..line.len() {
        let before = |row: &[u8]| if n < 4 { 0 } else { row[n - 4] };
        let (left, up, corner) = (before(&row), above[n], before(above));
        let guess = match filter {
            0 => 0,
            1 => left,
            2 => up,
            3 => ((u16::from(left) + u16::from(up)) / 2) as u8,
            _ => {
                let [a, b, c] = [left, up, corner].map(i16::from);
                let guesses = [(left, b - c), (up, a - c), (corner, a + b - 2 * c)];
                guesses.into_iter().min_by_key(|guess| guess.1.abs()).map_or(0, |guess| guess.0)
            }
        };
        row[n] = line[n].wrapping_add(guess);
    }
    row
}

/// A run with frames, in `out`.
fn run_with_frames() -> TempDir {
    let folder = TempDir::new().expect("a folder");
    told(folder.path(), &["run", CASE, "--xyz", "20"]);
    folder
}

#[test]
fn results_are_drawn() {
    let folder = TempDir::new().expect("a folder");
    told(folder.path(), &["run", CASE]);
    let stdout = told(folder.path(), &["plot", "out", "--width", "85"]);
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

/// What a run wrote that was killed, down to half a line, is drawn as far as it goes.
#[test]
fn results_that_are_not_complete_are_drawn() {
    let folder = TempDir::new().expect("a folder");
    told(folder.path(), &["run", CASE]);
    let drawn = || {
        let stdout = told(folder.path(), &["plot", "out", "--format", "svg"]);
        let read = |picture: &str| fs::read_to_string(folder.path().join(picture)).expect("a picture");
        stdout.lines().map(read).collect::<Vec<_>>()
    };
    let complete = drawn();
    assert_eq!(complete.len(), 2);
    let table = folder.path().join(format!("out/{STEM}.csv"));
    let text = fs::read_to_string(&table).expect("a table");
    let draft = |number: u8| table.with_extension(format!("csv.partial-{number}"));
    fs::write(draft(9), &text[..text.len() / 2]).expect("an earlier start");
    fs::write(draft(10), format!("{text}1.6e1,0.5,")).expect("the last start");
    fs::remove_file(&table).expect("a table");
    assert!(drawn() == complete, "other pictures");
}

/// Without a mesh there are no iterations of the flow, and the picture is drawn only if asked for.
#[test]
fn the_cost_of_steps_is_drawn() {
    let folder = TempDir::new().expect("a folder");
    told(folder.path(), &["run", CASE]);
    let stdout = told(folder.path(), &["plot", "out", "--only", "solver", "--format", "svg"]);
    let drawn = |stdout: &str| fs::read_to_string(folder.path().join(stdout.trim())).expect("a picture");
    let svg = drawn(&stdout);
    assert!(svg.contains("seconds per step") && !svg.contains("iterations per step"), "{stdout}");
    let table = folder.path().join(format!("out/{STEM}-solver.csv"));
    let text = fs::read_to_string(&table).expect("a table");
    assert!(text.contains(",0,0,0,0,"), "{text}");
    fs::write(&table, text.replace(",0,0,0,0,", ",64,900,2,7,")).expect("a file");
    let stdout = told(folder.path(), &["plot", "out", "--only", "solver", "--format", "svg"]);
    assert!(drawn(&stdout).contains("iterations per step"), "{stdout}");
}

#[test]
fn particles_of_a_frame_are_drawn() {
    let folder = run_with_frames();
    let stdout = told(folder.path(), &["plot", "out", "--frame", "20", "--format", "svg"]);
    assert_eq!(stdout, format!("out/{STEM}-plots/particles-000020.svg\n"));
    let svg = fs::read_to_string(folder.path().join(stdout.trim())).expect("a picture");
    assert_eq!(svg.matches("<circle").count(), 2);
    assert_eq!(svg.matches("<line").count(), 12, "the edges of the box");
    let stdout = told(folder.path(), &["plot", "out", "--frame", "last", "--only", "gaps"]);
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
    fails(folder.path(), &["plot", "."], &["no trajectory"]);
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
    let stdout = told(folder.path(), &["plot", "out", "--animation", "--pixels", "150", "--rate", "20"]);
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

/// Shear of the boxes whose flows are known.
const SHEAR: f64 = 0.25;
/// Cells along an edge.
const CELLS: usize = 4;

/// A velocity and a pressure in the leaning unit box, at the nodes of quadratic cells.
fn known<const D: usize>(flow: impl Fn(f64) -> (f64, f64)) -> Fields<D> {
    let mut fields = Fields::default();
    let digit = |n: usize, base: usize, d: usize| n / base.pow(d as u32) % base;
    for cell in 0..CELLS.pow(D as u32) {
        for node in 0..3usize.pow(D as u32) {
            let mut x = Vector::<D>::from_fn(|d, _| {
                (digit(cell, CELLS, d) as f64 + 0.5 * digit(node, 3, d) as f64) / CELLS as f64
            });
            x[0] += SHEAR * x[1];
            let (speed, pressure) = flow(x[1]);
            fields.cells.push(fields.points.len() as u32);
            fields.points.push(x);
            fields.velocity.push(Vector::from_fn(|d, _| if d == 0 { speed } else { 0.0 }));
            fields.multiplier.push(Vector::zeros());
            fields.pressure.push(pressure);
            fields.viscosity.push(1.0);
            fields.level_set.push(-1.0);
        }
    }
    fields
}

/// A folder `out` of a run with one frame of a known flow and a particle in the middle.
fn run_with_flow<const D: usize>(radius: f64, flow: impl Fn(f64) -> (f64, f64)) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    let out = folder.path().join("out");
    let mut writer = VtkWriter::create(&out.join("known-none-vtk"), &[]).expect("a folder");
    let particles = vec![Particle::new(Vector::<D>::repeat(0.5), radius)];
    let (twists, contacts, domain) = (vec![Twist::default()], vec![], Domain::default());
    let (in_flow, in_box, fields) = (None, None, Some(known::<D>(flow)));
    let frame =
        VtkFrame { step: 20, time: 0.5, particles, twists, contacts, in_flow, domain, in_box, fields };
    writer.write(&frame).expect("files");
    let center = vec!["0.5"; D].join(", ");
    let case = format!(
        "name = \"known\"\ndimension = {D}\n[domain]\nboundary = \"sheared\"\n[[particles]]\nposition = [{center}]\n\
         radius = {radius}\n[time]\nstep = 0.0125\nend = 1.0\n[contact]\nstrategy = \"none\"\n\
         [flow]\nformulation = \"unfitted\"\n"
    );
    fs::write(out.join("known-none-case.toml"), case).expect("a file");
    folder
}

/// Where a place in a field is in the PNG: left end and width of the field in lengths of the case, 600 SVG
/// pixels less margins of 44 and 12 across, three PNG pixels each.
fn on_picture((left, width): (f64, f64), (x, y): (f64, f64)) -> (f64, f64) {
    let scale = (600.0 - 44.0 - 12.0) / width;
    (3.0 * (44.0 + scale * (x - left)), 3.0 * (12.0 + scale * (1.0 - y)))
}

fn is_near(found: Rgb, expected: Rgb) -> bool {
    found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 3)
}

/// In a leaning box with the velocity `y` along x colours are those of the height, between the arrows, which
/// lie in 19 rows; with `y^2` those of the slope `2 y`, which the elements hold exactly.
#[test]
fn a_known_flow_has_its_colours() {
    let linear = run_with_flow::<2>(0.1, |y| (y, 3.0 - 2.0 * y));
    let quadratic = run_with_flow::<2>(0.1, |y| (y * y, 0.0));
    let picture = |folder: &TempDir, quantity: &str| {
        let stdout = told(folder.path(), &["plot", "out", "--flow", quantity]);
        assert!(
            stdout.starts_with(&format!("out/known-none-plots/flow-{quantity}-000020.svg\n")),
            "{stdout}"
        );
        let svg = stdout.lines().next().expect("a path");
        assert!(fs::metadata(folder.path().join(svg)).expect("a picture").len() < 1_000_000, "{quantity}");
        Pixels::read(&folder.path().join(stdout.lines().last().expect("a path")))
    };
    // Two thousandths at either end have the colour of the end.
    let cut = |part: f64| (part - 0.002) / 0.996;
    // Where a height lies on the scale of colours.
    type Part<'a> = &'a dyn Fn(f64) -> f64;
    let expected: [(&TempDir, &str, Part); 4] = [
        (&linear, "speed", &|y| y),
        (&linear, "pressure", &|y| cut(1.0 - y)),
        (&quadratic, "strain-rate", &cut),
        (&quadratic, "vorticity", &|y| cut(1.0 - y)),
    ];
    for (folder, quantity, part) in expected {
        let pixels = picture(folder, quantity);
        assert_eq!(pixels.width, 1800);
        let at = |x, y| pixels.at(on_picture((0.0, 1.25), (x, y)));
        for row in [2, 5, 9, 14, 17] {
            let y = 1.0 - f64::from(row) / 19.0;
            let (found, wanted) = (at(0.2 + SHEAR * y, y), color_scale(part(y)));
            assert!(is_near(found, wanted), "{quantity} at {y}: {found:?} instead of {wanted:?}");
        }
        assert_eq!(at(0.02, 0.9), [255; 3], "left of the leaning border");
        assert_eq!(at(0.5, 0.5), [217; 3], "the particle");
        assert!(at(0.5, 0.39) != [217; 3], "beside it");
    }
    // One value has one colour, that of the middle.
    let pixels = picture(&linear, "vorticity");
    let found = pixels.at(on_picture((0.0, 1.25), (0.3, 15.0 / 19.0)));
    assert!(is_near(found, color_scale(0.5)), "{found:?}");
}

#[test]
fn slices_cut_boxes_and_spheres_where_they_are() {
    let folder = run_with_flow::<3>(0.2, |y| (y, 0.0));
    let picture = |slice: &str| {
        let arguments =
            ["plot", "out", "--flow", "speed", "--slice", slice, "--format", "png", "--frame", "20"];
        let stdout = told(folder.path(), &arguments);
        assert!(stdout.contains(&format!("flow-speed-{slice}-000020.png")), "{stdout}");
        Pixels::read(&folder.path().join(stdout.trim()))
    };
    // The sphere of radius 0.2 is a circle of 0.16 at a distance of 0.12 from its centre.
    let pixels = picture("z=0.62");
    let at = |x, y| pixels.at(on_picture((0.0, 1.25), (x, y)));
    assert_eq!([at(0.5, 0.5), at(0.5, 0.5 + 0.15), at(0.5, 0.5 - 0.15)], [[217; 3]; 3]);
    assert!([at(0.5, 0.67), at(0.5, 0.33)].iter().all(|color| *color != [217; 3]));
    // Across x the box is upright, also behind the border that leans.
    let pixels = picture("x=0.1");
    for y in [0.2, 0.45, 0.9] {
        let (found, wanted) = (pixels.at(on_picture((0.0, 1.0), (0.3, y))), color_scale(y));
        assert!(is_near(found, wanted), "{found:?} instead of {wanted:?}");
    }
    // Across y all has one speed, the largest.
    let pixels = picture("y=0.25");
    let found = pixels.at(on_picture((0.25 * SHEAR, 1.0), (0.2 + 0.25 * SHEAR, 1.0 - 2.0 / 24.0)));
    assert!(is_near(found, color_scale(1.0)), "{found:?}");
    let outside = ["plot", "out", "--flow", "speed", "--slice", "z=1.5"];
    fails(folder.path(), &outside, &["--slice z=1.5: the box reaches from z = 0 to 1"]);
    fails(folder.path(), &["plot", "out", "--flow", "speed", "--frame", "3"], &["no frame of this step"]);
}

#[test]
fn pictures_of_flows_are_the_same_for_any_number_of_threads() {
    let flows = run_with_flow::<3>(0.2, |y| (y * (1.0 - y), y));
    let particles = run_with_frames();
    told(particles.path(), &["analyse", "out"]);
    let bytes = |folder: &TempDir, arguments: &[&str], threads: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gluey"));
        command.current_dir(folder.path()).env("RAYON_NUM_THREADS", threads).args(arguments);
        let stdout = String::from_utf8(command.output().expect("it runs").stdout).expect("text");
        assert!(!stdout.is_empty(), "{arguments:?}");
        stdout.lines().map(|path| fs::read(folder.path().join(path)).expect("a picture")).collect::<Vec<_>>()
    };
    for (folder, arguments) in [
        (&flows, &["plot", "out", "--flow", "strain-rate"][..]),
        (&particles, &["plot", "out", "--animation", "--pixels", "150", "--view", "60,30"]),
        (&particles, &["plot", "out", "--only", "correlations,diffusion"]),
    ] {
        assert!(bytes(folder, arguments, "1") == bytes(folder, arguments, "2"), "{arguments:?}");
    }
}

#[test]
fn flows_that_are_missing_or_malformed_are_named() {
    let run = run_with_frames();
    fails(run.path(), &["plot", "out", "--flow", "speed"], &["out: no fields of the flow", "--vtk N"]);
    let (code, _, stderr) = gluey(run.path(), &["plot", "out", "--flow", "force"]);
    assert!(code == Some(2) && stderr.contains("expected one of speed, pressure"), "{stderr}");
    let folder = run_with_flow::<2>(0.1, |y| (y, 0.0));
    let out = folder.path().join("out");
    let flow = ["plot", "out", "--flow", "speed", "--format", "svg"];
    fails(folder.path(), &[&flow[..], &["--slice", "z=0.5"]].concat(), &["the case is plane"]);
    told(folder.path(), &["plot", "out/known-none-vtk", "--flow", "speed", "--format", "svg"]);
    let file = out.join("known-none-vtk/fields-000020.vtu");
    let text = fs::read_to_string(&file).expect("a file");
    fs::write(&file, text.replace("\"pressure\"", "\"depth\"")).expect("a file");
    fails(folder.path(), &flow, &["fields-000020.vtu: no array `pressure`"]);
    fs::write(&file, &text[..text.len() / 2]).expect("a file");
    fails(folder.path(), &flow, &["fields-000020.vtu: cannot be read as a VTK file"]);
    fs::write(&file, &text).expect("a file");
    fs::rename(out.join("known-none-case.toml"), out.join("other-case.toml")).expect("renamed");
    fails(folder.path(), &flow, &["known-none-vtk: no <name>-case.toml of its run"]);
}

/// Diffusivities are in the summary, with their intervals, and not in the chart.
#[test]
fn tables_of_the_structure_are_drawn() {
    let folder = run_with_frames();
    let summary = told(folder.path(), &["analyse", "out", "--out", "tables", "--skip", "0"]);
    let stdout = told(folder.path(), &["plot", "tables", "--format", "svg"]);
    let names = ["contacts", "correlations", "profiles", "diffusion"];
    let expected: String = names.map(|name| format!("tables/structure-plots/{name}.svg\n")).concat();
    assert_eq!(stdout, expected);
    let svg = |name: &str| {
        fs::read_to_string(folder.path().join(format!("tables/structure-plots/{name}.svg")))
            .expect("a picture")
    };
    assert!(
        svg("contacts").contains("contacts of a particle") && svg("profiles").contains("volume fraction")
    );
    assert!(svg("correlations").contains("degrees") && !svg("correlations").contains("wave number"));
    // Two spheres have an interval, which a chart has no room for.
    assert_eq!(summary.matches("self-diffusivity").count(), 3, "{summary}");
    assert!(
        summary.lines().filter(|line| line.contains("self-diffusivity")).all(|line| line.contains(" +- "))
    );
    assert!(
        svg("diffusion").contains("summary.txt") && !svg("diffusion").contains(" = "),
        "*D* without its interval"
    );
    fails(folder.path(), &["plot", "out", "--only", "profiles"], &["profile_y.csv: not there", "analyse"]);
}

/// From above both spheres, which are as far in front, lie at the same height on paper.
#[test]
fn spheres_are_seen_from_where_it_is_asked_for() {
    let folder = run_with_frames();
    let drawn = |more: &[&str]| {
        let arguments = [&["plot", "out", "--frame", "20", "--format", "svg"], more].concat();
        let stdout = told(folder.path(), &arguments);
        fs::read_to_string(folder.path().join(stdout.trim())).expect("a picture")
    };
    let heights = |svg: &str| -> Vec<String> {
        let circles = svg.split("<circle ").skip(1);
        circles
            .filter_map(|circle| Some(circle.split("cy=\"").nth(1)?.split('"').next()?.to_owned()))
            .collect()
    };
    let front = heights(&drawn(&["--view", "0,0"]));
    let above = heights(&drawn(&["--view", "0,90"]));
    assert!(front.len() == 2 && front[0] != front[1], "{front:?}");
    assert!(above.len() == 2 && above[0] == above[1], "{above:?}");
    let joined = drawn(&["--contacts", "10", "--colour", "gap"]);
    assert!(
        joined.matches("<line").count() == 13 && joined.contains(">smallest gap / "),
        "12 edges and a pair"
    );
    let (code, _, stderr) = gluey(folder.path(), &["plot", "out", "--frame", "20", "--view", "30"]);
    assert!(code == Some(2) && stderr.contains("two angles in degrees"), "{stderr}");
}
