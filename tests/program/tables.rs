//! Tables of runs and of `gluey analyse`: what they say where there is nothing to say, means of the rheology,
//! studies, and whether docs/files.md has every column.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::program::{fails, told};
use gluey::RunRecord;
use gluey::table::NumberTable;
use tempfile::TempDir;

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn write(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).expect("a file");
}

fn table(folder: &Path, name: &str) -> NumberTable {
    NumberTable::parse(&read(folder, name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Two discs near the walls of a channel, nothing between.
const FAR_APART: &str = "name = \"far\"\ndimension = 2\ndomain = { boundary = \"periodic\" }\n\
    particles = [{ position = [0.3, 0.9], radius = 0.05 }, { position = [0.7, 0.2], radius = 0.05 }]\n\
    time = { step = 0.1, end = 0.3 }\ncontact = { strategy = \"none\" }\n[flow.mesh]\ncells_per_radius = 2.0\n";

#[test]
fn cells_without_anything_are_empty() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), "far.toml", FAR_APART);
    told(folder.path(), &["run", "far.toml", "--xyz", "1"]);
    let summary = told(folder.path(), &["analyse", "out"]);
    assert!(!summary.contains("NaN") && !summary.contains("0 +- 0"), "{summary}");
    assert!(summary.contains("fabric xy                      none"), "{summary}");
    let profile = table(folder.path(), "out/profile_y.csv");
    let column = |name: &str| profile.column(name).expect("a column");
    let (fraction, velocity) = (column("fraction"), column("velocity_x"));
    assert!(fraction.iter().zip(velocity).all(|(part, velocity)| (*part == 0.0) == velocity.is_nan()));
    assert!(fraction.contains(&0.0) && fraction.iter().any(|part| *part > 0.0));
    let fabric = table(folder.path(), "out/series.csv");
    assert!(fabric.column("fabric_xy").expect("a column").iter().all(|fabric| fabric.is_nan()));
    told(folder.path(), &["plot", "out", "--format", "svg"]);
    let profiles = read(folder.path(), "out/structure-plots/profiles.svg");
    let paths = profiles.matches("stroke=\"#0b4f9e\"").count();
    assert_eq!(paths, 3, "two pieces of the velocity along x, and the sample of the legend");
}

#[test]
fn one_particle_has_means_without_intervals_of_nothing() {
    let folder = TempDir::new().expect("a folder");
    let (first, rest) = FAR_APART.split_once(", { position = [0.7, 0.2], radius = 0.05 }").expect("two");
    write(folder.path(), "one.toml", &format!("{first}{}", rest.replace("0.3 }", "0.8 }")));
    told(folder.path(), &["run", "one.toml", "--xyz", "1"]);
    let summary = told(folder.path(), &["analyse", "out"]);
    assert!(!summary.contains("NaN") && summary.contains("self-diffusivity               none"), "{summary}");
    for name in ["series", "g_of_r", "g_of_theta", "diffusion", "profile_y"] {
        let text = read(folder.path(), &format!("out/{name}.csv"));
        assert!(!text.contains("NaN") && !text.contains("inf"), "{name}: {text}");
    }
    assert!(table(folder.path(), "out/g_of_r.csv").column("g").expect("g").iter().all(|g| g.is_nan()));
    told(folder.path(), &["plot", "out", "--format", "svg"]);
}

#[test]
fn frames_without_particles_are_refused() {
    let folder = TempDir::new().expect("a folder");
    let frame = "0\nLattice=\"1 0 0 0 1 0 0 0 0.1\" Origin=\"0 0 0\" pbc=\"T T F\" \
                 Properties=species:S:1:pos:R:3:radius:R:1:velo:R:3:angular_velocity:R:3 Time=0 Strain=0 Dimension=2\n";
    write(folder.path(), "particles-000000.xyz", frame);
    for command in ["analyse", "view", "plot"] {
        let more: &[&str] = if command == "plot" { &["--frame", "last"] } else { &[] };
        let arguments = [&[command, "."], more].concat();
        fails(folder.path(), &arguments, &["particles-000000.xyz:1: no particles"]);
    }
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1, "nothing is written");
}

