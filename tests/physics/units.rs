//! A case in any unit of length: the same gaps and effort, and pictures that tell its numbers.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::program::told;
use gluey::table::NumberTable;
use tempfile::TempDir;

/// Three discs in a channel of this height, at round places: surfaces are just as far from cells as finer
/// ones reach, where rounding must not decide.
fn case(unit: f64) -> String {
    let disc = |x: f64, y: f64| {
        let [x, y, radius] = [x, y, 0.05].map(|length| length * unit);
        format!("[[particles]]\nposition = [{x:e}, {y:e}]\nradius = {radius:e}\n")
    };
    let discs = disc(0.3, 0.55) + &disc(0.5, 0.48) + &disc(0.12, 0.3);
    format!(
        "name = \"u\"\ndimension = 2\n[domain]\nupper = [{unit:e}, {unit:e}]\nboundary = \"periodic\"\n{discs}\
         [time]\nstep = 0.1\nend = 0.5\n[contact]\nstrategy = \"none\"\n[flow.mesh]\ncells_per_radius = 2.0\n"
    )
}

fn table(folder: &Path, name: &str) -> NumberTable {
    NumberTable::parse(&fs::read_to_string(folder.join("out").join(name)).expect(name)).expect(name)
}

/// The run of a case in a unit, with its pictures.
fn drawn(unit: f64) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("u.toml"), case(unit)).expect("a file");
    told(folder.path(), &["run", "u.toml", "--xyz", "1"]);
    told(folder.path(), &["analyse", "out"]);
    told(folder.path(), &["plot", "out", "--format", "svg"]);
    told(folder.path(), &["plot", "out", "--format", "svg", "--frame", "last"]);
    folder
}

/// Where a label is anchored on the picture, and its text without markup.
struct Label {
    x: f64,
    anchor: String,
    text: String,
}

/// The labels of each chart of a picture, which is an SVG document within another.
fn labels(svg: &str) -> Vec<Vec<Label>> {
    let attribute = |tag: &str, name: &str| {
        tag.split(&format!(" {name}=\"")).nth(1).and_then(|rest| rest.split('"').next()).map(str::to_owned)
    };
    let of_chart = |part: &str| {
        let texts = part.split("<text").skip(1).filter(|text| !text.contains("rotate"));
        let label = |text: &str| {
            let (tag, rest) = text.split_once('>')?;
            let inside = rest.split("</text>").next()?;
            let plain = inside.split('<').map(|piece| piece.split_once('>').map_or(piece, |(_, text)| text));
            let x = attribute(tag, "x")?.parse().ok()?;
            Some(Label {
                x,
                anchor: attribute(tag, "text-anchor").unwrap_or_default(),
                text: plain.collect(),
            })
        };
        texts.filter_map(label).collect()
    };
    svg.split("<svg").skip(2).map(|part| of_chart(part.split("</svg>").next().unwrap_or(""))).collect()
}

fn number(label: &Label) -> Option<f64> {
    label.text.replace('\u{2212}', "-").parse().ok()
}

#[test]
fn pictures_tell_numbers_in_any_unit() {
    let one = drawn(1.0);
    let stem = "u-none-unfitted";
    let same = |folder: &Path, name: &str, columns: &[&str], tolerance: f64| {
        let tables = [one.path(), folder].map(|folder| table(folder, name));
        for column in columns {
            let [first, other] = [0, 1].map(|k| tables[k].column(column).expect("a column"));
            let miss = first.iter().zip(other).map(|(a, b)| (a - b).abs() / a.abs()).fold(0.0, f64::max);
            assert!(miss <= tolerance, "{column}: {miss}");
        }
    };
    for unit in [1e-9, 1e-4, 1e6, 1e9] {
        let folder = drawn(unit);
        same(folder.path(), &format!("{stem}-solver.csv"), &["cells", "unknowns", "iterations"], 0.0);
        let gaps = ["gap12_over_a", "gap13_over_a", "gap23_over_a"];
        same(folder.path(), &format!("{stem}.csv"), &gaps, 1e-9);
        for name in
            ["u-none-unfitted-plots/trajectories", "u-none-unfitted-plots/gaps", "structure-plots/profiles"]
        {
            let path = folder.path().join(format!("out/{name}.svg"));
            let svg = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
            for chart in labels(&svg) {
                // Ticks across are in the middle under their places, those upright end at the frame.
                for anchor in ["middle", "end"] {
                    let ticks =
                        || chart.iter().filter(|label| label.anchor == anchor && number(label).is_some());
                    let texts: BTreeSet<&str> = ticks().map(|label| label.text.as_str()).collect();
                    assert!(texts.len() > 1 && texts.len() == ticks().count(), "{unit} {name}: {texts:?}");
                    assert!(texts.iter().all(|text| text.chars().count() < 8), "{unit} {name}: {texts:?}");
                }
                assert!(chart.iter().all(|label| label.x >= 0.0 && label.x <= 600.0), "{name}");
            }
            let is_apart = svg.contains("\u{d7} 10");
            assert_eq!(is_apart, !name.ends_with("gaps"), "{unit} {name}: lengths have a power set apart");
        }
        let particles =
            fs::read_to_string(folder.path().join(format!("out/{stem}-plots/particles-000005.svg")));
        let speeds = table(folder.path(), "profile_y.csv");
        let fastest =
            speeds.column("velocity_x").expect("a column").iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let bar = particles.expect("a picture");
        let exponent = bar.split("text-anchor=\"end\"").nth(1).and_then(|rest| rest.split(['>', '<']).nth(1));
        let most: f64 = exponent.and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{exponent:?}"));
        assert!(most > 0.5 * fastest && most < 2.0 * fastest, "{most} {fastest}");
    }
}

/// Walls and periodic borders of the box, and one scale along both axes.
#[test]
fn paths_lie_in_their_box() {
    let folder = drawn(1.0);
    let path = folder.path().join("out/u-none-unfitted-plots/trajectories.svg");
    let svg = fs::read_to_string(path).expect("a picture");
    assert_eq!(svg.matches("stroke=\"#777777\"").count(), 4, "four borders");
    assert_eq!(svg.matches("stroke-dasharray=\"6 4\"").count(), 2, "two of them periodic");
    // The box is a square of the case, and one on paper.
    let borders: Vec<Vec<f64>> =
        svg.split("<path").filter(|path| path.contains("#777777")).map(coordinates).collect();
    let ends = |k: usize| {
        let all = borders.iter().flat_map(|path| path.iter().skip(k).step_by(2).copied());
        all.fold((f64::INFINITY, 0.0_f64), |ends, x| (ends.0.min(x), ends.1.max(x)))
    };
    let [(left, right), (top, bottom)] = [0, 1].map(ends);
    assert!(((right - left) / (bottom - top) - 1.0).abs() < 1e-3, "{left} {right} {top} {bottom}");
}

/// The numbers of the way of a path.
fn coordinates(path: &str) -> Vec<f64> {
    let way = path.split(" d=\"").nth(1).and_then(|rest| rest.split('"').next()).unwrap_or("");
    way.split(|letter: char| letter.is_ascii_alphabetic() || letter == ' ' || letter == ',')
        .filter_map(|number| number.parse().ok())
        .collect()
}
