//! Two discs in the box over gap, angle and position of the lattice.

use gluey_geom::Vector;
use gluey_stokes::Refinement;
use gluey_testkit::reference::pair_2d_velocities;

use crate::case::{Case, Extent, Tables, Task, VerifyError};
use crate::method::{METHODS, Method};
use crate::number::Number;
use crate::plot::Plot;
use crate::set_up::{PairMotion, RADIUS, couette, level, mean_and_scatter, mesh, pair, shift, solve};
use crate::statistics::rms;

const POSITIONS: usize = 8;
/// Gaps in radii.
const GAPS: [f64; 4] = [1.0, 0.2, 0.1, 0.05];
/// Normal speed at 45 degrees and a gap of 0.05 radii, which the table does not have: the force that holds
/// the pair (speed times the resistance of unbounded discs) and `xi^1.5` over the speed are both nearly
/// linear in the gap; interpolated, they give 1.14740e-3 and 1.14759e-3.
const SPEED_AT_FIVE_HUNDREDTHS: f64 = 1.1475e-3;
/// Angle at which the shear presses the pair together, degrees.
const PRESSED: f64 = 135.0;

/// The chapter.
pub const CASE: Case = Case {
    name: "discs",
    title: "Two discs",
    text: "Two free discs of radius 0.05 around the centre of the unit box with u = (y - 1/2, 0) on all sides, at 8 places in \
           their cells, against body-fitted finite elements (data/reference/pair2d_velocities.csv; speed to 2e-6, the rest to \
           1e-8; the speed at a gap of 0.05 a is interpolated, to 2e-4). With the line of centres at 135 degrees: relative \
           error of the speed of approach. At 0 degrees: errors of the rotation of the line and of the spin, in units of \
           the shear rate. Cells are of equal size at the surfaces and in the gap, where not said otherwise; refined films are \
           what cases of rigid-dofs have by default.",
    keys: &["refined film", "a/h", "gap", "angle", "position"],
    measures: &["approach", "line rotation", "spin"],
    tasks,
    numbers,
    plot,
};

/// Cells per radius of the meshes of an extent.
fn cells_per_radius(extent: Extent) -> &'static [f64] {
    match extent {
        Extent::Quick => &[3.2, 6.4, 12.8],
        Extent::Full => &[3.2, 6.4, 12.8, 25.6],
    }
}

fn tasks(extent: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for method in METHODS {
        for &cells in cells_per_radius(extent) {
            tasks.extend(of_mesh(method, cells, false));
        }
        if method.refines_films {
            tasks.extend(of_mesh(method, 6.4, true));
        }
    }
    tasks
}

fn of_mesh(method: &'static Method, cells: f64, refined: bool) -> Vec<Task> {
    let pressed = GAPS.iter().map(|&gap| (gap, PRESSED));
    let level = GAPS[..3].iter().map(|&gap| (gap, 0.0));
    let places = pressed.chain(level).flat_map(|(gap, angle)| (0..POSITIONS).map(move |k| (gap, angle, k)));
    let task = |(gap, angle, k)| {
        let at = [f64::from(u8::from(refined)), cells, gap, angle, k as f64];
        Task::new(method.name, &at, move || measure(method, &at))
    };
    places.map(task).collect()
}

fn measure(
    method: &Method,
    &[refined, cells, gap, angle, position]: &[f64; 5],
) -> Result<Vec<f64>, VerifyError> {
    let refinement =
        Refinement { gap_fraction: refined, gap_levels: 9, ..Refinement::to_level(level(RADIUS, cells)) };
    let center = Vector::<2>::repeat(0.5) + shift::<2>(position as usize) * (RADIUS / cells);
    let discs = pair(center, RADIUS, gap, angle);
    let flow = solve(method, 1e-9, mesh(&refinement, &discs)?, &discs, &couette)?;
    let found = PairMotion::of(discs.map(|disc| *disc.center()), &flow.twists);
    let exact = exact(gap, angle)?;
    let approach = match angle {
        PRESSED => found.normal_speed / exact.normal_speed - 1.0,
        _ => found.normal_speed / RADIUS,
    };
    Ok(vec![approach, found.line_rotation - exact.line_rotation, found.spin - exact.spin])
}

/// The exact motion. At 135 degrees it is that at 45 with the speed reversed; the line and the discs turn
/// with the flow there.
fn exact(gap: f64, angle: f64) -> Result<PairMotion, VerifyError> {
    let table = pair_2d_velocities()?;
    let (degrees, sign) = if angle == PRESSED { (45.0, -1.0) } else { (angle, 1.0) };
    let (gaps, angles) = (table.column("xi")?, table.column("theta_deg")?);
    let row = (0..table.row_count()).find(|&row| gaps[row] == gap && angles[row] == degrees);
    match row {
        Some(row) => Ok(PairMotion {
            normal_speed: sign * table.column("vn")?[row],
            line_rotation: table.column("rot")?[row],
            spin: table.column("omega1")?[row],
        }),
        None if gap == 0.05 && angle == PRESSED => {
            Ok(PairMotion { normal_speed: -SPEED_AT_FIVE_HUNDREDTHS, line_rotation: -0.5, spin: -0.5 })
        }
        None => Err(VerifyError::NoReference(format!("a gap of {gap} radii at {angle} degrees"))),
    }
}

fn numbers(tables: &Tables) -> Vec<Number> {
    let table = tables.of(CASE.name);
    let mut numbers = Vec::new();
    for method in METHODS {
        for refined in [0.0, 1.0] {
            for cells in table.steps("a/h", method.name, &[("refined film", refined)]) {
                let mesh = if refined == 0.0 { "" } else { ", refined film" };
                for (measure, angle, gaps) in [
                    ("approach", PRESSED, &GAPS[..]),
                    ("line rotation", 0.0, &GAPS[..3]),
                    ("spin", 0.0, &GAPS[..3]),
                ] {
                    for &gap in gaps {
                        let at = [("refined film", refined), ("a/h", cells), ("gap", gap), ("angle", angle)];
                        let name = format!("{measure}, a/h = {cells}{mesh}, gap {gap} a");
                        numbers.extend(mean_and_scatter(&table, method.name, measure, &at, &name));
                    }
                }
            }
        }
    }
    numbers
}

fn plot(tables: &Tables) -> Plot {
    let table = tables.of(CASE.name);
    let cells = [3.2, 6.4, 12.8, 25.6];
    let things = ["*a*/*h* = 3.2", "*a*/*h* = 6.4", "*a*/*h* = 12.8", "*a*/*h* = 25.6"];
    Plot::of_methods("gap in radii", "rms relative error of the approach", &things, |method, thing| {
        let at = |gap| [("refined film", 0.0), ("a/h", cells[thing]), ("gap", gap), ("angle", PRESSED)];
        GAPS.map(|gap| (gap, rms(&table.values("approach", method, &at(gap))))).to_vec()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interpolated_speed_lies_between_its_neighbours_on_a_smooth_curve() {
        let force = |gap: f64| gap.powf(1.5) / exact(gap, PRESSED).unwrap().normal_speed;
        let between = force(0.1) + (force(0.2) - force(0.1)) * (0.05 - 0.1) / 0.1;
        assert!((force(0.05) / between - 1.0).abs() < 3e-3, "{} {between}", force(0.05));
    }

    #[test]
    fn what_the_reference_does_not_have_is_an_error() {
        assert!(matches!(exact(0.3, PRESSED), Err(VerifyError::NoReference(_))));
        assert!(matches!(exact(0.05, 0.0), Err(VerifyError::NoReference(_))));
    }
}
