//! Boxes that are sheared for ever on ranks: motions and stresses are those of the serial solver.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

use gluey_distributed::{BoxFlow, SharedHydrodynamics, Suspension};
use gluey_geom::{Aabb, Dim, Lattice, Matrix, Particle, Space, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_motion::{Hydrodynamics, MeanStress};
use gluey_parallel::{Communicator, Threads};
use gluey_stokes::{
    Conditions, Flow, FlowParams, FlowSolver, Formulation, Lubrication, Refinement, SolverKind,
};

const TOLERANCE: f64 = 1e-11;
const STRAIN: f64 = 0.2;
const RATE: f64 = 0.8;

/// Particles that nearly touch, one across the seam.
const PARTICLES: [([f64; 3], f64); 3] =
    [([0.3, 0.4, 0.5], 0.16), ([0.62, 0.5, 0.43], 0.17), ([0.4, 0.95, 0.55], 0.18)];

fn suspension<const D: usize>(level: u8) -> Suspension<D>
where
    Dim<D>: Space<D>,
{
    let mut wrenches = vec![Wrench::default(); PARTICLES.len()];
    (wrenches[1].force[1], wrenches[2].torque[0]) = (0.3, 0.02);
    Suspension {
        flow: BoxFlow { viscosity: 1.0, tolerance: TOLERANCE, max_iterations: 100 },
        domain: Aabb::unit(),
        roots: [1; D],
        periods: [Some(1.0); D],
        refinement: Refinement::to_level(level),
        formulation: Formulation::Unfitted { lubrication: Lubrication::Deficit },
        radii: PARTICLES.map(|particle| particle.1).to_vec(),
        wrenches,
        given: Vec::new(),
        force_density: None,
        shear_rate: RATE,
        shear_stress: None,
    }
}

fn particles<const D: usize>() -> Vec<Particle<D>>
where
    Dim<D>: Space<D>,
{
    PARTICLES.iter().map(|(x, radius)| Particle::new(Vector::from_fn(|d, _| x[d]), *radius)).collect()
}

/// The flow of the serial solver, relative to the shear.
fn serial<const D: usize>(suspension: &Suspension<D>) -> Flow<D>
where
    Dim<D>: Space<D>,
{
    let lattice = Lattice::new(suspension.periods).tilted(STRAIN);
    let ball =
        |particle: &Particle<D>| Ball::in_space(&particle.pose.position, particle.radius, &lattice, 0.0);
    let balls: Vec<Ball<D>> = particles().iter().map(ball).collect();
    let Suspension { domain, roots, refinement, formulation, wrenches, .. } = suspension;
    let mesh = refinement.mesh(*domain, *roots, [true; D], &balls).unwrap();
    let solver = SolverKind::Multigrid;
    let params = FlowParams { viscosity: 1.0, formulation: *formulation, solver, tolerance: TOLERANCE };
    let mut gradient = Matrix::<D>::zeros();
    gradient[(0, 1)] = RATE;
    let back: Vector<D> = -wrenches.iter().map(|wrench| wrench.force).sum::<Vector<D>>();
    let uniform = |_: &Vector<D>| back;
    let conditions = Conditions::in_linear_flow(&gradient).with_wrenches(wrenches);
    let conditions = conditions.with_force(Some(&uniform)).with_stress();
    FlowSolver::<D>::new(params).unwrap().solve_under(mesh, &balls, &conditions).unwrap()
}

/// Motions and the stress by so many ranks, and iterations.
fn shared<const D: usize>(suspension: &Suspension<D>, ranks: usize) -> (Vec<Twist<D>>, MeanStress<D>, usize)
where
    Dim<D>: Space<D>,
{
    let found = Threads::run(ranks, |ranks| {
        if ranks.rank() > 0 {
            suspension.follow(ranks);
            return None;
        }
        let mut flow = SharedHydrodynamics::leading(suspension, ranks);
        let mut twists = vec![Twist::default(); PARTICLES.len()];
        flow.set_strain(STRAIN, true);
        flow.predict(0.0, &particles(), &mut twists).unwrap();
        Some((twists, flow.stress().unwrap(), flow.statistics().iteration_count))
    });
    found.unwrap().remove(0).unwrap()
}

fn ranks_shear_as_the_serial_solver_does<const D: usize>(level: u8, sizes: &[usize], limits: [f64; 2])
where
    Dim<D>: Space<D>,
{
    let suspension = suspension::<D>(level);
    let serial = serial(&suspension);
    let stress = serial.stress.as_ref().unwrap();
    let largest = |m: f64, x: f64| if x.is_nan() { f64::NAN } else { m.max(x.abs()) };
    for &size in sizes {
        let (twists, found, iterations) = shared(&suspension, size);
        let mut difference = 0.0;
        for ((twist, serial), (x, _)) in twists.iter().zip(&serial.twists).zip(&PARTICLES) {
            let mut velocity = twist.velocity - serial.velocity;
            velocity[0] -= RATE * (x[1] - 0.5);
            difference = velocity.iter().copied().fold(difference, largest);
            let spin = twist.spin[Dim::<D>::ROT - 1] - serial.spin[Dim::<D>::ROT - 1];
            difference = largest(difference, spin + 0.5 * RATE);
        }
        let of_stress = (found.of_bodies - stress.of_bodies(1.0)).iter().copied().fold(0.0, largest);
        let of_stress = largest(of_stress, found.dissipation - stress.dissipation);
        let count = serial.iteration_count;
        println!(
            "{size} ranks: {difference:.1e}, stress {of_stress:.1e}, iterations {iterations} and {count}"
        );
        assert!(difference < limits[0], "{size} ranks: motions {difference:e}");
        assert!(of_stress < limits[1], "{size} ranks: stresses {of_stress:e}");
        assert!(iterations.abs_diff(count) <= 1, "{size} ranks: {iterations} iterations");
        assert_eq!(shared(&suspension, size), (twists, found, iterations), "the same bits");
    }
}

#[test]
fn ranks_shear_as_the_serial_solver_does_in_2d() {
    ranks_shear_as_the_serial_solver_does::<2>(5, &[1, 2, 3, 8], [5.1e-12, 3e-11]);
}

#[test]
fn ranks_shear_as_the_serial_solver_does_in_3d() {
    ranks_shear_as_the_serial_solver_does::<3>(4, &[1, 3, 8], [4.8e-13, 5.1e-13]);
}
