//! Particles that move through contact on ranks: where the serial solver takes them, and the same bits for
//! the same number of ranks.

use gluey_contact::{BodyStep, ContactModel, ContactParams, PairContact};
use gluey_distributed::{BoxFlow, SharedHydrodynamics, SharedSuspension};
use gluey_geom::{Particle, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_motion::{Configuration, FlowStatistics, Hydrodynamics, Integrator, Prediction, Scheme};
use gluey_stokes::{
    Conditions, FlowParams, FlowSolver, Formulation, Lubrication, Refinement, SolverKind, StokesError,
    Suspension,
};

use crate::support::{self, on_ranks};

const STEP: f64 = 0.05;
const STEPS: usize = 12;

/// Particles that the shear drives at each other.
#[derive(Clone, Copy)]
struct Meeting {
    /// In the first two directions.
    places: &'static [[f64; 2]],
    radius: f64,
    /// Level of the cells at the particles.
    surface: u8,
    /// Of the flows.
    tolerance: f64,
    /// Iterations of a flow by which ranks may differ from one: where discs nearly touch, multigrid takes
    /// more or fewer by the rounding of its levels.
    slack: usize,
}

/// Two particles, one across the border.
const PAIR: Meeting =
    Meeting { places: &[[0.86, 0.54], [1.091, 0.46]], radius: 0.12, surface: 5, tolerance: 1e-12, slack: 1 };
/// The discs of the case trio-2d, two of which begin 0.0004 radii apart.
const TRIO: Meeting = Meeting {
    places: &[[0.451, 0.51], [0.549, 0.49], [0.7, 0.49]],
    radius: 0.05,
    surface: 7,
    tolerance: 1e-11,
    slack: 6,
};

fn suspension<const D: usize>(
    Meeting { places, radius, surface, tolerance, .. }: Meeting,
    lubrication: Lubrication,
) -> SharedSuspension<D> {
    let mut wrenches = vec![Wrench::default(); places.len()];
    wrenches[1].force[1] = if places.len() == 2 { 0.01 } else { 0.0 };
    let flow = BoxFlow { viscosity: 1.0, tolerance, max_iterations: 500 };
    let refinement = Refinement { coarsest: surface - 1, surface, band: 2.0 };
    let radii = vec![radius; places.len()];
    let free = support::suspension(refinement, lubrication, radii);
    SharedSuspension { flow, suspension: Suspension { wrenches, ..free } }
}

fn particles<const D: usize>(Meeting { places, radius, .. }: Meeting) -> Vec<Particle<D>> {
    let at = |&[x, y]: &[f64; 2]| Particle::new(Vector::from_fn(|d, _| [x, y, 0.5][d]), radius);
    places.iter().map(at).collect()
}

/// What became of particles.
#[derive(Clone, Debug, PartialEq)]
struct Trajectory<const D: usize> {
    /// Places after all steps.
    places: Vec<Vector<D>>,
    /// Whether they ever touched.
    touched: bool,
    /// Iterations of each step.
    iterations: Vec<usize>,
}

fn trajectory<const D: usize, H: Hydrodynamics<D>>(meeting: Meeting, mut flow: H) -> Trajectory<D>
where
    PairContact<D>: ContactModel<D>,
{
    let (mut particles, mut integrator) = (particles::<D>(meeting), Integrator::new(Scheme::AdamsBashforth2));
    let mut contact = PairContact::new(ContactParams::default());
    let (mut touched, mut iterations) = (false, Vec::new());
    for step in 0..STEPS {
        let predicted = flow.predict(&Configuration::at(step as f64 * STEP, &particles)).unwrap();
        let mut twists = predicted.twists;
        iterations.push(predicted.statistics.iteration_count);
        let correct = |step: &BodyStep<'_, D>| contact.correct_bodies(step, &mut twists);
        integrator.with_step(STEP, &particles, correct).unwrap();
        touched |= !contact.contacts().is_empty();
        integrator.advance(STEP, &mut particles, &twists);
    }
    let places = particles.iter().map(|particle| particle.pose.position).collect();
    Trajectory { places, touched, iterations }
}

/// The serial solver of the same flow.
struct Serial<'a, const D: usize> {
    suspension: &'a SharedSuspension<D>,
    solver: FlowSolver<D>,
}

fn solver<const D: usize>(suspension: &SharedSuspension<D>) -> FlowSolver<D> {
    let SharedSuspension { flow, suspension: Suspension { lubrication, .. } } = suspension;
    let formulation = Formulation::Unfitted { lubrication: *lubrication };
    let solver = SolverKind::Multigrid;
    let params = FlowParams { viscosity: 1.0, formulation, solver, tolerance: flow.tolerance };
    FlowSolver::new(params).unwrap()
}

