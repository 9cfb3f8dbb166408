//! Drag of fixed lattices of discs and spheres between periodic borders.

use std::f64::consts::PI;

use gluey_geom::{Aabb, Dim, Space, Twist, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Refinement};
use gluey_testkit::reference::{lattices_of_discs, lattices_of_spheres};

use crate::case::{Case, Extent, Tables, Task, VerifyError};
use crate::method::{METHODS, Method};
use crate::norms::superficial_velocity;
use crate::number::{Kind, Number};
use crate::plot::Plot;
use crate::set_up::shift;
use crate::statistics::{mean, rms};

/// Solid fractions on the square and on the simple cubic lattice. At the last one gaps are 0.12 a and 0.03 a.
const FRACTIONS: [&[f64]; 2] = [&[0.1, 0.3, 0.5, 0.7], &[0.064, 0.2, 0.35, 0.5]];

/// The chapter.
pub const CASE: Case = Case {
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
    numbers,
    plot,
};

const POSITIONS: usize = 2;

/// Finest levels in 2D and 3D.
fn levels(extent: Extent) -> [&'static [u8]; 2] {
    match extent {
        Extent::Quick => [&[4, 5, 6], &[3, 4]],
        Extent::Full => [&[4, 5, 6, 7], &[3, 4, 5]],
    }
}

fn tasks(extent: Extent) -> Vec<Task> {
    let [plane, space] = levels(extent);
    let mut tasks = Vec::new();
    for method in METHODS.iter().filter(|method| method.holds_bodies) {
        plane.iter().for_each(|&level| tasks.extend(of_mesh::<2>(method, level, FRACTIONS[0])));
        space.iter().for_each(|&level| tasks.extend(of_mesh::<3>(method, level, FRACTIONS[1])));
    }
    tasks
}

fn of_mesh<const D: usize>(
    method: &'static Method,
    level: u8,
    fractions: &[f64],
) -> impl Iterator<Item = Task>
where
    Dim<D>: Space<D>,
{
    let places = fractions.iter().flat_map(|&phi| (0..POSITIONS).map(move |k| (phi, k)));
    places.map(move |(phi, k)| {
        let at = [D as f64, 2f64.powi(level.into()), phi, k as f64];
        Task::new(method.name, &at, move || measure::<D>(method, level, phi, k))
    })
}

fn measure<const D: usize>(
    method: &Method,
    level: u8,
    phi: f64,
    position: usize,
) -> Result<Vec<f64>, VerifyError>
where
    Dim<D>: Space<D>,
{
    let radius = radius(D, phi);
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

/// Radius of a body that takes this share of the unit box.
fn radius(dimension: usize, phi: f64) -> f64 {
    if dimension == 2 { (phi / PI).sqrt() } else { (0.75 * phi / PI).cbrt() }
}

fn exact(dimension: usize, phi: f64) -> Result<f64, VerifyError> {
    let (table, name) = match dimension {
        2 => (lattices_of_discs()?, "drag_F_over_muU"),
        _ => (lattices_of_spheres()?, "K"),
    };
    // The first lattice of each table.
    let lattices = table.column("lattice")?.iter();
    let row = lattices.zip(table.column("phi")?).position(|(&lattice, &x)| lattice == 0.0 && x == phi);
    let row = row.ok_or_else(|| VerifyError::NoReference(format!("a solid fraction of {phi}")))?;
    Ok(table.column(name)?[row])
}

fn numbers(tables: &Tables) -> Vec<Number> {
    let table = tables.of(CASE.name);
    let mut numbers = Vec::new();
    for method in METHODS.iter().filter(|method| method.holds_bodies) {
        for dimension in [2.0, 3.0] {
            for cells in table.steps("cells", method.name, &[("dimension", dimension)]) {
                let at = [("dimension", dimension), ("cells", cells)];
                for phi in table.steps("phi", method.name, &at) {
                    let at = [&at[..], &[("phi", phi)]].concat();
                    let name = format!("drag, {dimension}D, {cells} cells, phi = {phi}");
                    let drag = mean(&table.values("drag", method.name, &at));
                    numbers.push(Number::new(Kind::Error, name, method.name, drag));
                }
            }
            let forces = table.values("force", method.name, &[("dimension", dimension)]);
            let name = format!("force on the body and on the box, {dimension}D");
            numbers.push(Number::new(Kind::Size, name, method.name, rms(&forces)));
        }
    }
    numbers
}

fn plot(tables: &Tables) -> Plot {
    let table = tables.of(CASE.name);
    let things = ["2D, *φ* = 0.1", "2D, *φ* = 0.7", "3D, *φ* = 0.064", "3D, *φ* = 0.5"];
    Plot::of_methods(
        "cells per edge of the box",
        "rms relative error of the drag",
        &things,
        |method, thing| {
            let fractions = FRACTIONS[thing / 2];
            let phi = fractions[if thing % 2 == 0 { 0 } else { fractions.len() - 1 }];
            let at = [("dimension", (2 + thing / 2) as f64), ("phi", phi)];
            let error = |cells| rms(&table.values("drag", method, &[&at[..], &[("cells", cells)]].concat()));
            table.steps("cells", method, &at).into_iter().map(|cells| (cells, error(cells))).collect()
        },
    )
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
