//! Drag of fixed lattices of discs and spheres between periodic borders.

use std::f64::consts::PI;

use gluey_geom::{Aabb, Twist, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Refinement};
use gluey_testkit::reference::{lattices_of_discs, lattices_of_spheres};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{METHODS, Method, holding};
use crate::norms::superficial_velocity;
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{exact_row, radius_of, shift};
use crate::statistics::{mean, rms};

/// Solid fractions on the square and on the simple cubic lattice. At the last one gaps are 0.12 a and 0.03 a.
const FRACTIONS: [&[f64]; 2] = [&[0.1, 0.3, 0.5, 0.7], &[0.064, 0.2, 0.35, 0.5]];

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "lattices",
    title: "Drag of fixed lattices",
    text: "A body that is held in a box with periodic borders under a uniform force along x: the square lattice of discs and the \
           simple cubic lattice of spheres. Relative error of the drag F/(mu U) or F/(6 pi mu a U), with the force F on the box and the \
           superficial velocity U, the integral of the velocity in the fluid over the volume of the box. Against spectral \
           boundary integrals (data/reference/lattices2d.csv, lattices3d.csv: 1e-9; they agree with Zick and Homsy 1982, \
           10.1017/S0022112082000627, and Sangani and Acrivos 1982, 10.1016/0301-9322(82)90029-5). Cells per edge of the box, \
           those away from the surface may be larger; two places of the body in its cell.",
    keys: &["dimension", "cells", "phi", "position"],
    measures: &["drag", "force"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

const POSITIONS: usize = 2;

/// Finest levels in 2D and 3D.
fn levels(extent: Extent) -> [&'static [u8]; 2] {
    extent.pick([&[4, 5, 6], &[3, 4]], [&[4, 5, 6, 7], &[3, 4, 5]])
}

fn tasks(extent: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (method, d) in iproduct!(holding(METHODS), [2, 3]) {
        let measure = if d == 2 { measure::<2> } else { measure::<3> };
        for (&level, &phi, k) in iproduct!(levels(extent)[d - 2], FRACTIONS[d - 2], 0..POSITIONS) {
            let at = [d as f64, 2f64.powi(level.into()), phi, k as f64];
            tasks.push(Task::new(method.name, &at, move || measure(method, level, phi, k)));
        }
    }
    tasks
}

fn measure<const D: usize>(
    method: &Method,
    level: u8,
    phi: f64,
    position: usize,
) -> Result<Vec<f64>, VerifyError> {
    let radius = radius_of(D, phi);
    let center = Vector::repeat(0.5) + shift::<D>(position) * 0.5f64.powi(level.into());
    let ball = [Ball::periodic(center, radius, [Some(1.0); D])];
    let refinement = Refinement { coarsest: level.min(3), ..Refinement::to_level(level) };
    let mesh = refinement.mesh(Aabb::unit(), [1; D], [true; D], &ball)?;
    let mesh_size = mesh.size(level);
    let (still, force) = ([Twist::default()], |_: &Vector<D>| along_x());
    let conditions = Conditions::at_rest().with_force(Some(&force)).with_twists(&still);
    let tolerance = if D == 2 { 1e-9 } else { 1e-7 };
    let flow = FlowSolver::new(method.params::<D>(tolerance))?.solve_under(mesh, &ball, &conditions)?;
    let drag = 1.0 / superficial_velocity(&flow, &ball, &method.heights_of_films::<D>(mesh_size))[0];
    let scale = if D == 2 { 1.0 } else { 6.0 * PI * radius };
    Ok(vec![drag / scale / exact(D, phi)? - 1.0, -flow.wrenches[0].force[0] - 1.0])
}

fn along_x<const D: usize>() -> Vector<D> {
    Vector::from_fn(|d, _| if d == 0 { 1.0 } else { 0.0 })
}

fn exact(dimension: usize, phi: f64) -> Result<f64, VerifyError> {
    // The first lattice of each table.
    let at = [("lattice", 0.0), ("phi", phi)];
    let [drag] = match dimension {
        2 => exact_row(&lattices_of_discs()?, &at, ["drag_F_over_muU"])?,
        _ => exact_row(&lattices_of_spheres()?, &at, ["K"])?,
    };
    Ok(drag)
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (method, dimension) in iproduct!(holding(METHODS), [2.0, 3.0]) {
        for at in table.places(method.name, ["dimension", "cells", "phi"]) {
            let [(_, own), (_, cells), (_, phi)] = at;
            if own == dimension {
                let name = format!("drag, {dimension}D, {cells} cells, phi = {phi}");
                let drag = mean(&table.values("drag", method.name, &at));
                numbers.push(Number::new(NumberKind::Error, name, method.name, drag));
            }
        }
        let forces = table.values("force", method.name, &[("dimension", dimension)]);
        let name = format!("force on the body and on the box, {dimension}D");
        numbers.push(Number::new(NumberKind::Size, name, method.name, rms(&forces)));
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["2D, *φ* = 0.1", "2D, *φ* = 0.7", "3D, *φ* = 0.064", "3D, *φ* = 0.5"];
    let (x, y) = ("cells per edge of the box", "rms relative error of the drag");
    Plot::of_methods(x, y, &things, |method, thing| {
        let fractions = FRACTIONS[thing / 2];
        let phi = fractions[if thing % 2 == 0 { 0 } else { fractions.len() - 1 }];
        let at = [("dimension", (2 + thing / 2) as f64), ("phi", phi)];
        let error = |cells| rms(&table.values("drag", method, &[&at[..], &[("cells", cells)]].concat()));
        table.steps("cells", method, &at).into_iter().map(|cells| (cells, error(cells))).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Powers of `phi^(1/3)` in the inverse of the drag of spheres (Sangani and Acrivos 1982,
    /// 10.1016/0301-9322(82)90047-7), and `4 pi / (-ln(phi)/2 - 0.738 + phi)`, the drag of discs.
    #[test]
    fn dilute_lattices_have_the_drag_of_their_expansions() {
        let powers = [(0, 1.0), (1, -1.7601), (3, 1.0), (6, -1.5593), (8, 3.9799), (10, -3.0734)];
        let inverse: f64 = powers.iter().map(|&(power, weight)| weight * 0.4f64.powi(power)).sum();
        assert!((exact(3, 0.064).unwrap() * inverse - 1.0).abs() < 1e-3, "{inverse}");
        let disc = |phi: f64| 4.0 * PI / (-0.5 * phi.ln() - 0.738 + phi);
        assert!((exact(2, 0.01).unwrap() / disc(0.01) - 1.0).abs() < 1e-3, "{}", disc(0.01));
    }

    #[test]
    fn every_fraction_has_a_reference_and_others_have_none() {
        for (dimension, fractions) in [2, 3].into_iter().zip(FRACTIONS) {
            assert!(fractions.iter().all(|&phi| exact(dimension, phi).is_ok()));
            assert!(matches!(exact(dimension, 0.123), Err(VerifyError::NoReference(_))));
        }
    }
}
