//! One disc in the box, over positions of the lattice under it.

use gluey_geom::Vector;
use gluey_levelset::Ball;
use gluey_stokes::Refinement;
use gluey_testkit::reference::single_2d_velocities;
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{METHODS, Method};
use crate::number::Number;
use crate::plot::Plot;
use crate::set_up::{RADIUS, couette, level, mesh, shift, solve};
use crate::statistics::fit;

const POSITIONS: usize = 16;
const CELLS_PER_RADIUS: [f64; 3] = [3.2, 6.4, 12.8];

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "disc",
    title: "One disc",
    text: "A free disc of radius a = 0.05 at (0.5, 0.7) in the unit box with u = (y - 1/2, 0) on all sides: velocity and spin \
           against body-fitted finite elements of degree 8 (data/reference/single2d_velocities.csv, error 2e-8). The disc is \
           moved by parts of a cell to 16 places. What the walls change is smooth in this shift (s, t) and even in s: the sum of 1, t, s^2 \
           and t^2 closest to the errors is taken; its value at no shift is the mean error, the deviation from it the \
           scatter. Velocities are in units of the radius times the shear rate, spins in units of the shear rate.",
    keys: &["a/h", "shift x", "shift y"],
    measures: &["velocity", "spin"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(_: Extent) -> Vec<Task> {
    let task = |(method, cells, k): (&'static Method, f64, usize)| {
        let shift = shift::<2>(k);
        Task::new(method.name, &[cells, shift[0], shift[1]], move || measure(method, cells, shift))
    };
    iproduct!(METHODS, CELLS_PER_RADIUS, 0..POSITIONS).map(task).collect()
}

fn measure(method: &Method, cells: f64, shift: Vector<2>) -> Result<Vec<f64>, VerifyError> {
    let reference = single_2d_velocities()?;
    let exact = |name: &str| Ok::<_, VerifyError>(reference.column(name)?[1]);
    let shift = shift * (RADIUS / cells);
    let disc = [Ball::new(Vector::<2>::new(exact("x")?, exact("y")?) + shift, RADIUS)];
    let mesh = mesh(&Refinement::to_level(level(RADIUS, cells)), &disc)?;
    let twist = solve(method, 1e-9, mesh, &disc, &couette)?.twists[0];
    Ok(vec![(twist.velocity[0] - shift[1] - exact("Ux")?) / RADIUS, twist.spin[0] - exact("omega")?])
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let number = |(cells, measure, method): (f64, &&str, &Method)| {
        let (mean, scatter) = mean_and_scatter(table, method.name, measure, cells);
        Number::mean_and_scatter(&format!("{measure}, a/h = {cells}"), method.name, mean, scatter)
    };
    iproduct!(CELLS_PER_RADIUS, CASE.measures, METHODS).flat_map(number).collect()
}

/// Of the errors less what the walls make of the shift.
fn mean_and_scatter(table: &CaseTable, method: &str, measure: &str, cells: f64) -> (f64, f64) {
    let values = |name| table.values(name, method, &[("a/h", cells)]);
    let shifts = values("shift x").into_iter().zip(values("shift y"));
    let basis: Vec<[f64; 4]> = shifts.map(|(s, t)| [1.0, t, s * s, t * t]).collect();
    let (coefficients, scatter) = fit(&basis, &values(measure));
    (coefficients[0], scatter)
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["velocity, mean", "velocity, scatter", "spin, mean", "spin, scatter"];
    Plot::of_methods("cells per radius *a*/*h*", "error", &things, |method, thing| {
        let point = |cells| {
            let (mean, scatter) = mean_and_scatter(table, method, CASE.measures[thing / 2], cells);
            (cells, if thing % 2 == 0 { mean.abs() } else { scatter })
        };
        CELLS_PER_RADIUS.map(point).to_vec()
    })
}
