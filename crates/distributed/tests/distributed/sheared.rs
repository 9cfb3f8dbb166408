//! Boxes that are sheared for ever on ranks: motions and stresses are those of the serial solver.

use std::rc::Rc;

use gluey_distributed::{BoxFlow, FlowMemory, SavedPiece, SharedHydrodynamics, SharedSuspension};
use gluey_geom::{Dim, Lattice, Matrix, Particle, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_motion::{Configuration, Hydrodynamics, MeanStress};
use gluey_parallel::Communicator;
use gluey_stokes::{
    Conditions, Flow, FlowParams, FlowSolver, Formulation, Lubrication, Refinement, SolverKind, Suspension,
};

use crate::support::{self, on_ranks};

const TOLERANCE: f64 = 1e-11;
const STRAIN: f64 = 0.2;
/// Flows one after the other, and the strain between them.
const FLOWS: usize = 3;
const STRAIN_STEP: f64 = 0.01;
const RATE: f64 = 0.8;

/// Particles that nearly touch, one across the seam.
const PARTICLES: [([f64; 3], f64); 3] =
    [([0.3, 0.4, 0.5], 0.16), ([0.62, 0.5, 0.43], 0.17), ([0.4, 0.95, 0.55], 0.18)];

fn suspension<const D: usize>(level: u8) -> SharedSuspension<D> {
    let mut wrenches = vec![Wrench::default(); PARTICLES.len()];
    (wrenches[1].force[1], wrenches[2].torque[0]) = (0.3, 0.02);
    let flow = BoxFlow { viscosity: 1.0, tolerance: TOLERANCE, max_iterations: 100 };
    let radii = PARTICLES.map(|particle| particle.1).to_vec();
    let suspension = Suspension {
        periods: [Some(1.0); D],
        wrenches,
        shear_rate: RATE,
        ..support::suspension(Refinement::to_level(level), Lubrication::Deficit, radii)
    };
    SharedSuspension { flow, suspension }
}

/// The particles, carried by the shear from [`STRAIN`] to another strain.
fn particles<const D: usize>(strain: f64) -> Vec<Particle<D>> {
    let carried = |x: &[f64; 3], d: usize| match d {
        0 => x[0] + (strain - STRAIN) * (x[1] - 0.5),
        _ => x[d],
    };
    let particle =
        |(x, radius): &([f64; 3], f64)| Particle::new(Vector::from_fn(|d, _| carried(x, d)), *radius);
    PARTICLES.iter().map(particle).collect()
}

/// Strains of flows one after the other.
fn strains() -> impl Iterator<Item = f64> {
    (0..FLOWS).map(|k| STRAIN + STRAIN_STEP * k as f64)
}

/// Flows of the serial solver, relative to the shear, each from those before it.
fn serial<const D: usize>(suspension: &SharedSuspension<D>) -> Vec<Flow<D>> {
    let solver = SolverKind::Multigrid;
    let formulation = Formulation::Unfitted { lubrication: suspension.suspension.lubrication };
    let params = FlowParams { viscosity: 1.0, formulation, solver, tolerance: TOLERANCE };
    let mut solver = FlowSolver::<D>::new(params).unwrap();
    strains().map(|strain| serial_flow(suspension, &mut solver, strain)).collect()
}

fn serial_flow<const D: usize>(
    suspension: &SharedSuspension<D>,
    solver: &mut FlowSolver<D>,
    strain: f64,
) -> Flow<D> {
    let lattice = Lattice::new(suspension.suspension.periods).tilted(strain);
    let ball =
        |particle: &Particle<D>| Ball::in_space(&particle.pose.position, particle.radius, &lattice, 0.0);
    let balls: Vec<Ball<D>> = particles(strain).iter().map(ball).collect();
    let Suspension { wrenches, .. } = &suspension.suspension;
    let mesh = suspension.suspension.mesh(&balls).unwrap();
    let mut gradient = Matrix::<D>::zeros();
    gradient[(0, 1)] = RATE;
    let back: Vector<D> = -wrenches.iter().map(|wrench| wrench.force).sum::<Vector<D>>();
    let uniform = |_: &Vector<D>| back;
    let conditions = Conditions::in_linear_flow(&gradient).with_wrenches(wrenches);
    let conditions = conditions.with_force(Some(&uniform)).with_stress();
    solver.solve_under(mesh, &balls, &conditions).unwrap()
}

/// Motions and the stress of a flow, and iterations.
type Found<const D: usize> = (Vec<Twist<D>>, MeanStress<D>, usize);

fn predict<const D: usize>(flow: &mut SharedHydrodynamics<'_, D>, strain: f64) -> Found<D> {
    let particles = particles(strain);
    let sheared = Configuration { strain, with_stress: true, ..Configuration::at(0.0, &particles) };
    let found = flow.predict(&sheared).unwrap();
    (found.twists, found.stress.unwrap(), found.statistics.iteration_count)
}

/// Flows by so many ranks.
fn shared<const D: usize>(suspension: &SharedSuspension<D>, ranks: usize) -> Vec<Found<D>> {
    let found = on_ranks(ranks, |ranks| {
        let mut flow = SharedHydrodynamics::new(suspension, ranks);
        strains().map(|strain| predict(&mut flow, strain)).collect::<Vec<_>>()
    });
    let mut found = found.unwrap();
    assert!(found.iter().all(|of_rank| *of_rank == found[0]), "ranks agree");
    found.remove(0)
}

fn ranks_shear_as_the_serial_solver_does<const D: usize>(level: u8, sizes: &[usize], limits: [[f64; 2]; 2]) {
    let suspension = suspension::<D>(level);
    let serial = serial(&suspension);
    for &size in sizes {
        let found = shared(&suspension, size);
        for (k, ((found, serial), strain)) in found.iter().zip(&serial).zip(strains()).enumerate() {
            let limits = limits[k.min(1)];
            let [difference, of_stress] = differences(found, serial, strain);
            let counts = [found.2, serial.iteration_count];
            println!("{size} ranks: {difference:.1e}, stress {of_stress:.1e}, iterations {counts:?}");
            assert!(difference < limits[0], "{size} ranks: motions {difference:e}");
            assert!(of_stress < limits[1], "{size} ranks: stresses {of_stress:e}");
            assert!(counts[0].abs_diff(counts[1]) <= 1, "{size} ranks: iterations {counts:?}");
        }
        assert!(found[2].2 + 3 < found[0].2, "the last flow is a guess");
        assert_eq!(shared(&suspension, size), found, "the same bits");
    }
}

/// The largest differences of motions and of stresses.
fn differences<const D: usize>((twists, stress, _): &Found<D>, serial: &Flow<D>, strain: f64) -> [f64; 2] {
    let largest = |m: f64, x: f64| if x.is_nan() { f64::NAN } else { m.max(x.abs()) };
    let mut difference = 0.0;
    for ((twist, serial), particle) in twists.iter().zip(&serial.twists).zip(particles::<D>(strain)) {
        let mut velocity = twist.velocity - serial.velocity;
        velocity[0] -= RATE * (particle.pose.position[1] - 0.5);
        difference = velocity.iter().copied().fold(difference, largest);
        let spin = twist.spin[Dim::<D>::ROT - 1] - serial.spin[Dim::<D>::ROT - 1];
        difference = largest(difference, spin + 0.5 * RATE);
    }
    let of_serial = serial.stress.as_ref().unwrap();
    let of_stress = (stress.of_bodies - of_serial.of_bodies(1.0)).iter().copied().fold(0.0, largest);
    [difference, largest(of_stress, stress.dissipation - of_serial.dissipation)]
}

#[test]
fn ranks_shear_as_the_serial_solver_does_in_2d() {
    // Eight ranks end their third flow with other iterates: 2.7e-12, stresses 1.0e-11.
    let later = [TOLERANCE, 2.0 * TOLERANCE];
    ranks_shear_as_the_serial_solver_does::<2>(5, &[1, 2, 3, 8], [[TOLERANCE; 2], later]);
}

#[test]
fn ranks_shear_as_the_serial_solver_does_in_3d() {
    ranks_shear_as_the_serial_solver_does::<3>(4, &[1, 3, 8], [[1.5e-13, 4.5e-14], [1.5e-13, 2.3e-13]]);
}

/// A flow that goes on from the pieces of others, and what these found: the same bits on as many ranks, the
/// same but for the tolerance on others.
fn flows_go_on_from_pieces<const D: usize>(level: u8, limit: f64) {
    let suspension = suspension::<D>(level);
    for (from, sizes) in [(3, &[3, 2][..]), (2, &[5]), (4, &[1])] {
        let last = strains().last().unwrap();
        let before = on_ranks(from, |ranks| {
            let memory = Rc::new(FlowMemory::default());
            let mut flow = SharedHydrodynamics::new(&suspension, ranks).remembering(memory.clone());
            strains().take(FLOWS - 1).for_each(|strain| drop(predict(&mut flow, strain)));
            flow.checkpoint().unwrap();
            let found = predict(&mut flow, last);
            (memory.saved(), found)
        });
        let before = before.unwrap();
        let pieces: Vec<SavedPiece> = before.iter().flat_map(|(pieces, _)| pieces.clone()).collect();
        assert_eq!(pieces.len(), from);
        for &to in sizes {
            let after = on_ranks(to, |ranks| {
                let holder = |run: usize| SavedPiece::holder(run, from, ranks.size());
                let own = (0..from).filter(|&run| holder(run) == ranks.rank());
                let mut own: Vec<SavedPiece> = own.map(|run| pieces[run].clone()).collect();
                if own.is_empty() {
                    own.push(pieces[0].clone());
                }
                let memory = Rc::new(FlowMemory::default());
                memory.restore(&suspension.suspension, ranks, own).unwrap();
                predict(&mut SharedHydrodynamics::new(&suspension, ranks).remembering(memory), last)
            });
            let (before, after) = (&before[0].1, &after.unwrap()[0]);
            if from == to {
                assert_eq!(before, after, "the same bits");
            }
            let of_twists = before.0.iter().zip(&after.0).map(|(a, b)| (a.velocity - b.velocity).amax());
            let difference = of_twists.fold(0.0, f64::max);
            println!("{D}D, {from} ranks, then {to}: {difference:.1e}, iterations {}, {}", before.2, after.2);
            assert!(difference < limit, "{from} ranks, then {to}: {difference:e}");
            assert!(before.2.abs_diff(after.2) <= 1, "{from} ranks, then {to}: {} iterations", after.2);
        }
    }
}

#[test]
fn flows_go_on_from_the_pieces_of_others() {
    flows_go_on_from_pieces::<2>(5, 1.2e-12);
    flows_go_on_from_pieces::<3>(4, 1.4e-14);
}

#[test]
fn pieces_of_something_else_are_refused() {
    let suspension = suspension::<2>(5);
    let errors = on_ranks(1, |ranks| {
        let memory = Rc::new(FlowMemory::default());
        let mut flow = SharedHydrodynamics::new(&suspension, ranks).remembering(memory.clone());
        predict(&mut flow, STRAIN);
        assert_eq!(memory.saved(), [], "nothing was to be kept");
        flow.checkpoint().unwrap();
        let saved = memory.saved();
        let mut fewer = suspension.clone();
        fewer.suspension.radii = vec![0.1; 2];
        let changed = |key: &str, value: serde_json::Value| {
            let mut numbers = serde_json::to_value(&saved).unwrap();
            numbers[0][key] = value;
            memory.restore(&suspension.suspension, ranks, serde_json::from_value(numbers).unwrap())
        };
        [
            memory.restore(&fewer.suspension, ranks, saved.clone()),
            memory.restore(&suspension.suspension, ranks, Vec::new()),
            changed("firsts", [1, 0].into()),
            changed("levels", [9; 4].into()),
            changed("flows", serde_json::json!([[[0.5], [0.5]]])),
        ]
        .map(|outcome| outcome.unwrap_err().to_string())
    });
    let errors = errors.unwrap().remove(0);
    let whats = [
        "motions of another number of particles",
        "no piece",
        "runs out of order",
        "cells that are not in it",
        "values for other nodes",
    ];
    for (error, what) in errors.iter().zip(whats) {
        assert_eq!(*error, format!("the flow of run 0 has {what}"));
    }
}
