//! The command refuses every kind of bad input, and says where it is and what would be right.

use std::fs;

use crate::program::{fails, gluey};
use tempfile::TempDir;

/// A good case, one key a line: the tests break one line each.
const GOOD: &str = r#"name = "pair"
dimension = 3
shear_rate = 1.0
[domain]
upper = [1.0, 1.0, 1.0]
boundary = "couette"
[[particles]]
position = [0.3, 0.525, 0.5]
radius = 0.05
[[particles]]
position = [0.7, 0.475, 0.5]
radius = 0.05
[time]
step = 0.05
end = 0.2
scheme = "euler"
[contact]
strategy = "gluey"
exact_gap = true
[flow]
hydrodynamics = "pair-mobility"
formulation = "paper"
tolerance = 1e-8
[flow.mesh]
cells_per_radius = 6.4
coarsest_level = 3
[flow.paper]
rho = 1.0
uzawa_steps = 1
"#;

/// Runs `text` and demands that it is refused with all of `expected` in the message, and nothing written.
fn refused(text: &str, expected: &[&str]) {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("case.toml"), text).expect("a file");
    fails(folder.path(), &["run", "case.toml"], expected);
    assert!(!folder.path().join("out").exists(), "output was written");
}

/// Replaces the `nth` line (from 1) of the good case.
fn with_line(nth: usize, line: &str) -> String {
    let mut lines: Vec<&str> = GOOD.lines().collect();
    lines[nth - 1] = line;
    lines.join("\n") + "\n"
}

/// The good case with its `nth` line replaced is refused, and that line named.
fn refused_line(nth: usize, line: &str, expected: &[&str]) {
    let place = format!("case.toml:{nth}:");
    refused(&with_line(nth, line), &[&[place.as_str()], expected].concat());
}

#[test]
fn the_good_case_runs() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("case.toml"), GOOD).expect("a file");
    let (code, _, stderr) = gluey(folder.path(), &["run", "case.toml"]);
    assert_eq!(code, Some(0), "{stderr}");
    let csv = fs::read_to_string(folder.path().join("out/pair-gluey.csv")).expect("a trajectory");
    assert_eq!(csv.lines().count(), 1 + 5);
}

#[test]
fn missing_keys() {
    // The line named is that of the table in which the key should stand.
    let without = |nth: usize| with_line(nth, "");
    refused(&without(14), &["case.toml:13:", "time.step", "missing key `step`", "step = 0.025"]);
    refused(&without(12), &["case.toml:10:", "particles[1].radius", "missing key `radius`", "radius = 0.05"]);
    refused(&without(1), &["case.toml:1:", "name: missing key `name`", "name = \"my-case\""]);
    let empty = "name = \"x\"\ndimension = 2\ntime = { step = 0.1, end = 1.0 }\n";
    refused(empty, &["case.toml:1:", "missing key `particles`", "[[particles]]"]);
}

#[test]
fn unknown_keys() {
    refused_line(
        9,
        "raduis = 0.05",
        &["particles[0].raduis", "unknown key `raduis`", "did you mean `radius`?"],
    );
    refused_line(16, "wombat = 1", &["time.wombat", "unknown key `wombat`", "`step`, `end`, `scheme`"]);
    refused_line(26, "coarse_level = 3", &["flow.mesh.coarse_level", "did you mean `coarsest_level`?"]);
    refused_line(24, "[flow.mash]", &["flow.mash", "unknown key `mash`", "did you mean `mesh`?"]);
}

