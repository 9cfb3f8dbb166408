//! Drag and viscosities of crystals of discs and spheres at one resolution.

use std::f64::consts::PI;

use gluey_geom::{Aabb, Matrix, Twist, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Prepared, Refinement, Stress};
use gluey_testkit::reference::{lattices_of_discs, lattices_of_spheres};
use itertools::iproduct;

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{IN_SHEARED_BOXES, Method};
use crate::norms::superficial_velocity;
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{exact_row, radius_of, shift, simple_shear, stress_of};

/// A crystal: bodies in a box with the edges of `cells`, places in shares of the box.
struct Crystal {
    name: &'static str,
    dimension: usize,
    /// Its number in the table of its dimension.
    number: f64,
    /// Numbers of cells along the edges that the box may have, but for powers of two.
    cells: &'static [[u32; 3]],
    sites: &'static [[f64; 3]],
    /// Solid fractions of the quick and of the full extent.
    fractions: [&'static [f64]; 2],
}

/// The rectangle of two discs of the hexagonal lattice has edges of 1 and `sqrt 3`; boxes are of cubes. 26/15
/// is 7e-4 off, 19/11 3e-3. This stretch changes the mean of the drags along both edges, and that of the
/// viscosities under strain and shear, in the second order only.
const CRYSTALS: &[Crystal] = &[
    Crystal {
        name: "square",
        dimension: 2,
        number: 0.0,
        cells: SQUARES,
        sites: &[[0.0; 3]],
        fractions: [&[0.2, 0.5, 0.7], &[0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75]],
    },
    Crystal {
        name: "hexagonal",
        dimension: 2,
        number: 1.0,
        cells: &[[11, 19, 0], [15, 26, 0]],
        sites: &[[0.0; 3], [0.5, 0.5, 0.0]],
        fractions: [&[0.3, 0.6, 0.75], &[0.1, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8, 0.85]],
    },
    Crystal {
        name: "SC",
        dimension: 3,
        number: 0.0,
        cells: SQUARES,
        sites: &[[0.0; 3]],
        fractions: [&[0.2, 0.45], &[0.064, 0.125, 0.2, 0.3, 0.35, 0.4, 0.45, 0.5]],
    },
    Crystal {
        name: "BCC",
        dimension: 3,
        number: 1.0,
        cells: SQUARES,
        sites: &[[0.0; 3], [0.5; 3]],
        fractions: [&[0.3, 0.5], &[0.064, 0.125, 0.2, 0.25, 0.3, 0.4, 0.45, 0.5, 0.6, 0.64]],
    },
    Crystal {
        name: "FCC",
        dimension: 3,
        number: 2.0,
        cells: SQUARES,
        sites: &[[0.0; 3], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]],
        fractions: [&[0.3], &[0.064, 0.125, 0.3, 0.4, 0.5, 0.6, 0.65, 0.7]],
    },
];

const SQUARES: &[[u32; 3]] = &[[4, 4, 4], [5, 5, 5], [6, 6, 6]];

