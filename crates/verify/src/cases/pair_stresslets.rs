//! Stresslets of two free spheres in a strain.

use std::f64::consts::PI;

use gluey_geom::{Aabb, Matrix, Vector};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Refinement};
use gluey_testkit::exact::{PairStrain, pair_in_strain};

use crate::case::{CaseTable, VerificationCase, VerifyError};
use crate::method::Method;
use crate::plot::Plot;
use crate::set_up::{SpherePairs, level, shift, stress_of};
use crate::statistics::rms;

/// Radius in the unit box, which is periodic.
const RADIUS: f64 = 0.0125;
/// Gaps in radii; in all but the first two films act that no mesh here resolves.
const GAPS: [f64; 6] = [1.0, 0.5, 0.2, 0.1, 0.05, 0.01];
/// Cells per radius.
const MESHES: [f64; 2] = [1.6, 3.2];

const PAIRS: SpherePairs = SpherePairs { meshes: &MESHES, gaps: &GAPS };

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "pair-stresslets",
    title: "Stresslets of two spheres",
    text: "Two free spheres of radius 0.0125 in a periodic unit box in a strain: along the line of centres and across it on both sides \
           (along), in a plane with it, so that it turns (tilting), and across it alone (across); the line of centres has different \
           directions and places in the cells. Relative error of the mean stresslet against two spheres in unbounded fluid, by multipoles \
           around both centres (exact to 1e-7; the same computation agrees with the table of velocities and spins of Batchelor and Green \
           1972 to 1e-8 and gives 5.002 for the second coefficient of the viscosity). The box changes stresslets by 1.6e-5, which is \
           taken out.",
    keys: &["a/h", "gap", "position"],
    measures: &["along", "tilting", "across"],
    tasks: |extent| PAIRS.tasks(extent, measure),
    numbers: |tables| PAIRS.numbers(&tables.of(CASE.name), CASE.measures, "stresslet, "),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn measure(method: &Method, cells: f64, gap: f64, position: usize) -> Result<Vec<f64>, VerifyError> {
    let level = level(RADIUS, cells);
    let axes = axes(position);
    let middle = Vector::<3>::repeat(0.5) + shift::<3>(position) * 0.5f64.powi(level.into());
    let ball = |side: f64| {
        let center = middle + axes[2] * (side * (1.0 + 0.5 * gap) * RADIUS);
        Ball::periodic(center, RADIUS, [Some(1.0); 3])
    };
    let pair = [ball(-1.0), ball(1.0)];
    let mesh = Refinement::to_level(level).mesh(Aabb::unit(), [1; 3], [true; 3], &pair)?;
    let mut solver = FlowSolver::new(method.params::<3>(1e-8))?;
    let mut prepared = solver.prepared(mesh, &pair)?;
    let mut errors = Vec::new();
    for strain in PairStrain::ALL {
        let matrix: Matrix<3> = strain.matrix(&axes);
        let flow = prepared.solve(&Conditions::in_linear_flow(&matrix).with_stress())?;
        let sum = stress_of(&flow)?.of_bodies(1.0).dot(&matrix) / matrix.norm_squared();
        let images = 1.0 + 2.0 * 4.0 / 3.0 * PI * RADIUS.powi(3);
        let found = 0.5 * sum / (20.0 / 3.0 * PI * RADIUS.powi(3)) / images;
        errors.push(found / pair_in_strain(strain, gap).stresslet - 1.0);
    }
    Ok(errors)
}

/// Orthonormal axes that differ with the position, the line of centres last.
pub(super) fn axes(position: usize) -> [Vector<3>; 3] {
    let random = shift::<3>(position + 5) + Vector::repeat(0.5);
    let (sin, cos) = (2.0 * PI * random[0]).sin_cos();
    let up = 2.0 * random[1] - 1.0;
    let across = (1.0 - up * up).sqrt();
    let line = Vector::<3>::new(across * cos, across * sin, up);
    let (side, other) = (Vector::<3>::new(-sin, cos, 0.0), Vector::<3>::new(-up * cos, -up * sin, across));
    let (turn_sin, turn_cos) = (2.0 * PI * random[2]).sin_cos();
    [side * turn_cos + other * turn_sin, other * turn_cos - side * turn_sin, line]
}

fn plot(table: &CaseTable) -> Plot {
    let things =
        ["along, *a*/*h* = 1.6", "along, *a*/*h* = 3.2", "tilting, *a*/*h* = 3.2", "across, *a*/*h* = 3.2"];
    Plot::of_methods("gap in radii", "rms relative error of the stresslet", &things, |method, thing| {
        let cells = if thing == 0 { MESHES[0] } else { MESHES[1] };
        let measure = CASE.measures[thing.saturating_sub(1)];
        let error = |gap| rms(&table.values(measure, method, &[("a/h", cells), ("gap", gap)]));
        GAPS.into_iter().map(|gap| (gap, error(gap))).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_orthonormal() {
        for position in 0..8 {
            let axes = Matrix::<3>::from_columns(&axes(position));
            assert!((axes.transpose() * axes - Matrix::identity()).amax() < 1e-15);
        }
    }
}