#[test]
fn wrong_types() {
    refused_line(
        14,
        "step = \"fast\"",
        &["time.step = \"fast\"", "wrong type: found a text", "expected a number"],
    );
    refused_line(9, "radius = [0.05]", &["particles[0].radius", "wrong type", "expected a number"]);
    refused_line(8, "position = 0.3", &["particles[0].position = 0.3", "expected a list like [1.0, 2.0]"]);
    refused_line(8, "position = [0.3, \"a\", 0.5]", &["particles[0].position[1]", "expected a number"]);
    refused_line(19, "exact_gap = 1", &["contact.exact_gap = 1", "expected true or false"]);
    refused_line(2, "dimension = 3.0", &["dimension = 3.0", "wrong type", "expected a whole number"]);
    refused_line(2, "dimension = -3", &["dimension = -3", "equal to 2 or 3"]);
    refused_line(29, "uzawa_steps = 1.5", &["flow.paper.uzawa_steps = 1.5", "expected a whole number"]);
    refused_line(18, "strategy = 3", &["contact.strategy = 3", "wrong type", "expected a name in quotes"]);
}

#[test]
fn text_that_is_not_toml() {
    refused_line(14, "step = = 0.05", &["not valid TOML"]);
    refused(&with_line(14, "step = 0.05\nstep = 0.05"), &["case.toml:15:", "duplicate key"]);
}

#[test]
fn files_that_cannot_be_read() {
    let folder = TempDir::new().expect("a folder");
    let (code, _, stderr) = gluey(folder.path(), &["run", "nowhere.toml"]);
    assert_eq!(code, Some(1));
    assert!(stderr.contains("nowhere.toml: cannot be read"), "{stderr}");
    assert!(stderr.contains("`gluey new NAME` writes one"), "{stderr}");
    fs::write(folder.path().join("case.toml"), GOOD).expect("a file");
    fs::create_dir(folder.path().join("out")).expect("a folder");
    for (arguments, expected) in [
        (["run", "case"], "did you mean case.toml?"),
        (["check", "out"], "to go on with a run: gluey resume out"),
        (["plot", "case.toml"], "give the folder that a run wrote to"),
        (["view", "elsewhere"], "give the folder that a run wrote to"),
        (["analyse", "elsewhere"], "give the folder that a run wrote to"),
    ] {
        let (code, _, stderr) = gluey(folder.path(), &arguments);
        assert_eq!(code, Some(1));
        assert!(stderr.contains(expected), "{stderr}");
    }
    fs::write(folder.path().join("binary.toml"), [0xff, 0xfe, 0x00]).expect("a file");
    let (code, _, stderr) = gluey(folder.path(), &["run", "binary.toml"]);
    assert_eq!(code, Some(1));
    assert!(stderr.contains("binary.toml: cannot be read") && stderr.contains("UTF-8"), "{stderr}");
}

/// Spreadsheets begin texts with a byte order mark; what one does not see elsewhere is told.
#[test]
fn byte_order_marks_are_read() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let case =
        "name = \"sheet\"\ndimension = 2\nparticles_file = \"discs.csv\"\ntime = { step = 0.1, end = 0.1 }\n";
    let list = "x,y,radius\r\n0.3,0.4,0.05\r\n0.7,0.45,0.06\r\n";
    let info = |case: &str, list: &str| {
        fs::write(folder.join("sheet.toml"), case).expect("a file");
        fs::write(folder.join("discs.csv"), list).expect("a file");
        gluey(folder, &["info", "sheet.toml"])
    };
    let (code, plain, stderr) = info(case, list);
    assert_eq!(code, Some(0), "{stderr}");
    assert_eq!(info(&format!("\u{feff}{case}"), &format!("\u{feff}{list}")).1, plain);
    let (code, _, stderr) = info(case, &list.replace("0.45", "\u{200b}0.45\u{a0}"));
    assert!(code == Some(1) && stderr.contains("discs.csv:3: found `U+200B0.45`"), "{stderr}");
    let (code, _, stderr) = info(case, &format!("\u{feff}\u{feff}{list}"));
    assert!(code == Some(1) && stderr.contains("discs.csv:1: found `U+FEFFx,y,radius`"), "{stderr}");
}

