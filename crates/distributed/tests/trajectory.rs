//! Particles that move through contact on ranks: where the serial solver takes them, and the same bits for
//! the same number of ranks.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

use gluey_contact::{BodyStep, ContactModel, ContactParams, PairContact};
use gluey_distributed::{BoxFlow, SharedHydrodynamics, Suspension};
use gluey_geom::{Aabb, Dim, Particle, Space, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_motion::{Hydrodynamics, Integrator, Scheme};
use gluey_parallel::{Communicator, Threads};
use gluey_stokes::{
    Conditions, CutCellPressures, FlowParams, FlowSolver, Formulation, Lubrication, Refinement, SolverKind,
    StokesError,
};

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
}

/// Two particles, one across the border.
const PAIR: Meeting = Meeting { places: &[[0.86, 0.54], [1.091, 0.46]], radius: 0.12, surface: 5 };
/// The discs of the case trio-2d, two of which begin 0.0004 radii apart.
const TRIO: Meeting =
    Meeting { places: &[[0.451, 0.51], [0.549, 0.49], [0.7, 0.49]], radius: 0.05, surface: 7 };

const RIGID_DOFS: Formulation =
    Formulation::RigidDofs { offset: 0.0, cut_cell_pressures: CutCellPressures::Aggregate };
const UNFITTED: Formulation = Formulation::Unfitted { lubrication: Lubrication::Deficit };

fn suspension<const D: usize>(
    Meeting { places, radius, surface }: Meeting,
    formulation: Formulation,
) -> Suspension<D>
where
    Dim<D>: Space<D>,
{
    let mut wrenches = vec![Wrench::default(); places.len()];
    wrenches[1].force[1] = if places.len() == 2 { 0.01 } else { 0.0 };
    Suspension {
        flow: BoxFlow { viscosity: 1.0, tolerance: 1e-11, max_iterations: 500 },
        domain: Aabb::unit(),
        roots: [1; D],
        periods: std::array::from_fn(|d| (d == 0).then_some(1.0)),
        refinement: Refinement {
            coarsest: surface - 1,
            surface,
            band: if formulation == RIGID_DOFS { 1.0 } else { 2.0 },
            gap_fraction: 0.0,
            gap_levels: 0,
        },
        formulation,
        radii: vec![radius; places.len()],
        wrenches,
        given: Vec::new(),
        force_density: None,
        shear_rate: 1.0,
        shear_stress: None,
    }
}

fn particles<const D: usize>(Meeting { places, radius, .. }: Meeting) -> Vec<Particle<D>>
where
    Dim<D>: Space<D>,
{
    let at = |&[x, y]: &[f64; 2]| Particle::new(Vector::from_fn(|d, _| [x, y, 0.5][d]), radius);
    places.iter().map(at).collect()
}

/// Places after all steps, and whether the particles ever touched.
fn trajectory<const D: usize, H: Hydrodynamics<D>>(meeting: Meeting, mut flow: H) -> (Vec<Vector<D>>, bool)
where
    Dim<D>: Space<D>,
    PairContact<D>: ContactModel<D>,
{
    let (mut particles, mut integrator) = (particles::<D>(meeting), Integrator::new(Scheme::AdamsBashforth2));
    let mut contact = PairContact::new(ContactParams::default());
    let count = particles.len();
    let (radii, mut touched) = (vec![meeting.radius; count], false);
    let [mut twists, mut drift] = [(); 2].map(|()| vec![Twist::default(); count]);
    for step in 0..STEPS {
        flow.predict(step as f64 * STEP, &particles, &mut twists).unwrap();
        integrator.body_drift(STEP, &mut drift);
        let poses: Vec<_> = particles.iter().map(|particle| particle.pose).collect();
        let velocity_weight = integrator.velocity_weight(STEP);
        let body_step = BodyStep { poses: &poses, radii: &radii, drift: &drift, velocity_weight, dt: STEP };
        contact.correct_bodies(&body_step, &mut twists).unwrap();
        touched |= !contact.contacts().is_empty();
        integrator.advance(STEP, &mut particles, &twists);
    }
    (particles.iter().map(|particle| particle.pose.position).collect(), touched)
}

/// The serial solver of the same flow.
struct Serial<'a, const D: usize>(&'a Suspension<D>)
where
    Dim<D>: Space<D>;