/// Cells in a radius, about: boxes have whole numbers of them.
const RESOLUTION: f64 = 3.2;

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "crystals",
    title: "Drag and viscosities of crystals",
    text: "Square and hexagonal lattices of discs and simple, body-centred and face-centred cubic lattices of spheres in boxes with \
           periodic borders, with about 3.2 cells in a radius: relative errors of the drag on bodies that are held under a uniform \
           force, and of the relative viscosities with free bodies under strain along the axes and under shear in the plane of two of \
           them. The superficial velocity is the integral over the fluid of the mesh, films as wide as that has them, over the volume. Against spectral boundary integrals \
           (data/reference/lattices2d.csv, lattices3d.csv). The box of the hexagonal lattice has edges in the ratio 26/15 or 19/11 in \
           place of the root of three; its drag is the mean of those along both edges, and its viscosities, which are equal, have the mean \
           of their errors in both places: what the ratio does to these is of second order.",
    keys: &["crystal", "resolution", "phi"],
    measures: &["drag", "strained", "sheared", "cells in a radius"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(extent: Extent) -> Vec<Task> {
    let which = usize::from(extent == Extent::Full);
    let mut tasks = Vec::new();
    for (method, (index, crystal)) in iproduct!(IN_SHEARED_BOXES, CRYSTALS.iter().enumerate()) {
        tasks.extend(crystal.fractions[which].iter().map(|&phi| {
            let measure = if crystal.dimension == 2 { measure::<2> } else { measure::<3> };
            Task::new(method.name, &[index as f64, RESOLUTION, phi], move || measure(method, crystal, phi))
        }));
    }
    tasks
}

/// Errors of drag and viscosities, and the cells in a radius.
fn measure<const D: usize>(method: &Method, crystal: &Crystal, phi: f64) -> Result<Vec<f64>, VerifyError> {
    // One body in a unit of volume.
    let count = crystal.sites.len() as f64;
    let radius = radius_of(D, phi);
    let (cells, level) = crystal.cells::<D>(RESOLUTION / radius);
    let edge = (count / cells.iter().map(|&n| f64::from(n)).product::<f64>()).powf(1.0 / D as f64);
    let edges = Vector::<D>::from_fn(|d, _| edge * f64::from(cells[d]));
    let h = edge * 0.5f64.powi(level.into());
    let place = |site: &[f64; 3]| Vector::from_fn(|d, _| (site[d] + 0.3) * edges[d]) + shift::<D>(0) * h;
    let periods = std::array::from_fn(|d| Some(edges[d]));
    let balls: Vec<Ball<D>> =
        crystal.sites.iter().map(|site| Ball::periodic(place(site), radius, periods)).collect();
    let refinement = Refinement { coarsest: level, ..Refinement::to_level(level) };
    let domain = Aabb { lower: Vector::zeros(), upper: edges };
    let mesh = refinement.mesh(domain, cells, [true; D], &balls)?;
    let tolerance = if D == 2 { 1e-9 } else { 1e-7 };
    let mut solver = FlowSolver::new(method.params::<D>(tolerance))?;
    let mut prepared = solver.prepared(mesh, &balls)?;
    let [drag, strained, sheared] = crystal.exact(phi)?;
    let scale = if D == 2 { 1.0 } else { 6.0 * PI * radius };
    let directions = if crystal.is_isotropic() { 2 } else { 1 };
    let heights = method.heights_of_films::<D>(h);
    let held = vec![Twist::default(); balls.len()];
    let mut drags = 0.0;
    for direction in 0..directions {
        let force = |_: &Vector<D>| Vector::from_fn(|d, _| if d == direction { 1.0 } else { 0.0 });
        let conditions = Conditions::at_rest().with_force(Some(&force)).with_twists(&held);
        let velocity = superficial_velocity(&prepared.solve(&conditions)?, &balls, &heights);
        drags += 1.0 / velocity[direction];
    }
    let mut gradient = Matrix::<D>::zeros();
    (gradient[(0, 0)], gradient[(1, 1)]) = (1.0, -1.0);
    let of_bodies = stress(&mut prepared, &Conditions::in_linear_flow(&gradient))?.of_bodies(count);
    let alpha = 1.0 + 0.25 * (of_bodies[(0, 0)] - of_bodies[(1, 1)]);
    let sheared_flow = Conditions::in_linear_flow(&simple_shear());
    let beta = 1.0 + stress(&mut prepared, &sheared_flow)?.of_bodies(count)[(0, 1)];
    let mut errors = [alpha / strained - 1.0, beta / sheared - 1.0];
    if crystal.is_isotropic() {
        errors = [0.5 * (errors[0] + errors[1]); 2];
    }
    let drag = drags / f64::from(directions as u32) / scale / drag - 1.0;
    Ok(vec![drag, errors[0], errors[1], radius / h])
}

fn stress<const D: usize>(
    prepared: &mut Prepared<'_, D>,
    conditions: &Conditions<'_, D>,
) -> Result<Stress<D>, VerifyError> {
    Ok(stress_of(&prepared.solve(&conditions.with_stress())?)?.clone())
}

impl Crystal {
    /// Whether its viscosities in both places are equal.
    fn is_isotropic(&self) -> bool {
        self.name == "hexagonal"
    }

    /// Cells of level zero along the edges and the level, for about this many cells in a unit of length.
    fn cells<const D: usize>(&self, wanted: f64) -> ([u32; D], u8) {
        let count = self.sites.len() as f64;
        let density = |cells: &[u32; 3], level: u8| {
            let product = cells[..D].iter().map(|&n| f64::from(n)).product::<f64>();
            (product / count).powf(1.0 / D as f64) * f64::from(1u32 << level)
        };
        // In 3D with a coarser level at least, for multigrid.
        let coarsest = if D == 2 { 0 } else { 1 };
        let all = self.cells.iter().flat_map(|cells| (coarsest..6u8).map(move |level| (cells, level)));
        let off = |(cells, level): &(&[u32; 3], u8)| (density(cells, *level) / wanted).ln().abs();
        let (cells, level) =
            all.min_by(|a, b| off(a).total_cmp(&off(b))).expect("every crystal has numbers of cells");
        (std::array::from_fn(|d| cells[d]), level)
    }

    /// Drag and the viscosities under strain along the axes and under shear.
    fn exact(&self, phi: f64) -> Result<[f64; 3], VerifyError> {
        let (table, names) = match self.dimension {
            2 => (lattices_of_discs()?, ["drag_F_over_muU", "eta_axes_strain", "eta_shear"]),
            _ => (lattices_of_spheres()?, ["K", "alpha", "beta"]),
        };
        exact_row(&table, &[("lattice", self.number), ("phi", phi)], names)
    }
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for method in IN_SHEARED_BOXES {
        for at in table.places(method.name, ["crystal", "phi"]) {
            let [(_, index), (_, phi)] = at;
            let crystal = &CRYSTALS[index as usize];
            // The viscosities of an isotropic one are one number.
            let count = if crystal.is_isotropic() { 2 } else { 3 };
            for &measure in &CASE.measures[..count] {
                let said = match measure {
                    "drag" => "drag",
                    _ if crystal.is_isotropic() => "viscosity",
                    "strained" => "viscosity under strain along the axes",
                    _ => "viscosity under shear",
                };
                let name = format!("{said}, {}, phi = {phi}", crystal.name);
                let value = table.values(measure, method.name, &at)[0];
                numbers.push(Number::new(NumberKind::Error, name, method.name, value));
            }
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things: Vec<&str> = CRYSTALS.iter().map(|crystal| crystal.name).collect();
    Plot::of_methods("solid fraction", "relative error of the drag", &things, |method, thing| {
        let at = [("crystal", thing as f64)];
        let error = |phi| table.values("drag", method, &[&at[..], &[("phi", phi)]].concat())[0].abs();
        table.steps("phi", method, &at).into_iter().map(|phi| (phi, error(phi))).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fraction_has_a_reference_and_quick_ones_are_among_all() {
        for crystal in CRYSTALS {
            let [quick, full] = crystal.fractions;
            assert!(quick.iter().all(|phi| full.contains(phi)), "{}", crystal.name);
            for &phi in full {
                let [drag, strained, sheared] = crystal.exact(phi).unwrap();
                assert!(drag > 1.0 && strained > 1.0 && sheared > 1.0, "{} {phi}", crystal.name);
            }
            assert!(matches!(crystal.exact(0.123), Err(VerifyError::NoReference(_))));
        }
    }

    /// The least distance of two bodies is what the table says the gap is.
    #[test]
    fn bodies_are_as_far_from_each_other_as_in_the_table() {
        for (index, gap) in [(0, 0.50663), (1, 0.69355), (2, 0.030983), (3, 0.216053), (4, 0.279701)] {
            let crystal = &CRYSTALS[index];
            let (d, radius) = match crystal.dimension {
                2 => (2, (0.5 / PI).sqrt()),
                _ => (3, (0.375 / PI).cbrt()),
            };
            let count = crystal.sites.len() as f64;
            let edges = if index == 1 {
                [(2.0 / 3f64.sqrt()).sqrt(), (2.0 * 3f64.sqrt()).sqrt(), 0.0]
            } else {
                [count.powf(1.0 / d as f64); 3]
            };
            let mut least = edges[0];
            for site in &crystal.sites[1..] {
                let square: f64 = (0..d).map(|k| (site[k] * edges[k]).powi(2)).sum();
                least = least.min(square.sqrt());
            }
            assert!((least / radius - 2.0 - gap).abs() < 1e-5, "{}: {}", crystal.name, least / radius - 2.0);
        }
    }
}