/// Frames that are no text, and those with what one does not see in them.
#[test]
fn frames_that_are_no_text() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    let frame = "1\nLattice=\"1 0 0 0 1 0 0 0 1\" Origin=\"0 0 0\" pbc=\"F F F\" Properties=\
                 species:S:1:pos:R:3:radius:R:1:velo:R:3:angular_velocity:R:3 Time=0 Strain=0 Dimension=2\n\
                 P 0.5 0.5 0 0.1 0 0 0 0 0 0\n";
    fs::create_dir(folder.join("frames")).expect("a folder");
    let view = |bytes: &[u8]| {
        fs::write(folder.join("frames/particles-000000.xyz"), bytes).expect("a file");
        gluey(folder, &["view", "frames"])
    };
    assert_eq!(view(frame.as_bytes()).0, Some(0));
    assert_eq!(view(format!("\u{feff}{frame}").as_bytes()).0, Some(0));
    let utf16: Vec<u8> = frame.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, expected) in [
        (utf16, "looks like UTF-16"),
        (
            frame.replace("P ", "\u{e9} ").encode_utf16().map(|unit| unit as u8).collect(),
            "at line 3, column 1, byte E9",
        ),
        (frame.replace("0.1 ", "0.1\u{200b} ").into_bytes(), "particles-000000.xyz:3: found `0.1U+200B`"),
    ] {
        let (code, _, stderr) = view(&bytes);
        assert!(code == Some(1) && stderr.contains(expected), "{stderr}");
        assert!(stderr.contains("save it as UTF-8") || expected.contains("found"), "{stderr}");
    }
}

#[test]
fn dimensions_other_than_2_and_3() {
    refused_line(2, "dimension = 4", &["dimension = 4", "4 is out of range", "equal to 2 or 3"]);
    refused_line(2, "dimension = 0", &["equal to 2 or 3"]);
}

#[test]
fn wrong_numbers_of_coordinates() {
    refused_line(
        8,
        "position = [0.3, 0.525]",
        &["particles[0].position", "2 coordinates in 3D", "expected 3"],
    );
    refused_line(
        5,
        "upper = [1.0]",
        &["domain.upper = [1.0]", "1 coordinates in 3D", "expected 3 coordinates"],
    );
    // The dimension is believed, the coordinates are not.
    refused(&with_line(2, "dimension = 2"), &["case.toml:5:", "domain.upper", "3 coordinates in 2D"]);
}

#[test]
fn forces_that_make_no_sense() {
    let stokes = with_line(21, "hydrodynamics = \"stokes\"");
    let with = |nth: usize, line: &str| {
        let mut lines: Vec<&str> = stokes.lines().collect();
        lines.insert(nth, line);
        lines.join("\n") + "\n"
    };
    let refuse = |nth: usize, line: &str, expected: &[&str]| {
        let place = format!("case.toml:{}:", nth + 1);
        refused(&with(nth, line), &[&[place.as_str()], expected].concat());
    };
    refuse(3, "gravity = [0.0, -1.0]", &["gravity = [0.0, -1.0]", "2 coordinates in 3D"]);
    refuse(3, "gravity = 9.81", &["gravity = 9.81", "expected a list like [1.0, 2.0]"]);
    refuse(3, "gravity = [0.0, nan, 0.0]", &["gravity[1] = nan", "not a finite number"]);
    refuse(9, "force = [1.0, inf, 0.0]", &["particles[0].force[1] = inf", "not a finite number"]);
    refuse(12, "force = [1.0]", &["particles[1].force = [1.0]", "expected 3 coordinates"]);
    let torque = "particles[0].torque = [1.0]";
    refuse(9, "torque = [1.0]", &[torque, "a torque of 1 numbers in 3D", "expected a list of length 3"]);
    refuse(9, "forces = [1.0, 0.0, 0.0]", &["particles[0].forces", "did you mean `force`?"]);
    // The mobility of a pair answers to the shear alone.
    let analytic = GOOD.replace("radius = 0.05\n[time]", "radius = 0.05\ntorque = [0.0, 0.0, 1.0]\n[time]");
    let expected =
        ["case.toml:13:", "particles[1].torque", "hydrodynamics = \"stokes\"", "has \"pair-mobility\""];
    refused(&analytic, &expected);
    let text = with(3, "gravity = [0.0, 0.0, -1.0]")
        .replace("name = \"pair\"", "name = \"pair\"\nreference = \"pair3d_trajectory_box\"");
    refused(&text, &["case.toml:2:", "needs particles without forces and torques"]);
}