/// Discs in a box that is sheared for ever.
fn sheared(end: f64, more: &str) -> String {
    format!(
        "name = \"s\"\ndimension = 2\ndomain = {{ boundary = \"sheared\" }}\n\
         suspension = {{ volume_fraction = 0.2, count = 6, seed = 5, min_gap = 0.05 }}\n\
         time = {{ step = 0.05, end = {end} }}\ncontact = {{ strategy = \"none\" }}\n{more}\n[flow.mesh]\n\
         cells_per_radius = 2.0\n"
    )
}

/// The mean of a column behind the rows that are left out.
fn mean(table: &NumberTable, name: &str, skipped: usize) -> f64 {
    let kept = &table.column(name).expect("a column")[skipped..];
    kept.iter().sum::<f64>() / kept.len() as f64
}

#[test]
fn means_of_the_rheology_are_in_report_and_summary() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), "s.toml", &sheared(1.0, ""));
    let report = told(folder.path(), &["run", "s.toml", "--xyz", "4", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    let means = &report["rheology"];
    let rows = table(folder.path(), "out/s-none-unfitted-rheology.csv");
    let skipped = means["skipped"].as_u64().expect("a number") as usize;
    for name in ["viscosity", "viscosity_by_dissipation", "N1", "particle_pressure"] {
        let found = means[name]["mean"].as_f64().expect("a number");
        assert!((found - mean(&rows, name, skipped)).abs() < 1e-12 * (1.0 + found.abs()), "{name}: {found}");
        assert!(means[name]["half_width"].as_f64().is_some_and(|width| width > 0.0), "{means}");
    }
    assert!(means["N2"].is_null(), "{means}");
    let summary = told(folder.path(), &["analyse", "out"]);
    for line in ["relative viscosity", "N1", "particle pressure", "21 rows of rheology", "+-"] {
        assert!(summary.contains(line), "{summary}");
    }
    let summary: serde_json::Value =
        serde_json::from_str(&told(folder.path(), &["analyse", "out", "--json"])).expect("JSON");
    assert_eq!(summary["rheology"], *means);
    assert!(summary["means"]["median gap / a"]["mean"].as_f64().is_some_and(|gap| gap > 0.0), "{summary}");
    let later: serde_json::Value =
        serde_json::from_str(&told(folder.path(), &["analyse", "out", "--json", "--skip", "2"]))
            .expect("JSON");
    assert_eq!(later["rheology"]["skipped"], 8, "two frames of four steps");
}

#[test]
fn studies_tell_viscosities_and_how_far_they_are() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), "s.toml", &sheared(0.3, ""));
    let key = "suspension.volume_fraction";
    told(folder.path(), &["sweep", "s.toml", "--set", &format!("{key}=0.05,0.1,0.15,0.2"), "--out", "study"]);
    let text = read(folder.path(), "study/sweep.csv");
    let names = "strain_skipped,viscosity,viscosity_half_width,viscosity_by_dissipation,\
                 viscosity_by_dissipation_half_width,viscosity_of_contacts,viscosity_of_contacts_half_width,\
                 viscosity_of_friction,viscosity_of_friction_half_width,sticking_contacts,\
                 sticking_contacts_half_width,sliding_contacts,sliding_contacts_half_width,N1,N1_half_width,N2,\
                 N2_half_width,particle_pressure,particle_pressure_half_width,blocks_independent";
    assert!(text.lines().next().is_some_and(|line| line.contains(names)), "{text}");
    let cell = |line: usize, name: &str| {
        let place = text.lines().next().expect("a head").split(',').position(|one| one == name).expect(name);
        text.lines().nth(line).and_then(|line| line.split(',').nth(place)?.parse::<f64>().ok())
    };
    let viscosities: Vec<f64> = (1..=4).filter_map(|line| cell(line, "viscosity")).collect();
    assert!(viscosities.len() == 4 && viscosities.windows(2).all(|two| two[0] < two[1]), "{viscosities:?}");
    assert!((1..=4).all(|line| cell(line, "viscosity_half_width") > Some(0.0) && cell(line, "N2").is_none()));
    let pictures = told(folder.path(), &["plot", "study"]);
    assert_eq!(pictures, "study/sweep-plots/viscosity.svg\nstudy/sweep-plots/viscosity.png\n");
    let svg = read(folder.path(), "study/sweep-plots/viscosity.svg");
    assert!(svg.contains(key) && svg.contains("relative viscosity"));
    // A dot for each point.
    assert_eq!(svg.matches("<circle").count(), 4);
    fails(folder.path(), &["plot", "study", "--only", "gaps"], &["study: a study has one picture"]);
    let record = format!("study/{key}=0.1/s-none-unfitted-run.json");
    let failed = read(folder.path(), &record).replacen("\"complete\"", "\"failed\"", 1);
    write(folder.path(), &record, &failed.replacen("\"error\": null", "\"error\": \"no room\"", 1));
    fs::remove_dir_all(folder.path().join(format!("study/{key}=0.2"))).expect("a folder");
    let info = told(folder.path(), &["info", "study"]);
    assert!(info.contains("4: 2 done, 1 failed, 1 left") && info.contains("=0.1: no room"), "{info}");
}

