//! Several free discs in a periodic cell in shear.

use gluey_geom::{Lattice, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver};
use gluey_testkit::reference::cells_of_discs;
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{IN_SHEARED_BOXES, Method};
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{periodic_mesh, simple_shear, stress_of};

/// Cells in the table, by their number of discs.
const CELLS: [usize; 2] = [2, 8];

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "cells",
    title: "Cells of several discs",
    text: "Two cells with 2 and 8 free discs at random places (solid fractions 0.1 and 0.2, smallest gaps 2 and 0.11 radii) in simple \
           shear, periodic in both directions: largest errors of the velocities relative to the flow (over the shear rate times the period) and of the spins, \
           relative error of the viscosity, error of the normal stress difference over the excess of the viscosity. Against spectral \
           boundary integrals (data/reference/cells2d.csv, 2e-8).",
    keys: &["discs", "cells"],
    measures: &["velocity", "spin", "viscosity", "normal"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(extent: Extent) -> Vec<Task> {
    let levels: &[u8] = if extent == Extent::Quick { &[4, 5] } else { &[4, 5, 6, 7] };
    let places = iproduct!(IN_SHEARED_BOXES, CELLS.into_iter().enumerate(), levels);
    let task = |(method, (index, discs), &level): (&'static Method, (usize, usize), &u8)| {
        let at = [discs as f64, 2f64.powi(level.into())];
        Task::new(method.name, &at, move || measure(method, index, level))
    };
    places.map(task).collect()
}

fn measure(method: &Method, index: usize, level: u8) -> Result<Vec<f64>, VerifyError> {
    let table = cells_of_discs()?;
    let numbers = table.column("cell")?;
    let rows: Vec<usize> = (0..table.row_count()).filter(|&row| numbers[row] == index as f64).collect();
    let column = |name: &str| -> Result<Vec<f64>, VerifyError> {
        let column = table.column(name)?;
        Ok(rows.iter().map(|&row| column[row]).collect())
    };
    let [x, y, u, v, spin] = [column("x")?, column("y")?, column("u")?, column("v")?, column("omega")?];
    let [radius, strain] = [column("radius")?[0], column("strain")?[0]];
    let lattice = Lattice::new([Some(1.0); 2]).tilted(strain);
    let ball = |(x, y): (&f64, &f64)| Ball::in_space(&Vector::<2>::new(*x, *y), radius, &lattice, 0.0);
    let balls: Vec<Ball<2>> = x.iter().zip(&y).map(ball).collect();
    let mesh = periodic_mesh(level, &balls)?;
    let conditions = Conditions::in_linear_flow(&simple_shear::<2>()).with_stress();
    let flow = FlowSolver::new(method.params::<2>(1e-9))?.solve_under(mesh, &balls, &conditions)?;
    let of_bodies = stress_of(&flow)?.of_bodies(1.0);
    let [eta, n1] = [column("eta_r")?[0], column("N1")?[0]];
    let (mut velocity, mut turn) = (0.0f64, 0.0f64);
    for (k, twist) in flow.twists.iter().enumerate() {
        velocity = velocity.max((twist.velocity - Vector::<2>::new(u[k], v[k])).norm());
        turn = turn.max((twist.spin[0] - 0.5 - spin[k]).abs());
    }
    let normal = of_bodies[(0, 0)] - of_bodies[(1, 1)] - n1;
    Ok(vec![velocity, turn, (1.0 + of_bodies[(0, 1)]) / eta - 1.0, normal / (eta - 1.0)])
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for method in IN_SHEARED_BOXES {
        for (at, &measure) in iproduct!(table.places(method.name, ["discs", "cells"]), CASE.measures) {
            let [(_, discs), (_, cells)] = at;
            let kind =
                if matches!(measure, "velocity" | "spin") { NumberKind::Size } else { NumberKind::Error };
            let name = format!("{measure}, {discs} discs, {cells} cells");
            numbers.push(Number::new(kind, name, method.name, table.values(measure, method.name, &at)[0]));
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["2 discs, velocity", "2 discs, spin", "8 discs, velocity", "8 discs, spin"];
    Plot::of_methods("cells per edge of the box", "largest error", &things, |method, thing| {
        let at = [("discs", CELLS[thing / 2] as f64)];
        let measure = CASE.measures[thing % 2];
        let error = |cells| table.values(measure, method, &[&at[..], &[("cells", cells)]].concat())[0];
        table.steps("cells", method, &at).into_iter().map(|cells| (cells, error(cells))).collect()
    })
}
