//! Contacts whose forces act in the flow of a step: flow after flow, until they no longer change.

use gluey_contact::{
    BodyStep, ContactError, Film, FilmMemory, FilmReport, FlowContactParams, FlowContactReport, FlowForces,
    GapError, GapReport, StepFilms, TwistMobility, correct_gaps, film_reach,
};
use gluey_geom::{Particle, Twist};
use gluey_motion::{Configuration, ContactLoads, Hydrodynamics, Integrator, NoForces, Prediction};

use super::accuracy::Accuracy;
use super::error::{StepError, end_after, half_after};
use super::part::Part;

/// The first flow of a step with contacts is so many times less accurate than the last: its forces change.
const FIRST_LOOSENESS: f64 = 1000.0;

/// Limits of the iteration by which forces of contacts in the flow become those of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowIteration {
    /// Their change by a flow, over their size, by the power that they have.
    pub tolerance: f64,
    /// Flows of a step at most.
    pub most_flows: usize,
}

impl Default for FlowIteration {
    fn default() -> Self {
        Self { tolerance: FlowContactParams::FLOW_TOLERANCE, most_flows: 20 }
    }
}

/// A step that begins, and the part of it that is to be done.
#[derive(Clone, Copy)]
pub(super) struct StepStart<'a, const D: usize> {
    pub integrator: &'a Integrator<D>,
    /// Steps done before.
    pub step: usize,
    /// Length of a whole step.
    pub dt: f64,
    /// Halved where contacts find no forces.
    pub part: Part,
    pub most_halvings: u32,
    /// Halved, too, where the time scheme would err by too much.
    pub accuracy: &'a Accuracy<D>,
    pub limits: FlowIteration,
    /// Displacement of the image one period up, its velocity, and the rate of the shear.
    pub tilt: f64,
    pub slide: f64,
    pub sliding_rate: f64,
    /// Memory of films before the step.
    pub films: &'a FilmMemory,
}

/// A prediction with velocities that contacts allow.
pub(super) struct ContactPrediction<const D: usize> {
    pub prediction: Prediction<D>,
    /// Memory of films after the step.
    pub films: FilmMemory,
    /// The part of the step for which there are forces.
    pub part: Part,
    /// Why the whole was not.
    pub refused: Option<String>,
    pub gaps: GapReport,
}

/// What the flow says of particles between which contact forces act.
pub(super) fn predicted_in_contact<const D: usize, H: Hydrodynamics<D>>(
    hydrodynamics: &mut H,
    contact: &mut dyn FlowForces<D>,
    now: &Configuration<'_, D>,
    start: StepStart<'_, D>,
) -> Result<ContactPrediction<D>, StepError<H::Error>> {
    let (step, time) = (start.step, now.time);
    let flow_failed = |source| StepError::Flow { step, time, source };
    let mobility = hydrodynamics.near_mobility(now).map_err(flow_failed)?;
    let films = start.with_step(now.particles, |step| {
        let reach = film_reach(step, &vec![Twist::default(); step.poses.len()], start.sliding_rate);
        hydrodynamics.films(now, reach)
    });
    let mut iteration = ContactIteration {
        start,
        particles: now.particles,
        shear_factor: now.shear_factor,
        contact,
        films,
        mobility: mobility.ok_or(StepError::Forces { step, time, source: NoForces })?,
        changes: Vec::new(),
        is_loose: false,
        refused: None,
        corrected: Ok(Default::default()),
    };
    let loads = iteration.begin().map_err(|source| StepError::Contact { step, time, source })?;
    let now = Configuration { contacts: Some(&loads), ..*now };
    let predicted = hydrodynamics.predict_with_contacts(&now, &mut |flow| iteration.after(flow));
    let ContactIteration { start, changes, refused, corrected, .. } = iteration;
    let prediction = predicted.map_err(flow_failed)?;
    let part = start.part;
    let corrected = corrected.map_err(|error| end_after(error, step, time, start.length()))?;
    let Corrected { twists, films, report, of_films } = corrected;
    let gaps = GapReport { films: of_films, contacts: report.contact, changes };
    Ok(ContactPrediction { prediction: Prediction { twists, ..prediction }, films, part, refused, gaps })
}

/// The iteration of a step.
struct ContactIteration<'a, const D: usize> {
    start: StepStart<'a, D>,
    particles: &'a [Particle<D>],
    shear_factor: f64,
    contact: &'a mut dyn FlowForces<D>,
    films: Vec<Film<D>>,
    mobility: Box<dyn TwistMobility<D>>,
    /// Changes of the forces by each flow so far.
    changes: Vec<f64>,
    /// Whether the last flow was less accurate than it is to be in the end.
    is_loose: bool,
    /// Why the step was halved, where it was.
    refused: Option<String>,
    /// Velocities after the last flow.
    corrected: Result<Corrected<D>, GapError>,
}