impl<'a, const D: usize> Serial<'a, D> {
    fn new(suspension: &'a SharedSuspension<D>) -> Self {
        Self { suspension, solver: solver(suspension) }
    }
}

impl<const D: usize> Hydrodynamics<D> for Serial<'_, D> {
    type Error = StokesError;

    fn predict(&mut self, configuration: &Configuration<'_, D>) -> Result<Prediction<D>, StokesError> {
        let Suspension { periods, wrenches, .. } = &self.suspension.suspension;
        let ball = |particle: &Particle<D>| Ball::periodic(particle.pose.position, particle.radius, *periods);
        let balls: Vec<Ball<D>> = configuration.particles.iter().map(ball).collect();
        let mesh = self.suspension.suspension.mesh(&balls)?;
        let shear = |x: &Vector<D>| Vector::from_fn(|d, _| if d == 0 { x[1] - 0.5 } else { 0.0 });
        let conditions = Conditions::boundary(&shear).with_wrenches(wrenches);
        let flow = self.solver.solve_under(mesh, &balls, &conditions)?;
        let statistics =
            FlowStatistics { iteration_count: flow.iteration_count, ..FlowStatistics::default() };
        Ok(Prediction { statistics, ..Prediction::of(flow.twists) })
    }
}

/// Whether particles touched on their way.
fn ranks_take_particles_where_the_serial_solver_does<const D: usize>(
    (meeting, lubrication): (Meeting, Lubrication),
    sizes: &[usize],
    limit: f64,
) -> bool
where
    PairContact<D>: ContactModel<D>,
{
    let suspension = suspension::<D>(meeting, lubrication);
    let serial = trajectory(meeting, Serial::new(&suspension));
    for &size in sizes {
        let run = || {
            let of_rank = |ranks: &_| trajectory(meeting, SharedHydrodynamics::new(&suspension, ranks));
            on_ranks(size, of_rank).unwrap()
        };
        let found = run();
        assert!(found.iter().all(|trajectory| *trajectory == found[0]), "ranks agree");
        let places = serial.places.iter().zip(&found[0].places);
        let difference = places.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let iterations = [&found[0].iterations, &serial.iterations];
        println!("{size} ranks: {difference:.1e}, iterations {iterations:?}");
        let mut pairs = iterations[0].iter().zip(iterations[1]);
        assert!(pairs.all(|(a, b)| a.abs_diff(*b) <= meeting.slack), "{size} ranks: {iterations:?}");
        assert!(iterations[0][1..3].iter().all(|later| *later < iterations[0][0]), "{iterations:?}");
        assert!(difference < limit, "{size} ranks: {difference:e}");
        assert_eq!(run()[0], found[0], "the same bits");
    }
    serial.touched
}

#[test]
fn ranks_take_particles_where_the_serial_solver_does_in_2d() {
    let take = ranks_take_particles_where_the_serial_solver_does::<2>;
    for (lubrication, sizes, limit) in
        [(Lubrication::None, &[1, 2, 3, 4, 8][..], 1e-12), (Lubrication::Deficit, &[2, 8], 3e-13)]
    {
        assert!(!take((PAIR, lubrication), sizes, limit), "the film keeps discs apart");
    }
}

#[test]
fn ranks_take_three_discs_through_contact_where_the_serial_solver_does() {
    let take = ranks_take_particles_where_the_serial_solver_does::<2>;
    assert!(take((TRIO, Lubrication::None), &[1, 2, 3, 4, 8], 3.9e-10), "particles meet");
}

#[test]
fn ranks_take_particles_where_the_serial_solver_does_in_3d() {
    let (pair, take) =
        (Meeting { surface: 4, ..PAIR }, ranks_take_particles_where_the_serial_solver_does::<3>);
    assert!(take((pair, Lubrication::None), &[1, 2, 3], 1.4e-13), "particles meet");
    assert!(!take((pair, Lubrication::Deficit), &[3], 6.5e-14), "films keep particles apart");
}

/// All end with the same error.
#[test]
fn a_flow_that_fails_ends_all() {
    let mut suspension = suspension::<2>(PAIR, Lubrication::Deficit);
    suspension.suspension.radii = vec![0.001; 2];
    let errors = on_ranks(3, |ranks| {
        let mut flow = SharedHydrodynamics::new(&suspension, ranks);
        flow.predict(&Configuration::at(0.0, &particles(PAIR))).unwrap_err().to_string()
    });
    let errors = errors.unwrap();
    assert!(errors.iter().all(|error| error.starts_with("body 1 has a radius")), "{errors:?}");
}
