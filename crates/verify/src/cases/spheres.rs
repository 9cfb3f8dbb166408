//! Two spheres over gap and position of the lattice.

use gluey_geom::{Particle, Vector};
use gluey_levelset::Ball;
use gluey_motion::{Configuration, Hydrodynamics, LinearFlow, PairMobility};
use gluey_stokes::Refinement;
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{FILM_METHODS, METHODS, Method};
use crate::number::Number;
use crate::plot::Plot;
use crate::set_up::{PairMotion, couette, level, mean_and_scatter, mesh, shift, solve};
use crate::statistics::rms;

/// So small that the box changes the speed by less than 2e-4.
const RADIUS: f64 = 0.0125;
/// Gaps in radii.
const GAPS: [f64; 4] = [1.0, 0.5, 0.2, 0.05];
/// Gaps of films that no mesh here resolves.
const FILMS: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// Direction of the line of centres in degrees: its angle in the plane of shear, and out of it.
const DIRECTIONS: [[f64; 2]; 2] = [[135.0, 0.0], [160.0, 30.0]];

/// Positions of the lattice for what hardly feels it, or is there to be compared with.
const FEW: usize = 4;

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "spheres",
    title: "Two spheres",
    text: "Two free spheres of radius 0.0125 in the middle of the unit box with u = y - 1/2 on all sides, the line of centres at \
           135 degrees in the plane of shear, or at 160 degrees and raised 30 degrees out of it, on adaptive meshes, at several places in their cells: speed of approach against \
           the exact one in unbounded fluid (Batchelor and Green 1972; data/reference/sphere_pair_mobility_unbounded.csv, \
           error 1e-9; the box changes it by less than 2e-4).",
    keys: &["a/h", "gap", "angle", "position"],
    measures: &["approach", "line rotation", "spin"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

/// Cells per radius, and positions of the lattice.
fn meshes(extent: Extent) -> &'static [(f64, usize)] {
    extent.pick(&[(1.6, 8), (3.2, 6)], &[(1.6, 27), (3.2, 27), (6.4, 8)])
}

fn tasks(extent: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (method, &(cells, count)) in iproduct!(FILM_METHODS, meshes(extent)) {
        for (gap, direction) in places(method) {
            let is_first = direction == DIRECTIONS[0] && GAPS.contains(&gap);
            let is_usual = METHODS.iter().any(|usual| usual.name == method.name);
            let count = if is_first && is_usual { count } else { count.min(FEW) };
            tasks.extend((0..count).map(|k| {
                let at = [cells, gap, direction[0], k as f64];
                Task::new(method.name, &at, move || measure(method, &at, direction))
            }));
        }
    }
    tasks
}

/// Gaps and directions; what resolves no film is computed in the first of these.
fn places(method: &Method) -> impl Iterator<Item = (f64, [f64; 2])> + use<> {
    let (films, directions) = if method.lubricates { (FILMS.len(), DIRECTIONS.len()) } else { (0, 1) };
    let gaps = move || GAPS.into_iter().chain(FILMS.into_iter().take(films));
    DIRECTIONS.into_iter().take(directions).flat_map(move |direction| gaps().map(move |gap| (gap, direction)))
}

fn measure(
    method: &Method,
    &[cells, gap, _, position]: &[f64; 4],
    direction: [f64; 2],
) -> Result<Vec<f64>, VerifyError> {
    let [(sin, cos), (up, along)] = direction.map(|degrees| degrees.to_radians().sin_cos());
    let arm = Vector::<3>::new(cos * along, sin * along, up) * ((1.0 + 0.5 * gap) * RADIUS);
    let center = Vector::<3>::repeat(0.5) + shift::<3>(position as usize) * (RADIUS / cells);
    let centers = [center - arm, center + arm];
    let spheres = centers.map(|center| Ball::new(center, RADIUS));
    let mesh = mesh(&Refinement::to_level(level(RADIUS, cells)), &spheres)?;
    let tolerance = tolerance(gap, direction);
    let found = PairMotion::of(centers, &solve(method, tolerance, mesh, &spheres, &couette)?.twists);

    let particles = centers.map(|center| Particle::new(center, RADIUS));
    let mut flow = PairMobility::new(LinearFlow::shear(1.0, 0.5));
    let exact = PairMotion::of(centers, &flow.predict(&Configuration::at(0.0, &particles))?.twists);
    Ok(vec![
        found.normal_speed / exact.normal_speed - 1.0,
        found.line_rotation - exact.line_rotation,
        found.spin - exact.spin,
    ])
}

/// Tolerance of the solver: smaller for slow pairs, and where few positions scatter little.
fn tolerance(gap: f64, direction: [f64; 2]) -> f64 {
    if FILMS.contains(&gap) || direction != DIRECTIONS[0] { 1e-8 } else { 1e-6 }
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for method in FILM_METHODS {
        for at in table.places(method.name, ["a/h", "gap", "angle"]) {
            let [(_, cells), (_, gap), (_, angle)] = at;
            let oblique = if angle == DIRECTIONS[0][0] { "" } else { ", oblique" };
            let name = format!("approach, a/h = {cells}, gap {gap} a{oblique}");
            numbers.extend(mean_and_scatter(table, method.name, "approach", &at, &name));
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let cells = [1.6, 3.2, 6.4];
    let things = ["*a*/*h* = 1.6", "*a*/*h* = 3.2", "*a*/*h* = 6.4"];
    Plot::of_methods("gap in radii", "rms relative error of the approach", &things, |method, thing| {
        let at = |gap| [("a/h", cells[thing]), ("gap", gap), ("angle", DIRECTIONS[0][0])];
        let error = |gap| rms(&table.values("approach", method, &at(gap)));
        GAPS.into_iter().chain(FILMS).map(|gap| (gap, error(gap))).collect()
    })
}
