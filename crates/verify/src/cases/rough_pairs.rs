//! Rough spheres in contact: forces, spins and stresses.

use gluey_contact::{BodyStep, Domain, FlowContact, FlowContactParams, FlowForces, Friction, NormalLaw};
use gluey_geom::{Aabb, Dim, Lattice, Twist, Vector};
use gluey_motion::{Configuration, ContactLoads, MeanStress};
use gluey_stokes::{FlowSolver, Lubrication, NotDriven, Refinement, StokesError, Suspension};
use gluey_testkit::reference::{Table, rough_pairs};

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::method::{IN_SHEARED_BOXES, Method};
use crate::number::{Number, NumberKind};
use crate::plot::Plot;
use crate::set_up::{exact_row, level};
use crate::statistics::largest;

/// Radius in the unit box, which is periodic.
const RADIUS: f64 = 0.0125;
/// Cells in the radius.
const MESHES: [f64; 2] = [1.6, 3.2];
const ROUGHNESSES: [f64; 3] = [0.001, 0.01, 0.05];
/// Coefficients of friction; -1 stands for surfaces that never slip.
const FRICTIONS: [f64; 3] = [0.0, 0.5, -1.0];
/// Directions of the line of centres, in degrees: in the plane of shear and out of it.
const DIRECTIONS: [(f64, f64); 8] = [
    (90.0, 95.0),
    (90.0, 110.0),
    (90.0, 135.0),
    (90.0, 150.0),
    (60.0, 110.0),
    (60.0, 140.0),
    (30.0, 120.0),
    (30.0, 150.0),
];
/// A step so short that the gap at its end is that at its beginning and the rate.
const STEP: f64 = 1e-6;
/// The forces are those of a flow that they change no more than by this.
const FLOW_TOLERANCE: f64 = 1e-3;
/// Surfaces that slip no faster than this, in radii times the shear rate, stick.
const STUCK: f64 = 1e-4;
/// Flows at most; half of them are taken.
const MOST_FLOWS: usize = 20;

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "rough-pairs",
    title: "Two rough spheres in contact",
    text: "Two spheres of radius 0.0125 whose gap is their roughness, in a periodic unit box that is sheared, the line of centres in \
           the plane of shear and out of it: normal force, tangential force, spins and the stress of the particles (that of the free pair, of what the \
           contact force makes the flow add, and of the force itself), and whether it sticks or slips where the exact pair does not. Forces act in the flow until they change by 1e-3 at most. Forces are relative to the \
           largest normal force of the roughness in any direction, spins to the shear rate, the stress to that of the free pair. Exact: data/reference/rough_pairs.csv (functions of two \
           equal spheres in unbounded fluid, 1e-9). The box changes these by 1e-4.",
    keys: &["a/h", "roughness", "friction", "psi", "theta"],
    measures: &["normal force", "tangential force", "spin", "stress", "wrong mode", "flows"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(extent: Extent) -> Vec<Task> {
    let (meshes, directions) =
        (extent.pick(&MESHES[..1], &MESHES), extent.pick(&DIRECTIONS[1..5], &DIRECTIONS));
    let all = itertools::iproduct!(methods(), meshes, ROUGHNESSES, FRICTIONS, directions);
    let task = |(method, &cells, roughness, friction, &(psi, theta)): (
        &'static Method,
        &f64,
        f64,
        f64,
        &(f64, f64),
    )| {
        let at = [cells, roughness, friction, psi, theta];
        Task::new(method.name, &at, move || measure(method, at))
    };
    all.map(task).collect()
}

/// Those with films, in which a pair may be held at a gap.
fn methods() -> impl Iterator<Item = &'static Method> + Clone {
    IN_SHEARED_BOXES.iter().filter(|method| method.lubricates)
}

/// Forces in radii, viscosity and shear rate, and what else is compared.
struct ClosedPair {
    pressing: f64,
    tangential: Vector<3>,
    slip: f64,
    spin: [f64; 3],
    stress: MeanStress<3>,
    flows: usize,
}

fn measure(method: &Method, at: [f64; 5]) -> Result<Vec<f64>, VerifyError> {
    let found = solve(method, at)?;
    let table = rough_pairs()?;
    let keys = [("eps", at[1]), ("mu", at[2]), ("psi", at[3]), ("theta", at[4])];
    let [normal, slip] = exact_row(&table, &keys, ["Fn", "slip"])?;
    let tangential = exact_row(&table, &keys, ["Ftx", "Fty", "Ftz"])?;
    let spin = exact_row(&table, &keys, ["wx", "wy", "wz"])?;
    let stresses = exact_row(&table, &keys, ["S_flow", "S_induced", "S_contact"])?;
    let scale = largest_normal_force(&table, at[1])?;
    let stress = found.stress.of_particles()[(0, 1)] / RADIUS.powi(3);
    let off = (0..3).map(|d| (found.spin[d] - spin[d]).abs()).fold(0.0, f64::max);
    // Without friction nothing sticks, even where the slip vanishes.
    let is_wrong = at[2] != 0.0 && (slip == 0.0) != (found.slip < STUCK);
    Ok(vec![
        (found.pressing - normal) / scale,
        (found.tangential - Vector::<3>::from(tangential)).norm() / scale,
        off,
        (stress - stresses.iter().sum::<f64>()) / stresses[0],
        f64::from(u8::from(is_wrong)),
        found.flows as f64,
    ])
}

/// The largest normal force at this roughness in any direction of the table.
fn largest_normal_force(table: &Table, roughness: f64) -> Result<f64, VerifyError> {
    let [roughnesses, forces] = [table.column("eps")?, table.column("Fn")?];
    let of_roughness = roughnesses.iter().zip(forces).filter(|(eps, _)| **eps == roughness);
    Ok(of_roughness.map(|(_, force)| *force).fold(0.0, f64::max))
}

