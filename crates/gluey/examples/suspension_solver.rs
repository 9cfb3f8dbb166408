//! Two discs in a shear flow: a small suspension solver made of the crates, explained in
//! `docs/tutorial/suspension-solver.md`.
//!
//! `cargo run --release -p gluey --example suspension_solver [end]`

use std::error::Error;

use gluey_contact::{ContactModel, ContactParams, PairContact, StepGeometry};
use gluey_geom::{Aabb, Particle, Twist, Vector};
use gluey_levelset::Ball;
use gluey_motion::{Integrator, Scheme};
use gluey_stokes::{FlowParams, FlowSolver, Formulation, Lubrication, PaperParams, Refinement, SolverKind};

/// Radius of the discs; the box is the unit square.
const RADIUS: f64 = 0.05;
/// Time step, in units of the inverse shear rate.
const DT: f64 = 0.025;

/// Cells at the surfaces fit six times into a radius.
const REFINEMENT: Refinement = Refinement { coarsest: 3, surface: 7, band: 2.0 };

/// The undisturbed flow, which is also the velocity of the boundary.
fn shear(x: &Vector<2>) -> Vector<2> {
    Vector::<2>::new(x[1] - 0.5, 0.0)
}

/// One way to compute the encounter.
pub struct Method {
    /// What it is, as it is printed.
    pub name: &'static str,
    formulation: Formulation,
    has_contact: bool,
}

/// Penalised discs without and with contact, and rigid discs with lubrication.
pub fn methods() -> [Method; 3] {
    let paper = Formulation::Paper(PaperParams::default());
    let unfitted = Formulation::Unfitted { lubrication: Lubrication::Deficit };
    let method = |name, formulation, has_contact| Method { name, formulation, has_contact };
    [
        method("penalised discs, no contact model", paper, false),
        method("penalised discs, gluey contact", paper, true),
        method("true surfaces, lubrication in the film, no contact model", unfitted, false),
    ]
}

/// Where the pair is at one time.
pub struct Instant {
    /// In units of the inverse shear rate.
    pub time: f64,
    /// Angle of the line of centres below the x axis, in degrees.
    pub angle: f64,
    /// Gap between the surfaces, in radii.
    pub gap: f64,
    /// Memory of the contact, in squares of the radius.
    pub gamma: f64,
}

/// Two discs, the flow around them, what keeps them apart and what moves them.
struct Suspension {
    particles: [Particle<2>; 2],
    flow: FlowSolver<2>,
    contact: Option<PairContact<2>>,
    integrator: Integrator<2>,
}

impl Suspension {
    fn new(method: &Method) -> Result<Self, Box<dyn Error>> {
        let params = FlowParams {
            viscosity: 1.0,
            formulation: method.formulation,
            solver: SolverKind::Direct,
            tolerance: 1e-8,
        };
        // Gaps are exact at the end of the step, not only to first order in its length.
        let contact = PairContact::new(ContactParams { exact_gap: true, ..ContactParams::default() });
        let disc = |x, y| Particle::new(Vector::<2>::new(x, y), RADIUS);
        Ok(Self {
            particles: [disc(0.451, 0.51), disc(0.549, 0.49)],
            flow: FlowSolver::new(params)?,
            contact: method.has_contact.then_some(contact),
            integrator: Integrator::new(Scheme::AdamsBashforth2),
        })
    }

    fn step(&mut self) -> Result<(), Box<dyn Error>> {
        let mut twists = self.predict()?;
        self.correct(&mut twists)?;
        self.integrator.advance(DT, &mut self.particles, &twists);
        Ok(())
    }

    /// The velocities and spins that the flow alone would give.
    fn predict(&mut self) -> Result<Vec<Twist<2>>, Box<dyn Error>> {
        let discs = self.particles.map(|particle| Ball::new(particle.pose.position, particle.radius));
        let mesh = REFINEMENT.mesh(Aabb::unit(), [1; 2], [false; 2], &discs)?;
        Ok(self.flow.solve(mesh, &discs, &shear)?.twists)
    }

    /// The nearest velocities for which the discs do not overlap at the end of the step.
    fn correct(&mut self, twists: &mut [Twist<2>]) -> Result<(), Box<dyn Error>> {
        let Some(contact) = &mut self.contact else { return Ok(()) };
        let positions = self.particles.map(|particle| particle.pose.position);
        let radii = self.particles.map(|particle| particle.radius);
        let mut drift = [Vector::<2>::zeros(); 2];
        self.integrator.drift(DT, &mut drift);
        let velocity_weight = self.integrator.velocity_weight(DT);
        let step =
            StepGeometry { positions: &positions, radii: &radii, drift: &drift, velocity_weight, dt: DT };
        contact.correct(&step, twists)?;
        Ok(())
    }

    fn instant(&self, time: f64) -> Instant {
        let [first, second] = &self.particles;
        let line = second.pose.position - first.pose.position;
        let contact = self.contact.as_ref().and_then(|contact| contact.contacts().first());
        Instant {
            time,
            angle: (-line[1]).atan2(line[0]).to_degrees().rem_euclid(360.0),
            gap: first.gap(second) / RADIUS,
            gamma: contact.map_or(0.0, |contact| contact.gamma / RADIUS.powi(2)),
        }
    }
}

/// The encounter from time 0 to `end`, step by step.
pub fn encounter(method: &Method, end: f64) -> Result<Vec<Instant>, Box<dyn Error>> {
    let mut suspension = Suspension::new(method)?;
    let mut instants = vec![suspension.instant(0.0)];
    for step in 1..=(end / DT).round() as usize {
        suspension.step()?;
        instants.push(suspension.instant(step as f64 * DT));
    }
    Ok(instants)
}

/// The time at which the line of centres has turned half around, if it has.
fn half_turn(instants: &[Instant]) -> Option<f64> {
    let target = instants.first()?.angle + 180.0;
    let after = instants.iter().position(|instant| instant.angle >= target)?;
    let (before, after) = (instants.get(after.checked_sub(1)?)?, &instants[after]);
    Some(before.time + DT * (target - before.angle) / (after.angle - before.angle))
}

/// Prints the three encounters.
pub fn main() -> Result<(), Box<dyn Error>> {
    let end = std::env::args().nth(1).map_or(Ok(8.0), |end| end.parse::<f64>())?;
    for method in methods() {
        let instants = encounter(&method, end)?;
        println!("{}", method.name);
        println!("  time  angle      gap/a  gamma/a^2");
        for Instant { time, angle, gap, gamma } in instants.iter().step_by(40) {
            println!("{time:6.1} {angle:6.1} {gap:10.2e} {gamma:10.2e}");
        }
        let gaps = instants.iter().map(|instant| instant.gap);
        let (smallest, largest) = gaps
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(smallest, largest), gap| {
                (smallest.min(gap), largest.max(gap))
            });
        let half_turn = half_turn(&instants).unwrap_or(f64::NAN);
        println!("gap/a from {smallest:.2e} to {largest:.2e}, half a turn at t = {half_turn:.3}\n");
    }
    Ok(())
}