/// Discs or spheres in a box that is sheared for ever, under these forces.
fn under(dimension: usize, forces: &str) -> String {
    let (count, fraction) = if dimension == 2 { (6, 0.2) } else { (3, 0.1) };
    format!(
        "name = \"w\"\ndimension = {dimension}\n{forces}\ndomain = {{ boundary = \"sheared\" }}\n\
         suspension = {{ volume_fraction = {fraction}, count = {count}, seed = 3, min_gap = 0.05 }}\n\
         time = {{ step = 0.05, end = 0.1 }}\ncontact = {{ strategy = \"none\" }}\n[flow.mesh]\ncells_per_radius = 2.0\n"
    )
}

/// Weight does work beside that of the shear, which is no viscosity: the two routes agree as they do without
/// it. Where it does more than the shear, there is no second one.
#[test]
fn the_work_of_weight_is_no_viscosity() {
    let folder = TempDir::new().expect("a folder");
    let rheology = |dimension: usize, forces: &str| {
        write(folder.path(), "w.toml", &under(dimension, forces));
        told(folder.path(), &["run", "w.toml", "--force"]);
        table(folder.path(), "out/w-none-unfitted-rheology.csv")
    };
    for (dimension, weight) in [(2, "gravity = [3.0, -20.0]"), (3, "gravity = [3.0, -20.0, 5.0]")] {
        let [without, with] = ["", weight].map(|forces| {
            let rows = rheology(dimension, forces);
            let column = |name: &str| rows.column(name).expect("a column").to_vec();
            let (first, second) = (column("viscosity"), column("viscosity_by_dissipation"));
            first.iter().zip(second).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
        });
        println!("{dimension}D: routes {without:.1e}, under weight {with:.1e}");
        // Measured: 5.9e-4 and 1.0e-3; with the work of weight in it several per cent.
        assert!(with < 3e-3, "{dimension}D: {with}");
    }
    let rows = rheology(2, "shear_rate = 1e-3\ngravity = [0.0, -20.0]");
    assert!(rows.column("viscosity_by_dissipation").expect("a column").iter().all(|cell| cell.is_nan()));
    let text = read(folder.path(), "out/w-none-unfitted-rheology.csv");
    assert!(!text.contains("inf") && !text.contains("NaN"), "{text}");
}

/// Rates whose squares are no numbers are refused.
#[test]
fn rates_of_absurd_size_are_refused() {
    let folder = TempDir::new().expect("a folder");
    for rate in ["1e-200", "-1e150"] {
        write(folder.path(), "w.toml", &under(2, &format!("shear_rate = {rate}")));
        fails(folder.path(), &["run", "w.toml"], &["shear_rate", "1e-100 to 1e100, or 0"]);
    }
}

