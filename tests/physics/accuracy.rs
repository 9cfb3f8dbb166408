//! How right the default settings are near contact: approach of two particles from a run's first step,
//! against exact mobilities. What is measured here is what README says.

use gluey::case::Hydrodynamics;
use gluey::{Case, RunOptions, Silent, Strategy};
use tempfile::TempDir;

use crate::runs::run;

/// Spheres so small that the box changes their velocities by less than 2e-4.
const RADIUS: f64 = 0.0125;

/// Two spheres with their line of centres at 135 degrees to the flow, `gap` radii apart, a part of a cell off
/// the middle.
fn spheres(gap: f64, shift: [f64; 3]) -> Case {
    let half = (1.0 + 0.5 * gap) * RADIUS * std::f64::consts::FRAC_1_SQRT_2;
    let at = |sign: f64| [0.5 - sign * half + shift[0], 0.5 + sign * half + shift[1], 0.5 + shift[2]];
    let particle = |x: [f64; 3]| format!("[[particles]]\nposition = {x:?}\nradius = {RADIUS}\n");
    let text = format!(
        "name = \"spheres\"\ndimension = 3\n{}{}[time]\nstep = 1e-4\nend = 1e-4\n[contact]\nstrategy = \"none\"\n",
        particle(at(1.0)),
        particle(at(-1.0))
    );
    Case::parse(&text, "spheres.toml").unwrap_or_else(|error| panic!("{error}"))
}

/// Rate of change of the gap over the first step, in radii.
fn approach_speed(case: &Case) -> f64 {
    let folder = TempDir::new().expect("a folder");
    let csv = folder.path().join("t.csv");
    run(case, &RunOptions::csv(&csv), &Silent).unwrap_or_else(|error| panic!("{error}"));
    let text = std::fs::read_to_string(csv).expect("a trajectory");
    let column = text.lines().next().expect("a header").split(',').position(|name| name == "gap12_over_a");
    let column = column.expect("a gap");
    let gaps: Vec<f64> = text
        .lines()
        .skip(1)
        .map(|row| row.split(',').nth(column).expect("a cell").parse().expect("a number"))
        .collect();
    (gaps[1] - gaps[0]) / case.time.step
}

/// Smallest and largest relative error of the approach speed over positions of the lattice under the pair.
fn errors(gap: f64) -> (f64, f64) {
    let cell = 1.0 / 256.0;
    let shifts = [[0.0; 3], [0.3, 0.1, 0.45], [0.55, 0.8, 0.2]].map(|shift| shift.map(|s| s * cell));
    let relative = shifts.map(|shift| {
        let flow = spheres(gap, shift);
        assert_eq!(flow.contact.strategy, Strategy::None);
        let mut exact = flow.clone();
        exact.flow.hydrodynamics = Hydrodynamics::PairMobility;
        approach_speed(&flow) / approach_speed(&exact) - 1.0
    });
    relative.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), e| (low.min(e), high.max(e)))
}

#[test]
fn spheres_approach_at_these_speeds_by_default() {
    for (gap, low, high) in [
        (1.0, -5e-4, 5e-4),
        (0.2, -0.01, 0.02),
        (0.05, -0.04, 0.01),
        (1e-3, -0.005, 0.005),
        (1e-4, -0.005, 0.005),
    ] {
        let (smallest, largest) = errors(gap);
        eprintln!("gap {gap}: {smallest:.5} to {largest:.5}");
        assert!(low <= smallest && largest <= high, "gap {gap}: {smallest} to {largest}");
    }
}