#[test]
fn overlapping_starts() {
    let message = "particles 1 and 2 overlap at the start: gap -0.04";
    let key = "particles[1].position = [0.36, 0.525, 0.5]";
    refused_line(11, "position = [0.36, 0.525, 0.5]", &[key, message, "at least 0.1 is needed"]);
    refused_line(11, "position = [0.3, 0.525, 0.5]", &["gap -0.1"]);
    // All pairs are told at once.
    let third = |x: f64| format!("[[particles]]\nposition = [{x}, 0.475, 0.5]\nradius = 0.05\n");
    let crowd = GOOD.to_owned() + &third(0.71) + &third(0.2) + &third(0.21);
    refused(&crowd, &["particles 2 and 3 overlap at the start: gap -0.09; so do 4 and 5", "case.toml:31:"]);
}

#[test]
fn particles_outside_the_box() {
    let message = "particle 2 sticks out of the box by 0.02 along x";
    let hint = "x of the centre must lie between 0.05 and 0.95";
    refused_line(11, "position = [0.97, 0.475, 0.5]", &["particles[1].position", message, hint]);
    refused_line(8, "position = [0.3, 0.525, -7.0]", &["particles[0].position", "along z"]);
    let message = "particle 1 of diameter 1.2 does not fit in a box of edge 1 along x";
    refused_line(9, "radius = 0.6", &["particles[0].radius = 0.6", message, "less than 0.5"]);
}

#[test]
fn boxes_that_are_none() {
    let empty = "the box is empty along y: lower 0, upper -1";
    refused_line(5, "upper = [1.0, -1.0, 1.0]", &["domain.upper", empty, "must exceed"]);
    let stokes = with_line(21, "hydrodynamics = \"stokes\"");
    let uneven = stokes.replace("upper = [1.0, 1.0, 1.0]", "upper = [1.517, 1.0, 1.0]");
    refused(&uneven, &["case.toml:5:", "edges [1.517, 1.0, 1.0]", "ratios of the edges simple"]);
}

#[test]
fn numbers_that_are_not_positive() {
    refused_line(
        14,
        "step = 0.0",
        &["time.step = 0.0", "0 is out of range", "expected a number greater than 0"],
    );
    refused_line(14, "step = -0.05", &["time.step = -0.05", "greater than 0"]);
    refused_line(15, "end = -1", &["time.end = -1", "greater than 0"]);
    refused_line(14, "step = 1e-300", &["time.step", "at most 1e9 steps"]);
    refused_line(9, "radius = 0", &["particles[0].radius = 0", "greater than 0"]);
    refused_line(12, "radius = -0.05", &["particles[1].radius = -0.05", "greater than 0"]);
    refused_line(23, "tolerance = 0", &["flow.tolerance = 0", "between 0 and 0.1"]);
    let loose = with_line(17, "[contact]\ntolerance = 0.1");
    refused(&loose, &["case.toml:18:", "contact.tolerance = 0.1", "a number from 1e-15 to 1e-3"]);
    refused_line(25, "cells_per_radius = 0", &["flow.mesh.cells_per_radius", "a number of 1 or more"]);
}

#[test]
fn numbers_that_are_not_finite() {
    refused_line(14, "step = nan", &["time.step = nan", "NaN is not a finite number"]);
    refused_line(15, "end = inf", &["time.end = inf", "inf is not a finite number"]);
    refused_line(8, "position = [0.3, nan, 0.5]", &["particles[0].position[1] = nan", "not a finite number"]);
    refused_line(9, "radius = nan", &["particles[0].radius = nan", "not a finite number"]);
    refused_line(3, "shear_rate = -inf", &["shear_rate = -inf", "not a finite number"]);
    refused_line(5, "upper = [1.0, nan, 1.0]", &["domain.upper[1] = nan", "not a finite number"]);
    refused_line(23, "tolerance = nan", &["flow.tolerance = nan", "not a finite number"]);
    refused_line(28, "rho = nan", &["flow.paper.rho = nan", "not a finite number"]);
}