/// Rough discs, some of them in contact: every mean of a report has its own columns in the table of a study.
#[test]
fn a_study_has_the_means_of_its_reports() {
    let folder = TempDir::new().expect("a folder");
    let case = "name = \"rough\"\ndimension = 2\ntime = { step = 0.05, end = 1.0 }\n\
                domain = { boundary = \"sheared\" }\ncontact = { strategy = \"rough\", roughness = 0.1 }\n\
                [suspension]\nvolume_fraction = 0.4\ncount = 12\nmin_gap = 0.11\n[flow.mesh]\ncells_per_radius = 1.0\n";
    write(folder.path(), "rough.toml", case);
    told(folder.path(), &["sweep", "rough.toml", "--set", "contact.friction=0.5"]);
    let table = read(folder.path(), "sweep/sweep.csv");
    let [names, cells] = [0, 1].map(|line| table.lines().nth(line).expect("a line").split(','));
    let cell_of: BTreeMap<&str, &str> = names.zip(cells).collect();
    let record =
        RunRecord::read(&folder.path().join("sweep/contact.friction=0.5/rough-rough-unfitted-run.json"));
    let report = record.expect("a record").report.expect("a report");
    let means = serde_json::to_value(report.rheology.expect("means")).expect("JSON");
    let means = means.as_object().expect("an object").iter().filter(|(_, mean)| mean.get("mean").is_some());
    let mut found = 0;
    for (name, mean) in means {
        for (column, number) in
            [(name.clone(), &mean["mean"]), (format!("{name}_half_width"), &mean["half_width"])]
        {
            let number = number.as_f64().expect("a number");
            let cell: f64 = cell_of[&column[..]].parse().expect("a number");
            assert!((cell - number).abs() <= 1e-6 * number.abs(), "{column}: {cell} for {number}");
        }
        found += 1;
    }
    assert_eq!(found, 8, "all but N2, which is there in 3D");
    assert!(cell_of["N2"].is_empty() && cell_of["viscosity_of_contacts"] != "0", "{table}");
}

/// Names of columns that stand in the first cells of the tables under a heading of docs/files.md.
fn documented(page: &str, heading: &str) -> BTreeSet<String> {
    let lines = page.lines().skip_while(|line| line.trim_start_matches('#').trim() != heading);
    let section = lines.skip(1).take_while(|line| !line.starts_with('#'));
    let rows = section.filter(|line| line.starts_with("| `"));
    let names = rows.flat_map(|row| row.split('|').nth(1).unwrap_or("").split('`').skip(1).step_by(2));
    names.map(str::to_owned).collect()
}

/// Whether a column has a documented name, in which `I`, `J` and `K` before the end or an `_`, `x`, `y`, `z`
/// stand for numbers and `KEY` for a key of a case.
fn is_called(column: &str, name: &str) -> bool {
    if name == "KEY" {
        return column.contains('.');
    }
    let (mut rest, mut letters) = (column, name.chars());
    while let Some(letter) = letters.next() {
        if matches!(letter, 'I' | 'J' | 'K') {
            let is_last = !letters.as_str().contains(['I', 'J', 'K']);
            let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
            let taken = if is_last { digits } else { digits.min(1) };
            if taken == 0 {
                return false;
            }
            rest = &rest[taken..];
        } else {
            match rest.strip_prefix(letter) {
                Some(behind) => rest = behind,
                None => return false,
            }
        }
    }
    rest.is_empty()
}

/// Headings of docs/files.md and ends of the names of the files whose columns they have.
const SECTIONS: [(&str, &str); 13] = [
    ("Near pairs", "-gaps.csv"),
    ("Rheology", "-rheology.csv"),
    ("Held and driven particles", "-forces.csv"),
    ("Cost of the steps", "-solver.csv"),
    ("series.csv", "/series.csv"),
    ("g_of_r.csv", "/g_of_r.csv"),
    ("g_of_theta.csv", "/g_of_theta.csv"),
    ("structure_factor.csv", "/structure_factor.csv"),
    ("profile_y.csv", "/profile_y.csv"),
    ("diffusion.csv", "/diffusion.csv"),
    ("Studies", "/sweep.csv"),
    ("Extended XYZ", ".xyz"),
    ("Trajectory", ".csv"),
];

/// The columns of all tables below a folder, by the heading that has them.
fn written(folder: &Path, found: &mut Vec<(&'static str, String)>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            written(&path, found);
            continue;
        }
        let name = path.to_string_lossy().into_owned();
        let Some((heading, _)) = SECTIONS.iter().find(|(_, end)| name.ends_with(end)) else { continue };
        let text = fs::read_to_string(&path).expect("text");
        let columns: Vec<String> = match name.ends_with(".xyz") {
            false => text.lines().next().unwrap_or("").split(',').map(str::to_owned).collect(),
            true => {
                let properties = text.split("Properties=").nth(1).and_then(|rest| rest.split(' ').next());
                let parts: Vec<&str> = properties.expect("properties").split(':').collect();
                parts.chunks(3).map(|part| part.join(":")).collect()
            }
        };
        found.extend(columns.into_iter().map(|column| (*heading, column)));
    }
}