/// Velocities that contacts and films allow, with what they are remembered by.
#[derive(Default)]
struct Corrected<const D: usize> {
    twists: Vec<Twist<D>>,
    films: FilmMemory,
    report: FlowContactReport,
    of_films: FilmReport,
}

impl<const D: usize> StepStart<'_, D> {
    /// Length of the part that is to be done.
    fn length(&self) -> f64 {
        self.dt * self.part.share()
    }

    fn with_step<T>(&self, particles: &[Particle<D>], act: impl FnOnce(&BodyStep<'_, D>) -> T) -> T {
        self.integrator.with_step(self.length(), particles, act)
    }
}

impl<const D: usize> ContactIteration<'_, D> {
    /// The loads that the first flow has: those of the last step.
    fn begin(&mut self) -> Result<ContactLoads<D>, ContactError> {
        self.with_step(|contact, _, step| contact.begin(step))?;
        let looseness = if self.contact.forces().is_empty() { 1.0 } else { FIRST_LOOSENESS };
        self.loads(looseness)
    }

    /// Corrects the velocities of a flow; the loads that another flow is to have, if the forces have changed.
    fn after(&mut self, prediction: &Prediction<D>) -> Option<ContactLoads<D>> {
        self.contact.set_rate(prediction.rate);
        self.corrected = self.correct(&prediction.twists);
        let Ok(Corrected { report, .. }) = &self.corrected else { return None };
        self.changes.push(report.change);
        let FlowIteration { tolerance, most_flows } = self.start.limits;
        let is_loose = std::mem::take(&mut self.is_loose);
        if report.change <= tolerance && !is_loose {
            return None;
        }
        if self.changes.len() >= most_flows {
            let changes = self.changes.clone();
            self.corrected = Err(ContactError::FlowNotConverged { changes, tolerance }.into());
            return None;
        }
        let loads = self.loads(1.0);
        loads.map_err(|error| self.corrected = Err(error.into())).ok()
    }

    /// Halves the step until there are forces, films are in balance, and the time scheme is accurate.
    fn correct(&mut self, flow: &[Twist<D>]) -> Result<Corrected<D>, GapError> {
        loop {
            let StepStart { part, most_halvings, accuracy, dt, .. } = self.start;
            match self.try_to_correct(flow) {
                Ok(corrected) => {
                    let half = accuracy.half_of(part, most_halvings, dt, &corrected.twists, self.particles);
                    match half {
                        Some(half) => self.start.part = half,
                        None => return Ok(corrected),
                    }
                }
                Err(error) => {
                    self.refused = Some(error.to_string());
                    self.start.part = half_after(&error, part, most_halvings).ok_or(error)?;
                }
            }
        }
    }

    /// Contacts first, with gaps that films have; then films, whose gaps are not below those of contacts.
    fn try_to_correct(&mut self, flow: &[Twist<D>]) -> Result<Corrected<D>, GapError> {
        let mut films = self.start.films.clone();
        let near = std::mem::take(&mut self.films);
        let corrected = self.with_step(|contact, mobility, step| {
            let mut twists = flow.to_vec();
            let of_step = StepFilms { memory: &mut films, near: &near };
            let (report, of_films) = correct_gaps(contact, of_step, step, mobility, &mut twists)?;
            Ok((twists, report, of_films))
        });
        self.films = near;
        corrected.map(|(twists, report, of_films)| Corrected { twists, films, report, of_films })
    }

    /// The loads for a flow that may be so many times less accurate than the last one of the step.
    fn loads(&mut self, looseness: f64) -> Result<ContactLoads<D>, ContactError> {
        self.is_loose = looseness > 1.0;
        let wrenches = self.with_step(|contact, _, step| contact.loads(step))?;
        let [normal, stress_of_friction] = self.contact.stresses();
        Ok(ContactLoads { wrenches, stress: normal + stress_of_friction, stress_of_friction, looseness })
    }

    fn with_step<T>(
        &mut self,
        act: impl FnOnce(&mut dyn FlowForces<D>, &mut dyn TwistMobility<D>, &BodyStep<'_, D>) -> T,
    ) -> T {
        let StepStart { tilt, slide, .. } = self.start;
        self.contact.set_surroundings(tilt, slide * self.start.length(), self.shear_factor);
        self.start.with_step(self.particles, |step| act(self.contact, &mut *self.mobility, step))
    }
}