#[test]
fn names_that_are_not_known() {
    let all = "\"none\", \"velocity-correction\", \"inelastic\", \"gluey\", \"rough\"";
    let near = "did you mean \"gluey\"?";
    refused_line(
        18,
        "strategy = \"glue\"",
        &["contact.strategy", "`glue` is not a known strategy", near, all],
    );
    refused_line(22, "formulation = \"rigid\"", &["flow.formulation", "\"paper\", \"unfitted\""]);
    refused_line(16, "scheme = \"rk4\"", &["time.scheme", "\"euler\", \"adams-bashforth-2\""]);
    refused_line(6, "boundary = \"periodc\"", &["domain.boundary", "did you mean \"periodic\"?"]);
    refused_line(21, "hydrodynamics = \"navier\"", &["flow.hydrodynamics", "\"stokes\", \"pair-mobility\""]);
    let lubricated = with_line(22, "formulation = \"paper\"\nlubrication = \"deficit\"");
    refused(
        &lubricated,
        &["case.toml:23:", "\"deficit\" needs flow.formulation = \"unfitted\"", "has \"paper\""],
    );
    let roots = with_line(26, "root_cells = 17");
    refused(&roots, &["case.toml:26:", "flow.mesh.root_cells = 17", "a number from 1 to 16"]);
    let solver = with_line(20, "[flow]\nsolver = \"cg\"");
    refused(&solver, &["case.toml:21:", "flow.solver", "one of \"auto\", \"direct\", \"multigrid\""]);
    refused_line(
        29,
        "velocity = \"centre\"",
        &["flow.paper.velocity", "did you mean \"center\"?", "\"mean\""],
    );
    let memory = with_line(17, "[contact]\nmemory = \"none\"");
    refused(&memory, &["case.toml:18:", "contact.memory", "one of \"paper\", \"consistent\""]);
    let contact = with_line(17, "[contact]\nsolver = \"gauss\"");
    let all = "one of \"auto\", \"uzawa\", \"accelerated\", \"active-set\"";
    refused(&contact, &["case.toml:18:", "contact.solver", "`gauss` is not a known solver", all]);
}

#[test]
fn choices_that_do_not_fit_together() {
    let third = GOOD.to_owned() + "[[particles]]\nposition = [0.5, 0.2, 0.5]\nradius = 0.05\n";
    refused(
        &third,
        &["case.toml:21:", "flow.hydrodynamics = \"pair-mobility\"", "two particles", "3 particles"],
    );
    refused_line(1, "name = \"a pair\"", &["name = \"a pair\"", "not a name", "letters, digits"]);
    let reference = |name: &str| with_line(1, &format!("name = \"pair\"\nreference = \"{name}\""));
    refused(
        &reference("pair4d"),
        &["case.toml:2:", "`pair4d` is not a known reference", "pair3d_trajectory_box"],
    );
    refused(&reference("pair2d_trajectory"), &["case.toml:2:", "but the case has dimension 3"]);
}

