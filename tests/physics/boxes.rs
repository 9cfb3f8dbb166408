//! Sheared boxes of any shape: they run at every tilt, and gaps are those of the nearest of all images.

#[path = "../../crates/gluey/examples/sheared_boxes.rs"]
mod sheared_boxes;

use crate::runs::{beside, case, column, ran, run_named};
use sheared_boxes::{COUNT, END, Swept, edges, gaps_of_all_images, numbers, sheared_box, swept};
use tempfile::TempDir;

/// Gaps may differ by this, in mean radii: rounding.
const ROUNDING: f64 = 1e-9;

/// Some boxes of the sweep, of all shapes in two dimensions; `sheared_boxes` as a program runs all.
#[test]
fn boxes_of_any_shape_run_at_every_tilt() {
    let folder = TempDir::new().expect("a folder");
    let mut shapes = Vec::new();
    for number in 0..COUNT {
        let case = sheared_box(number).unwrap_or_else(|error| panic!("{error}"));
        let cells = case.particles.len() as f64 * case.cells_per_radius_as_built().expect("a mesh").powi(3);
        let is_cheap = if case.dimension == 2 { (number + number / 10) % 3 == 0 } else { cells < 4.0 };
        if !is_cheap {
            continue;
        }
        let Swept { rows, gap_miss, viscosities } =
            swept(&case, folder.path()).unwrap_or_else(|error| panic!("{number}: {error}"));
        assert_eq!(rows, 1 + (END / case.time.step).round() as usize);
        assert!(gap_miss < ROUNDING, "{number}: {gap_miss:e}");
        assert!(viscosities[0] > 1.0 && viscosities[1] < 20.0, "{number}: {viscosities:?}");
        let edges = edges(&case);
        shapes.push((case.dimension, edges[0] / edges[1]));
    }
    assert!(shapes.contains(&(2, 8.0)) && shapes.contains(&(2, 0.25)) && shapes.len() > 11, "{shapes:?}");
}

/// One disc in a box four times as long as high: the lattice at a strain of 4 is that at 0, those at `s` and
/// `4 - s` are mirror images.
#[test]
fn a_long_box_has_the_viscosity_of_its_mirror_image() {
    let case = case(
        "name = \"long\"\ndimension = 2\ndomain = { upper = [2.0, 0.5], boundary = \"sheared\" }\n\
         particles = [{ position = [0.6, 0.25], radius = 0.1 }]\ncontact = { strategy = \"none\" }\n\
         time = { step = 0.1, end = 4.0 }\nflow.mesh = { cells_per_radius = 2.0 }\n",
    );
    let [viscosity, n1] =
        ran(&case, |csv| ["viscosity", "N1"].map(|name| column(&beside(csv, "rheology"), name)));
    assert_eq!(viscosity.len(), 41);
    let pairs = |of: &[f64]| (0..=20).map(|k| (of[k], of[40 - k])).collect::<Vec<(f64, f64)>>();
    let miss = pairs(&viscosity).into_iter().map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    let normal = pairs(&n1).into_iter().map(|(a, b)| (a + b).abs()).fold(0.0, f64::max);
    println!("viscosity {miss:.1e}, N1 {normal:.1e}");
    assert!(miss < 1e-3 && normal < 1e-3, "{miss} {normal}");
}

/// Discs whose nearest images are not those nearest in `y` first, then in `x`.
#[test]
fn gaps_are_those_of_the_nearest_image_and_continuous() {
    let two =
        "particles = [{ position = [0.3, 0.25], radius = 0.1 }, { position = [0.55, 0.7], radius = 0.1 }]\n";
    // A box as low as is accepted, and one with a row for each pair too few.
    let low = "domain.upper = [1.6, 0.4]\n\
               particles = [{ position = [0.1, 0.1], radius = 0.1 }, { position = [1.0, 0.3], radius = 0.1 }]\n";
    let ten = "suspension = { count = 10, radius = 0.04, arrangement = \"random\", seed = 4 }\n";
    for (particles, end, least) in [(two, 0.5, Some(3.6177)), (low, 1.0, None), (ten, 0.6, None)] {
        let case = case(&format!(
            "name = \"far\"\ndimension = 2\ncontact.strategy = \"none\"\ntime = {{ step = 0.05, end = {end:?} }}\n\
             domain.boundary = \"sheared\"\nflow.mesh.cells_per_radius = 2.0\n{particles}"
        ));
        let folder = TempDir::new().expect("a folder");
        let csv = run_named(&case, folder.path(), "far");
        let told = column(&beside(&csv, "rheology"), "min_gap_over_a");
        let smallest: Vec<f64> = numbers(&csv)
            .expect("a table")
            .iter()
            .map(|row| gaps_of_all_images(&case, row).into_iter().fold(f64::INFINITY, f64::min))
            .collect();
        assert!(told.iter().zip(&smallest).all(|(a, b)| (a - b).abs() < ROUNDING), "{told:?} {smallest:?}");
        if let Some(least) = least {
            assert!((told[told.len() - 1] - least).abs() < 1e-4, "{told:?}");
        }
        // Surfaces part or meet no faster than the shear carries them over the height of the box.
        let fastest = 2.0 * 0.05 * edges(&case)[1] / case.mean_radius();
        assert!(told.windows(2).all(|gaps| (gaps[1] - gaps[0]).abs() < fastest), "{told:?}");
    }
}

/// The program as a whole is compiled and not run: it takes minutes.
const _: fn() -> Result<(), Box<dyn std::error::Error>> = sheared_boxes::main;
