//! How two spheres move of which one is twice as large as the other.

use gluey_geom::{Aabb, Matrix, Spin, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_stokes::{Conditions, FlowSolver, Refinement};
use gluey_testkit::exact::PairStrain;
use gluey_testkit::reference::spheres_one_to_two;

use super::pair_stresslets::axes;
use crate::case::{CaseTable, VerificationCase, VerifyError};
use crate::method::Method;
use crate::plot::Plot;
use crate::set_up::{SpherePairs, exact_row, level, shift};
use crate::statistics::rms;

/// Radii in the unit box, which is periodic.
const RADII: [f64; 2] = [0.0125, 0.025];
/// Gaps in smaller radii.
const GAPS: [f64; 5] = [1.0, 0.3, 0.1, 0.01, 0.001];
/// Cells in the smaller radius.
const MESHES: [f64; 2] = [1.6, 3.2];

const PAIRS: SpherePairs = SpherePairs { meshes: &MESHES, gaps: &GAPS };

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "unequal-pairs",
    title: "Two spheres, one twice as large",
    text: "Two free spheres of radii 0.0125 and 0.025 in a periodic unit box: the speed at which they approach in a strain along the line \
           of centres, the rate at which the line turns and both spins in a strain that is tilted, and the velocities that they take \
           from opposite forces in the middle of the gap, along the line (pushed) and across it (dragged). Relative errors against two spheres in \
           unbounded fluid (data/reference/sphere_pair_1to2.csv). The box changes these by 4e-4 at most. The line of centres has \
           different directions and places in the cells. Nothing in the formulation was chosen on spheres of different sizes.",
    keys: &["a/h", "gap", "position"],
    measures: &["approach", "turning", "spin of the smaller", "spin of the larger", "pushed", "dragged"],
    tasks: |extent| PAIRS.tasks(extent, measure),
    numbers: |tables| PAIRS.numbers(&tables.of(CASE.name), CASE.measures, ""),
    plot: |tables| plot(&tables.of(CASE.name)),
};

/// Columns of the reference, in the order of the measures.
const COLUMNS: [&str; 6] = ["one_minus_A", "one_minus_B", "C1", "C2", "Mn", "Mr"];

fn measure(method: &Method, cells: f64, gap: f64, position: usize) -> Result<Vec<f64>, VerifyError> {
    let level = level(RADII[0], cells);
    let axes = axes(position);
    let [across, side, along] = axes;
    let distance = RADII[0] + RADII[1] + gap * RADII[0];
    let middle = Vector::<3>::repeat(0.5) + shift::<3>(position) * 0.5f64.powi(level.into());
    let places = [middle - along * (0.5 * distance), middle + along * (0.5 * distance)];
    let pair = [0, 1].map(|k| Ball::periodic(places[k], RADII[k], [Some(1.0); 3]));
    let mesh = Refinement::to_level(level).mesh(Aabb::unit(), [1; 3], [true; 3], &pair)?;
    let mut solver = FlowSolver::new(method.params::<3>(1e-8))?;
    let mut prepared = solver.prepared(mesh, &pair)?;
    let mut twists =
        |conditions: &Conditions<'_, 3>| Ok::<_, VerifyError>(prepared.solve(conditions)?.twists);
    let mut strained = |strain: PairStrain| {
        let gradient: Matrix<3> = strain.matrix(&axes);
        twists(&Conditions::in_linear_flow(&gradient))
    };
    let approach = 1.0 + relative(&strained(PairStrain::Along)?, &along) / distance;
    let tilted = strained(PairStrain::Tilting)?;
    let turning = 1.0 + relative(&tilted, &across) / distance;
    let spins = [0, 1].map(|k| (0..3).map(|d| tilted[k].spin[d] * side[d]).sum::<f64>());
    let mut mobility = |direction: &Vector<3>| {
        let at_rest = Conditions::at_rest();
        let wrenches = wrenches(&along, gap, direction);
        Ok::<_, VerifyError>(relative(&twists(&at_rest.with_wrenches(&wrenches))?, direction) * RADII[0])
    };
    let found = [approach, turning, spins[0], spins[1], mobility(&along)?, mobility(&across)?];
    let exact = exact(gap)?;
    Ok(found.iter().zip(exact).map(|(found, exact)| found / exact - 1.0).collect())
}

/// Velocity of the second sphere less that of the first in a direction.
fn relative(twists: &[Twist<3>], direction: &Vector<3>) -> f64 {
    (twists[1].velocity - twists[0].velocity).dot(direction)
}

/// Forces of one on the second sphere in this direction and on the first against it, both in the middle of
/// the gap.
fn wrenches(along: &Vector<3>, gap: f64, force: &Vector<3>) -> [Wrench<3>; 2] {
    let arm = RADII.map(|radius| radius + 0.5 * gap * RADII[0]);
    let torque = |arm: f64| Spin::<3>::from(-(along * arm).cross(force));
    [Wrench { force: -force, torque: torque(arm[0]) }, Wrench { force: *force, torque: torque(arm[1]) }]
}

fn exact(gap: f64) -> Result<[f64; 6], VerifyError> {
    exact_row(&spheres_one_to_two()?, &[("gap", gap)], COLUMNS)
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["approach", "turning", "pushed", "dragged"];
    Plot::of_methods("gap in smaller radii", "rms relative error, *a*/*h* = 3.2", &things, |method, thing| {
        let error = |gap| rms(&table.values(things[thing], method, &[("a/h", MESHES[1]), ("gap", gap)]));
        GAPS.into_iter().map(|gap| (gap, error(gap))).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_forces_have_no_moment_and_every_gap_a_reference() {
        let [along, across] = [Vector::<3>::z(), Vector::<3>::x()];
        let [first, second] = wrenches(&along, 0.3, &across);
        let arm = along * (RADII[0] + RADII[1] + 0.3 * RADII[0]);
        let moment = first.torque + second.torque + Spin::<3>::from(arm.cross(&second.force));
        assert!(moment.norm() < 1e-15 && (first.force + second.force).norm() == 0.0);
        for gap in GAPS {
            assert!(exact(gap).is_ok_and(|values| values.iter().all(|value| *value > 0.0)));
        }
        assert!(matches!(exact(0.2), Err(VerifyError::NoReference(_))));
    }
}