/// What a reference was not computed for would look like an error of the run.
#[test]
fn references_of_something_else() {
    let with = |name: &str| with_line(1, &format!("name = \"pair\"\nreference = \"{name}\""));
    let (unbounded, boxed) = (with("pair3d_trajectory_unbounded"), with("pair3d_trajectory_box"));
    let stokes = |text: &str| text.replace("hydrodynamics = \"pair-mobility\"", "hydrodynamics = \"stokes\"");
    refused(
        &boxed,
        &["case.toml:2:", "flow.hydrodynamics = \"stokes\"", "but the case has \"pair-mobility\""],
    );
    refused(&stokes(&unbounded), &["flow.hydrodynamics = \"pair-mobility\"", "has \"stokes\""]);
    let boxed = stokes(&boxed);
    let periodic = boxed.replace("\"couette\"", "\"periodic\"");
    refused(&periodic, &["case.toml:2:", "needs domain.boundary = \"couette\"", "has \"periodic\""]);
    let wide = boxed.replace("upper = [1.0, 1.0, 1.0]", "upper = [2.0, 1.0, 1.0]");
    refused(&wide, &["the unit box, from 0 to 1", "a box from [0.0, 0.0, 0.0] to [2.0, 1.0, 1.0]"]);
    let high = unbounded.replace("upper = [1.0, 1.0, 1.0]", "upper = [1.0, 2.0, 1.0]");
    refused(&high, &["a box whose middle is at y = 0.5", "its middle at y = 1"]);
    let (wanted, moved) = ("particle 1 of radius 0.05 at [0.3, 0.525, 0.5]", "0.53, 0.5]");
    refused(&unbounded.replace("0.525, 0.5]", moved), &[wanted, "radius 0.05 at [0.3, 0.53, 0.5]"]);
    let deep = unbounded.replace("0.525, 0.5]", "0.525, 0.6]");
    refused(&deep, &[wanted, "radius 0.05 at [0.3, 0.525, 0.6]"]);
    let fast = unbounded.replace("shear_rate = 1.0", "shear_rate = 2.0");
    refused(&fast, &["needs shear_rate = 1, but the case has 2"]);
    let reversed = unbounded.replace("[time]\n", "[time]\nreverse_at = 1.0\n");
    refused(&reversed, &["a shear that is not reversed", "time.reverse_at"]);
    let oscillating = unbounded.replace("[time]\n", "[time]\nstrain_amplitude = 1.0\n");
    refused(&oscillating, &["a shear that is not reversed", "time.strain_amplitude"]);
}

#[test]
fn meshes_that_cannot_be_numbered() {
    refused_line(25, "cells_per_radius = 1e9", &["flow.mesh.cells_per_radius = 1e9", "level", "at most"]);
    refused_line(26, "coarsest_level = 12", &["flow.mesh.coarsest_level = 12", "between 0 and 7"]);
}

#[test]
fn output_folders_that_cannot_be_written() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("case.toml"), GOOD).expect("a file");
    fs::write(folder.path().join("taken"), "a file, not a folder").expect("a file");
    let (code, _, stderr) = gluey(folder.path(), &["run", "case.toml", "--out", "taken/deeper"]);
    assert_eq!(code, Some(1));
    assert!(stderr.contains("taken/deeper: cannot create the folder"), "{stderr}");
    assert!(stderr.contains("--out DIR"), "{stderr}");
    let (code, _, stderr) = gluey(folder.path(), &["run", "case.toml", "--out", "/proc/gluey"]);
    assert_eq!(code, Some(1), "{stderr}");
    assert!(stderr.contains("/proc/gluey: cannot create the folder"), "{stderr}");
}

#[test]
fn arguments_that_make_no_sense() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("case.toml"), GOOD).expect("a file");
    for (arguments, expected) in [
        (
            ["--strategy", "glue"],
            "expected `none` or `velocity-correction` or `inelastic` or `gluey` or `rough`",
        ),
        (["--formulation", "soft"], "`soft` is not a known formulation"),
        (["--vtk", "0"], "must be at least 1"),
        (["--checkpoint-every", "often"], "must be a whole number"),
        (["--vtk-compression", "10"], "10 is not in 0..=9"),
        (["--vtk-precision", "f16"], "expected `f32` or `f64`"),
    ] {
        let (code, _, stderr) = gluey(folder.path(), &[["run", "case.toml"], arguments].concat());
        assert_eq!(code, Some(2), "{stderr}");
        assert!(stderr.contains(expected), "{stderr}");
    }
}
