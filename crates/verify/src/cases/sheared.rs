//! Lattices of free bodies in boxes that are sheared.

use gluey_geom::{Dim, Lattice, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, Flow, FlowSolver};
use gluey_testkit::reference::{sheared_simple_cubic_lattice, sheared_square_lattice};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{IN_SHEARED_BOXES, Method};
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{exact_row, periodic_mesh, radius_of, shift, simple_shear, stress_of};
use crate::statistics::rms;

/// Solid fractions of the square and of the simple cubic lattice.
const FRACTIONS: [&[f64]; 2] = [&[0.1, 0.3], &[0.1, 0.3]];
/// Strains of the cell.
const STRAINS: [f64; 4] = [0.0, 0.1, 0.3, 0.5];

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "sheared",
    title: "Sheared lattices",
    text: "A free body in simple shear in a box that is periodic in all directions, whose images slide along each other: the square \
           lattice of discs and the simple cubic lattice of spheres at several strains of the cell. Errors of the relative viscosity \
           (relative), of the normal stress differences (over the excess of the viscosity) and of the spin, and the relative \
           difference of the viscosities by the stresslet and by the power dissipated. Against spectral boundary integrals \
           (data/reference/sheared_square2d.csv, sheared_sc3d.csv). Cells per edge of the box, all of one size; the body is anywhere \
           in its cell.",
    keys: &["dimension", "cells", "phi", "strain"],
    measures: &["viscosity", "normal", "spin", "routes"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

/// Finest levels in 2D and 3D.
fn levels(extent: Extent) -> [&'static [u8]; 2] {
    extent.pick([&[4, 5], &[3]], [&[4, 5, 6], &[3, 4]])
}

fn tasks(extent: Extent) -> Vec<Task> {
    let mut tasks = Vec::new();
    for (method, d) in iproduct!(IN_SHEARED_BOXES, [2, 3]) {
        let measure = if d == 2 { measure::<2> } else { measure::<3> };
        for (&level, &phi, strain) in iproduct!(levels(extent)[d - 2], FRACTIONS[d - 2], STRAINS) {
            let at = [d as f64, 2f64.powi(level.into()), phi, strain];
            tasks.push(Task::new(method.name, &at, move || measure(method, level, phi, strain)));
        }
    }
    tasks
}

fn measure<const D: usize>(
    method: &Method,
    level: u8,
    phi: f64,
    strain: f64,
) -> Result<Vec<f64>, VerifyError> {
    let flow = flow::<D>(method, level, phi, strain)?;
    let stress = stress_of(&flow)?;
    let of_body = stress.of_bodies(1.0);
    let viscosity = 1.0 + of_body[(0, 1)];
    let normal = |d: usize, e: usize| of_body[(d, d)] - of_body[(e, e)];
    let spin = Dim::<D>::spin_slice(&flow.twists[0].spin)[Dim::<D>::ROT - 1] - 0.5;
    let exact = exact(D, phi, strain)?;
    let [eta, n1, n2, omega] = exact;
    let miss = (normal(0, 1) - n1).abs().max(if D == 3 { (normal(1, D - 1) - n2).abs() } else { 0.0 });
    let routes = stress.dissipation / viscosity - 1.0;
    Ok(vec![viscosity / eta - 1.0, miss / (eta - 1.0), spin - omega, routes])
}

fn flow<const D: usize>(method: &Method, level: u8, phi: f64, strain: f64) -> Result<Flow<D>, VerifyError> {
    let place = Vector::repeat(0.5) + shift::<D>((100.0 * strain) as usize);
    let lattice = Lattice::new([Some(1.0); D]).tilted(strain);
    let ball = [Ball::in_space(&place, radius_of(D, phi), &lattice, 0.0)];
    let mesh = periodic_mesh(level, &ball)?;
    let conditions = Conditions::in_linear_flow(&simple_shear::<D>()).with_stress();
    let tolerance = if D == 2 { 1e-9 } else { 1e-7 };
    Ok(FlowSolver::new(method.params::<D>(tolerance))?.solve_under(mesh, &ball, &conditions)?)
}

/// Relative viscosity, normal stress differences and spin.
fn exact(dimension: usize, phi: f64, strain: f64) -> Result<[f64; 4], VerifyError> {
    let at = [("phi", phi), ("strain", strain)];
    if dimension == 3 {
        return exact_row(&sheared_simple_cubic_lattice()?, &at, ["eta_r", "N1", "N2", "omega_z"]);
    }
    let [eta, n1, omega] = exact_row(&sheared_square_lattice()?, &at, ["eta_r", "N1", "omega"])?;
    Ok([eta, n1, 0.0, omega])
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for method in IN_SHEARED_BOXES {
        for (at, measure) in iproduct!(table.places(method.name, ["dimension", "cells"]), CASE.measures) {
            let [(_, dimension), (_, cells)] = at;
            let name = format!("{measure}, {dimension}D, {cells} cells");
            let values = table.values(measure, method.name, &at);
            let largest = values.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
            numbers.push(Number::new(NumberKind::Error, name, method.name, largest));
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["2D, viscosity", "2D, normal stress", "3D, viscosity", "3D, normal stresses"];
    Plot::of_methods("cells per edge of the box", "rms error", &things, |method, thing| {
        let at = [("dimension", (2 + thing / 2) as f64)];
        let measure = if thing % 2 == 0 { "viscosity" } else { "normal" };
        let error = |cells| rms(&table.values(measure, method, &[&at[..], &[("cells", cells)]].concat()));
        table.steps("cells", method, &at).into_iter().map(|cells| (cells, error(cells))).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_a_reference_and_others_have_none() {
        for (dimension, fractions) in [2, 3].into_iter().zip(FRACTIONS) {
            for (&phi, strain) in fractions.iter().flat_map(|phi| STRAINS.map(|strain| (phi, strain))) {
                let [viscosity, n1, _, spin] = exact(dimension, phi, strain).unwrap();
                assert!(viscosity > 1.0 + 1.9 * phi && n1 <= 0.0 && (-0.5..-0.4).contains(&spin));
            }
            assert!(matches!(exact(dimension, 0.1, 0.123), Err(VerifyError::NoReference(_))));
        }
    }
}
