//! Encounters of two rough spheres, with exact velocities: what contact and steps make of them.

use gluey_contact::{
    BodyStep, ContactModel, Domain, FilmMemory, FlowContact, FlowContactParams, FlowForces, Friction,
    GapError, NormalLaw, StepFilms, correct_gaps, film_reach,
};
use gluey_geom::{Matrix, Particle, Twist, Vector, Wrench};
use gluey_motion::{
    Configuration, ContactLoads, Hydrodynamics, Integrator, LinearFlow, PairMobility, Scheme,
};
use gluey_testkit::convergence_order;
use gluey_testkit::reference::{Table, rough_paths};

use crate::case::{CaseTable, Extent, Task, VerificationCase, VerifyError};
use crate::number::{Number, NumberKind};
use crate::plot::{Curve, Plot};
use crate::set_up::exact_row;
use crate::statistics::largest;

/// Time steps, about: a whole number of them makes the path.
const STEPS: [f64; 4] = [0.04, 0.02, 0.01, 0.005];
/// The only method there is.
const METHOD: &str = "exact velocities";
/// What a path does at its end.
const TURNS: [&str; 3] = ["goes on", "is reversed at its end", "is reversed in contact"];
/// Forces change by a flow no more than this.
const FLOW_TOLERANCE: f64 = 1e-6;

/// The chapter.
pub const CASE: VerificationCase = VerificationCase {
    name: "rough-paths",
    title: "Encounters of two rough spheres",
    text: "Two spheres meet in unbounded shear, in and out of the plane of shear, touch at their roughness without friction and part; on some paths the shear is reversed far behind, or half-way through the contact. \
           Velocities are exact (Batchelor and Green 1972; Brenner 1961 for the push of the contact), so that what is left is that of contact and steps, by Adams-Bashforth 2. Distance across the \
           flow from where the second sphere should be at the end, in radii (offset), and the time in contact less the exact one, in steps (those in which the pair touches and parts count as a whole), both against data/reference/rough_paths.csv (1e-9). In the plane of shear the path behind the contact \
           does not depend on friction.",
    keys: &["roughness", "y0", "z0", "turn", "time step"],
    measures: &["offset", "time in contact"],
    tasks,
    numbers: |tables| numbers(&tables.of(CASE.name)),
    plot: |tables| plot(&tables.of(CASE.name)),
};

fn tasks(_: Extent) -> Vec<Task> {
    let paths = rough_paths().and_then(|table| paths(&table)).unwrap_or_default();
    let task = |(path, step): (&[f64; 4], &f64)| {
        let at = [path[0], path[1], path[2], path[3], *step];
        Task::new(METHOD, &at, move || measure(at))
    };
    itertools::iproduct!(&paths, &STEPS).map(task).collect()
}

/// Roughness, start and turn of each.
fn paths(table: &Table) -> Result<Vec<[f64; 4]>, gluey_testkit::reference::TableError> {
    let columns = ["eps", "y0", "z0", "turn"].map(|name| table.column(name));
    let [eps, y0, z0, turn] = columns;
    let (eps, y0, z0, turn) = (eps?, y0?, z0?, turn?);
    Ok((0..table.row_count()).map(|row| [eps[row], y0[row], z0[row], turn[row]]).collect())
}

fn measure([roughness, y0, z0, turn, step]: [f64; 5]) -> Result<Vec<f64>, VerifyError> {
    let keys = [("eps", roughness), ("y0", y0), ("z0", z0), ("turn", turn)];
    let [t_turn, t_end, y, z, t_contact] =
        exact_row(&rough_paths()?, &keys, ["t_turn", "t_end", "y", "z", "t_contact"])?;
    let until = if t_turn > 0.0 { t_turn } else { t_end };
    let steps = (until / step).round();
    let mut encounter = Encounter::new(roughness, Vector::<3>::new(-8.0, y0, z0), until / steps);
    encounter.advance(steps as usize)?;
    let in_contact = encounter.time_in_contact;
    if t_turn > 0.0 {
        encounter.reverse();
        encounter.advance(steps as usize)?;
    }
    let [first, second] = encounter.particles.map(|particle| particle.pose.position);
    let off = second - first - Vector::<3>::new(0.0, y, z);
    let of_contact = if t_contact > 0.0 { (in_contact - t_contact) / encounter.step } else { 0.0 };
    Ok(vec![off.y.hypot(off.z), of_contact])
}

/// A pair in shear, as a run of it does.
struct Encounter {
    particles: [Particle<3>; 2],
    flow: PairMobility,
    contact: FlowContact<3>,
    integrator: Integrator<3>,
    shear_factor: f64,
    step: f64,
    films: FilmMemory,
    time_in_contact: f64,
}