impl<const D: usize> Hydrodynamics<D> for Serial<'_, D>
where
    Dim<D>: Space<D>,
{
    type Error = StokesError;

    fn predict(
        &mut self,
        _: f64,
        particles: &[Particle<D>],
        twists: &mut [Twist<D>],
    ) -> Result<(), StokesError> {
        let Suspension { domain, roots, periods, refinement, formulation, wrenches, flow, .. } = self.0;
        let ball = |particle: &Particle<D>| Ball::periodic(particle.pose.position, particle.radius, *periods);
        let balls: Vec<Ball<D>> = particles.iter().map(ball).collect();
        let mesh = refinement.mesh(*domain, *roots, periods.map(|p| p.is_some()), &balls)?;
        let (solver, formulation) = (SolverKind::Multigrid, *formulation);
        let params = FlowParams { viscosity: 1.0, formulation, solver, tolerance: flow.tolerance };
        let shear = |x: &Vector<D>| Vector::from_fn(|d, _| if d == 0 { x[1] - 0.5 } else { 0.0 });
        let conditions = Conditions::boundary(&shear).with_wrenches(wrenches);
        let flow = FlowSolver::<D>::new(params)?.solve_under(mesh, &balls, &conditions)?;
        twists.copy_from_slice(&flow.twists);
        Ok(())
    }

    fn set_shear_factor(&mut self, _: f64) {}
}

fn ranks_take_particles_where_the_serial_solver_does<const D: usize>(
    (meeting, formulation): (Meeting, Formulation),
    sizes: &[usize],
    limit: f64,
) where
    Dim<D>: Space<D>,
    PairContact<D>: ContactModel<D>,
{
    let suspension = suspension::<D>(meeting, formulation);
    let (serial, touched) = trajectory(meeting, Serial(&suspension));
    assert_eq!(touched, formulation == RIGID_DOFS, "particles meet unless films keep them apart");
    for &size in sizes {
        let run = || {
            // Every second number of ranks is led by rank zero, which alone knows particles and contacts.
            Threads::run(size, |ranks| match (size % 2, ranks.rank()) {
                (0, 0) => Some(trajectory(meeting, SharedHydrodynamics::leading(&suspension, ranks)).0),
                (0, _) => {
                    suspension.follow(ranks);
                    None
                }
                _ => Some(trajectory(meeting, SharedHydrodynamics::beside(&suspension, ranks)).0),
            })
            .unwrap()
        };
        let found: Vec<_> = run().into_iter().flatten().collect();
        assert_eq!(found.len(), if size % 2 == 0 { 1 } else { size });
        assert!(found.iter().all(|places| *places == found[0]), "ranks agree");
        let difference = serial.iter().zip(&found[0]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        println!("{size} ranks: {difference:.1e}");
        assert!(difference < limit, "{size} ranks: {difference:e}");
        assert_eq!(run()[0].as_ref(), Some(&found[0]), "the same bits");
    }
}

#[test]
fn ranks_take_particles_where_the_serial_solver_does_in_2d() {
    ranks_take_particles_where_the_serial_solver_does::<2>((PAIR, RIGID_DOFS), &[1, 2, 3, 4, 8], 4.8e-12);
    ranks_take_particles_where_the_serial_solver_does::<2>((PAIR, UNFITTED), &[2, 8], 1.3e-12);
}

#[test]
fn ranks_take_three_discs_through_contact_where_the_serial_solver_does() {
    ranks_take_particles_where_the_serial_solver_does::<2>((TRIO, RIGID_DOFS), &[1, 2, 3, 4, 8], 4.2e-12);
}

#[test]
fn ranks_take_particles_where_the_serial_solver_does_in_3d() {
    let pair = Meeting { surface: 4, ..PAIR };
    ranks_take_particles_where_the_serial_solver_does::<3>((pair, RIGID_DOFS), &[1, 2, 3], 1.4e-13);
    ranks_take_particles_where_the_serial_solver_does::<3>((pair, UNFITTED), &[3], 3.6e-13);
}

/// The others end with rank zero, whatever ends it.
#[test]
fn followers_end_when_the_leader_fails() {
    let suspension = Suspension { radii: vec![0.001; 2], ..suspension::<2>(PAIR, UNFITTED) };
    let errors = Threads::run(3, |ranks| {
        if ranks.rank() > 0 {
            suspension.follow(ranks);
            return None;
        }
        let mut twists = vec![Twist::default(); 2];
        let mut flow = SharedHydrodynamics::leading(&suspension, ranks);
        flow.predict(0.0, &particles(PAIR), &mut twists).err().map(|error| error.to_string())
    });
    let first = errors.unwrap()[0].clone().unwrap();
    assert!(first.starts_with("body 1 has a radius"), "{first}");
}