/// Runs with every optional table, in 2D and 3D: few and many particles, contact of two kinds and repulsion,
/// a given stress, particles that are held, two radii, frames and their analysis, and a study.
fn all_tables(folder: &Path) {
    let mesh = "[flow.mesh]\ncells_per_radius = 1.0\n";
    for dimension in [2, 3] {
        let head = format!("dimension = {dimension}\ntime = {{ step = 0.05, end = 0.1 }}\n");
        let (middle, other) =
            if dimension == 2 { ("0.5, 0.5", "0.2, 0.7") } else { ("0.5, 0.5, 0.5", "0.2, 0.7, 0.5") };
        let two = format!(
            "particles = [{{ position = [{middle}], radius = 0.1, held = true }}, {{ position = [{other}], radius = 0.1 }}]\n"
        );
        let none = "contact = { strategy = \"none\" }\n";
        write(folder, "held.toml", &format!("name = \"held{dimension}\"\n{head}{none}{two}{mesh}"));
        let many = "domain = { boundary = \"sheared\" }\nrepulsion = { force = 0.01, range = 0.05 }\n[suspension]\n\
                    volume_fraction = 0.1\ncount = 10\nmin_gap = 0.05\n\
                    radii = { kind = \"bidisperse\", ratio = 1.4, large_number = 0.5 }\n";
        write(folder, "many.toml", &format!("name = \"many{dimension}\"\n{head}{many}{mesh}"));
        let stress = format!("shear_stress = 1.0\n{none}domain = {{ boundary = \"sheared\" }}\n");
        let one = format!("particles = [{{ position = [{middle}], radius = 0.1 }}]\n");
        write(folder, "stress.toml", &format!("name = \"stress{dimension}\"\n{head}{stress}{one}{mesh}"));
        let rough = "domain = { boundary = \"sheared\" }\ncontact = { strategy = \"rough\" }\n[suspension]\n\
                     volume_fraction = 0.1\ncount = 10\nmin_gap = 0.05\n";
        write(folder, "rough.toml", &format!("name = \"rough{dimension}\"\n{head}{rough}{mesh}"));
        for case in ["held", "many", "stress", "rough"] {
            let out = format!("{case}{dimension}");
            told(folder, &["run", &format!("{case}.toml"), "--out", &out, "--xyz", "1"]);
        }
        told(folder, &["analyse", &format!("many{dimension}")]);
    }
    told(folder, &["sweep", "stress.toml", "--set", "time.step=0.05", "--out", "study"]);
}

/// What is written is documented, and what is documented is written.
#[test]
fn every_column_is_in_the_page_of_files() {
    let folder = TempDir::new().expect("a folder");
    all_tables(folder.path());
    let mut columns = Vec::new();
    written(folder.path(), &mut columns);
    let page = include_str!("../../docs/files.md");
    let mut faults = BTreeSet::new();
    for (heading, end) in SECTIONS {
        let names = documented(page, heading);
        let found: Vec<&String> =
            columns.iter().filter(|(of, _)| *of == heading).map(|(_, column)| column).collect();
        assert!(!found.is_empty(), "no file *{end} is written");
        let unknown = found.iter().filter(|column| !names.iter().any(|name| is_called(column, name)));
        faults.extend(unknown.map(|column| format!("{heading}: `{column}` has no row")));
        let unused = names.iter().filter(|name| !found.iter().any(|column| is_called(column, name)));
        faults.extend(unused.map(|name| format!("{heading}: `{name}` is in no file *{end}")));
    }
    assert!(faults.is_empty(), "docs/files.md: {faults:#?}");
}

#[test]
fn names_of_columns_have_numbers_where_the_page_has_letters() {
    for (column, name) in [
        ("x12", "xK"),
        ("gap12_over_a", "gapIJ_over_a"),
        ("force3x", "forceKx"),
        ("N1", "N1"),
        ("time.step", "KEY"),
    ] {
        assert!(is_called(column, name), "{column} {name}");
    }
    for (column, name) in [("x", "xK"), ("gap1_over_a", "gapIJ_over_a"), ("force3", "forceKx"), ("N11", "N1")]
    {
        assert!(!is_called(column, name), "{column} {name}");
    }
}