impl Encounter {
    fn new(roughness: f64, start: Vector<3>, step: f64) -> Self {
        let params = FlowContactParams {
            law: NormalLaw::Rough { roughness },
            friction: Friction::default(),
            ..FlowContactParams::default()
        };
        Self {
            particles: [-0.5, 0.5].map(|side| Particle::new(start * side, 1.0)),
            flow: PairMobility::new(LinearFlow::shear(1.0, 0.0)),
            contact: FlowContact::new(params, Domain::default()),
            integrator: Integrator::new(Scheme::AdamsBashforth2),
            films: FilmMemory::default(),
            shear_factor: 1.0,
            step,
            time_in_contact: 0.0,
        }
    }

    fn reverse(&mut self) {
        match self.contact.is_reversible() {
            true => self.integrator.reverse(),
            false => self.integrator.restart(),
        }
        self.films.reverse();
        self.contact.reverse();
        self.shear_factor = -self.shear_factor;
    }

    fn advance(&mut self, steps: usize) -> Result<(), VerifyError> {
        for _ in 0..steps {
            let Self { particles, flow, contact, integrator, films, shear_factor, step, .. } = self;
            let now = Configuration { shear_factor: *shear_factor, ..Configuration::at(0.0, particles) };
            let Some(mut mobility) = flow.near_mobility(&now)? else { continue };
            let reach = |step: &BodyStep<'_, 3>| film_reach(step, &[Twist::default(); 2], 0.0);
            let near = flow.films(&now, integrator.with_step(*step, particles, reach));
            let (mut twists, mut after, mut failure) = (Vec::new(), films.clone(), None);
            let begun = integrator.with_step(*step, particles, |step| {
                contact.begin(step)?;
                contact.loads(step)
            });
            let loads = loads(begun?);
            let mut next = |prediction: &gluey_motion::Prediction<3>| {
                (twists, after) = (prediction.twists.clone(), films.clone());
                let corrected: Result<_, GapError> = integrator.with_step(*step, particles, |step| {
                    let known = StepFilms { memory: &mut after, near: &near };
                    let (report, _) = correct_gaps(contact, known, step, &mut *mobility, &mut twists)?;
                    Ok((report.change, contact.loads(step)?))
                });
                match corrected {
                    Ok((change, wrenches)) if change > FLOW_TOLERANCE => Some(self::loads(wrenches)),
                    corrected => {
                        failure = corrected.err();
                        None
                    }
                }
            };
            flow.predict_with_contacts(&Configuration { contacts: Some(&loads), ..now }, &mut next)?;
            failure.map_or(Ok(()), Err)?;
            self.films = after;
            self.contact.finish();
            self.time_in_contact += if self.contact.forces().is_empty() { 0.0 } else { self.step };
            self.integrator.advance(self.step, &mut self.particles, &twists);
        }
        Ok(())
    }
}

/// Loads whose stress is of no interest.
fn loads(wrenches: Vec<Wrench<3>>) -> ContactLoads<3> {
    let [stress, stress_of_friction] = [Matrix::zeros(); 2];
    ContactLoads { wrenches, stress, stress_of_friction, looseness: 1.0 }
}

/// The largest offset of the paths that turn so, by step.
fn offsets(table: &CaseTable, turn: usize) -> Vec<(f64, f64)> {
    let largest_at =
        |step| largest(&table.values("offset", METHOD, &[("turn", turn as f64), ("time step", step)]));
    STEPS
        .iter()
        .map(|&step| (step, largest_at(step)))
        .filter(|(_, off)| off.is_finite() && *off > 0.0)
        .collect()
}

fn numbers(table: &CaseTable) -> Vec<Number> {
    let mut numbers = Vec::new();
    for (turn, name) in TURNS.into_iter().enumerate() {
        let (steps, offs): (Vec<f64>, Vec<f64>) = offsets(table, turn).into_iter().unzip();
        for (step, off) in steps.iter().zip(&offs) {
            let what = format!("offset where the path {name}, time step {step}, largest");
            numbers.push(Number::new(NumberKind::Size, what, METHOD, *off));
        }
        if steps.len() == STEPS.len() {
            let what = format!("order of the offset where the path {name}");
            numbers.push(Number::new(NumberKind::Order, what, METHOD, convergence_order(&steps, &offs)));
        }
    }
    for step in STEPS {
        let times = table.values("time in contact", METHOD, &[("turn", 0.0), ("time step", step)]);
        if !times.is_empty() {
            let what = format!("time in contact, time step {step}, largest error in steps");
            numbers.push(Number::new(NumberKind::Size, what, METHOD, largest(&times)));
        }
    }
    numbers
}

fn plot(table: &CaseTable) -> Plot {
    let curve = |turn: usize| Curve {
        label: TURNS[turn].to_owned(),
        color: turn,
        dashes: 0,
        points: offsets(table, turn).into_iter().rev().collect(),
    };
    Plot { x: "time step", y: "largest offset in radii", curves: (0..TURNS.len()).map(curve).collect() }
}