/// A pair whose gap is its roughness, in a short step of a run.
fn solve(
    method: &Method,
    [cells, roughness, friction, psi, theta]: [f64; 5],
) -> Result<ClosedPair, VerifyError> {
    let suspension = suspension(level(RADIUS, cells));
    let [psi, theta] = [psi, theta].map(f64::to_radians);
    let normal = Vector::<3>::new(psi.sin() * theta.cos(), psi.sin() * theta.sin(), psi.cos());
    let arm = normal * (RADIUS * (1.0 + 0.5 * roughness));
    let middle = Vector::<3>::repeat(0.5);
    let particles = suspension.particles(&[middle - arm, middle + arm]);
    let now = Configuration { with_stress: true, ..Configuration::at(0.0, &particles) };
    let coefficient = if friction < 0.0 { f64::INFINITY } else { friction };
    let params = FlowContactParams {
        law: NormalLaw::Rough { roughness },
        friction: Friction { coefficient, load: 0.0 },
        ..FlowContactParams::default()
    };
    let domain = Domain { lattice: Lattice::new([Some(1.0); 3]), ..Domain::default() };
    let mut contact = FlowContact::new(params, domain);
    let (poses, drift) = (particles.iter().map(|particle| particle.pose), [Twist::default(); 2]);
    let poses: Vec<_> = poses.collect();
    let step =
        BodyStep { poses: &poses, radii: &suspension.radii, drift: &drift, velocity_weight: STEP, dt: STEP };
    let mut mobility = suspension.near_mobility(&now, 1.0)?;
    let (mut twists, mut flows, mut failure) = (Vec::new(), 0, None);
    let mut next = |flow: &gluey_motion::Prediction<3>| {
        flows += 1;
        twists = flow.twists.clone();
        let corrected = contact.correct(&step, &mut mobility, &mut twists);
        let is_done = corrected.as_ref().is_ok_and(|report| report.change <= FLOW_TOLERANCE);
        if let (false, Ok(_)) = (is_done || flows == MOST_FLOWS, &corrected) {
            let [normal, stress_of_friction] = contact.stresses();
            let wrenches = contact.loads(&step).ok()?;
            let stress = normal + stress_of_friction;
            return Some(ContactLoads { wrenches, stress, stress_of_friction, looseness: 1.0 });
        }
        failure = corrected.err();
        None
    };
    let mut solver = FlowSolver::new(method.params::<3>(1e-8))?;
    let balls = suspension.balls(&now);
    let mesh = solver.discretised(suspension.mesh(&balls)?);
    let (_, prediction) = solver.predict::<FlowFailure>(&mesh, &suspension, &now, &mut next)?;
    failure.map_or(Ok(()), Err)?;
    let force = contact.forces().first().ok_or_else(|| VerifyError::NoReference("a force".to_owned()))?;
    let scale = RADIUS.powi(-2);
    let stress = prediction.stress.ok_or_else(|| VerifyError::NoReference("the stress".to_owned()))?;
    let spin = std::array::from_fn(|d| Dim::<3>::spin_slice(&twists[0].spin)[d]);
    let (pressing, tangential) = (force.pressing() * scale, force.tangential() * scale);
    Ok(ClosedPair { pressing, tangential, slip: force.slip.norm() / RADIUS, spin, stress, flows })
}

fn suspension(level: u8) -> Suspension<3> {
    Suspension {
        domain: Aabb::unit(),
        roots: [1; 3],
        periods: [Some(1.0); 3],
        refinement: Refinement::to_level(level),
        lubrication: Lubrication::Deficit,
        radii: vec![RADIUS; 2],
        wrenches: vec![],
        given: vec![],
        force_density: None,
        shear_rate: 1.0,
        shear_stress: None,
    }
}

/// Reason why there is no flow.
struct FlowFailure(VerifyError);

impl From<StokesError> for FlowFailure {
    fn from(error: StokesError) -> Self {
        Self(error.into())
    }
}

impl From<NotDriven> for FlowFailure {
    fn from(error: NotDriven) -> Self {
        Self(VerifyError::NoReference(error.to_string()))
    }
}

impl From<FlowFailure> for VerifyError {
    fn from(FlowFailure(error): FlowFailure) -> Self {
        error
    }
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (method, cells, roughness) in itertools::iproduct!(methods(), MESHES, ROUGHNESSES) {
        let at = [("a/h", cells), ("roughness", roughness)];
        if table.values("flows", method.name, &at).is_empty() {
            continue;
        }
        for measure in &CASE.measures[..5] {
            let what = format!("{measure}, a/h = {cells}, roughness {roughness} a, largest error");
            let value = largest(&table.values(measure, method.name, &at));
            numbers.push(Number::new(NumberKind::Size, what, method.name, value));
        }
        let what = format!("flows, a/h = {cells}, roughness {roughness} a, most");
        let most = largest(&table.values("flows", method.name, &at));
        numbers.push(Number::new(NumberKind::Remark, what, method.name, most));
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let things = ["normal force", "tangential force", "spin", "stress"];
    let cells = MESHES[1];
    Plot::of_methods("roughness in radii", "largest error, *a*/*h* = 3.2", &things, |method, thing| {
        let error = |roughness| {
            largest(&table.values(things[thing], method, &[("a/h", cells), ("roughness", roughness)]))
        };
        ROUGHNESSES.into_iter().map(|roughness| (roughness, error(roughness))).collect()
    })
}
