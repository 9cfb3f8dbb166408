//! The time loop, one step at a time: predict, correct for contact, integrate.

mod accuracy;
mod error;
mod films;
mod in_contact;
mod part;
mod repelling;
mod state;
mod strain_clock;

use gluey_contact::{Contact, ContactModel, Domain, FilmMemory, GapReport, Repulsion};
use gluey_geom::{Dim, Matrix, Particle, Twist};
use gluey_motion::{
    Configuration, Fields, FlowStatistics, Holding, Hydrodynamics, Integrator, MeanStress, NoForces,
    Prediction, Scheme,
};

use crate::phases::PhaseTable;
use crate::tally::StepMotion;
use accuracy::Accuracy;
use in_contact::{StepStart, predicted_in_contact};
use part::Part;
use repelling::Repelling;

pub use error::{RestoreError, StepError};
pub use in_contact::FlowIteration;
pub use state::SimulationState;
pub use strain_clock::StrainClock;

/// Particles in a flow that `H` predicts, kept apart by `C`.
///
/// ```
/// use gluey::Simulation;
/// use gluey_contact::{ContactParams, PairContact};
/// use gluey_geom::{Particle, Vector};
/// use gluey_motion::{LinearFlow, PairMobility, Scheme};
///
/// let particles = vec![
///     Particle::new(Vector::<3>::new(0.3, 0.525, 0.5), 0.05),
///     Particle::new(Vector::<3>::new(0.7, 0.475, 0.5), 0.05),
/// ];
/// let flow = PairMobility::new(LinearFlow::shear(1.0, 0.5));
/// let contact = PairContact::new(ContactParams::default());
/// let mut simulation = Simulation::new(particles, Scheme::AdamsBashforth2, 0.05, flow, contact);
/// for _ in 0..20 {
///     simulation.step()?;
/// }
/// assert!((simulation.time() - 1.0).abs() < 1e-15);
/// # Ok::<(), gluey::StepError<gluey_motion::PairMobilityError>>(())
/// ```
#[derive(Debug)]
pub struct Simulation<const D: usize, H, C> {
    dt: f64,
    step: usize,
    /// The part of the step that is being done.
    part: Part,
    /// A step is halved so often at most.
    most_halvings: u32,
    accuracy: Accuracy<D>,
    reversed: bool,
    sliding: Option<Sliding>,
    repelling: Option<Repelling<D>>,
    /// Time, where steps are those of the strain.
    clock: Option<StrainClock>,
    /// Whether forces act that stay when the shear is reversed.
    has_forces: bool,
    strain: f64,
    particles: Vec<Particle<D>>,
    integrator: Integrator<D>,
    hydrodynamics: H,
    films: FilmMemory,
    contact: C,
    /// The last one, its velocities corrected; of the statistics, those of all flows of the step so far.
    prediction: Prediction<D>,
    gaps: GapReport,
    iteration: FlowIteration,
    motion: StepMotion,
    phases: PhaseTable,
}

/// Images that slide along each other in simple shear for ever.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sliding {
    /// The shear rate.
    pub rate: f64,
    /// Period across the shear, along `y`.
    pub height: f64,
    /// The stress is computed every so many steps, at least 1.
    pub stress_every: usize,
}

impl<const D: usize, H, C> Simulation<D, H, C>
where
    H: Hydrodynamics<D>,
    C: ContactModel<D>,
{
    /// A simulation at time 0 with steps of length `dt > 0`.
    pub fn new(particles: Vec<Particle<D>>, scheme: Scheme, dt: f64, hydrodynamics: H, contact: C) -> Self {
        let count = particles.len();
        Self {
            dt,
            step: 0,
            part: Part::WHOLE,
            most_halvings: 0,
            accuracy: Accuracy::new(scheme),
            reversed: false,
            sliding: None,
            repelling: None,
            clock: None,
            has_forces: false,
            strain: 0.0,
            particles,
            integrator: Integrator::new(scheme),
            hydrodynamics,
            films: FilmMemory::default(),
            contact,
            prediction: Prediction::of(vec![Twist::default(); count]),
            gaps: GapReport::default(),
            iteration: FlowIteration::default(),
            motion: StepMotion::default(),
            phases: PhaseTable::default(),
        }
    }

    /// The same where periodic images slide along each other, in a box without strain at time 0.
    #[must_use]
    pub fn sheared(self, sliding: Sliding) -> Self {
        Self { sliding: Some(sliding), ..self }
    }

    /// The same where a step in which films cannot be kept open is done in two halves, and these in halves
    /// again, up to so often; up to 20 times. The history of velocities knows how old it is: the order of the
    /// scheme stays.
    #[must_use]
    pub fn halving(self, most_halvings: u32) -> Self {
        Self { most_halvings, ..self }
    }

    /// The same where a step is done in parts, halves of halves up to as often as steps may be halved, in
    /// which the time scheme errs by no more than this, as estimated: in radii, in root mean square over the
    /// particles ([`gluey_motion::ErrorEstimate`]). What an estimate before a part had missed is counted.
    #[must_use]
    pub fn within(mut self, tolerance: f64) -> Self {
        self.accuracy.tolerance = Some(tolerance);
        self
    }

    /// The same where contacts whose forces act in the flow are iterated for so long.
    #[must_use]
    pub fn iterating(self, iteration: FlowIteration) -> Self {
        Self { iteration, ..self }
    }

    /// The same with particles that repel each other, their images and the walls of `surroundings`.
    #[must_use]
    pub fn repelling(mut self, law: Repulsion, surroundings: Domain<D>) -> Self {
        self.contact.in_flow().into_iter().for_each(|contact| contact.set_repulsion(law));
        Self { repelling: Some(Repelling::new(law, surroundings)), has_forces: true, ..self }
    }

    /// The same where forces act on the particles that do not change sign with the shear.
    #[must_use]
    pub fn under_forces(self) -> Self {
        Self { has_forces: true, ..self }
    }

    /// The same where the shear stress is given: steps are those of the strain, as at the shear rate one, and
    /// the flow tells at which rate that is.
    #[must_use]
    pub fn at_given_stress(self) -> Self {
        Self { clock: Some(StrainClock::default()), ..self }
    }

    /// Time and shear rate at the last prediction, where steps are those of the strain.
    pub fn time_and_rate(&self) -> Option<[f64; 2]> {
        let rate = self.prediction.rate * self.shear_factor();
        self.clock.as_ref().map(|clock| [clock.time(), rate])
    }

    /// Shear strain of the periodic images, where they slide; zero elsewhere.
    pub fn strain(&self) -> f64 {
        self.strain
    }

    fn shear_factor(&self) -> f64 {
        if self.reversed { -1.0 } else { 1.0 }
    }

    /// The shear rate at which images slide now.
    fn sliding_rate(&self) -> f64 {
        self.sliding.map_or(0.0, |sliding| sliding.rate) * self.shear_factor()
    }

    /// Velocity along `x` of the image one period up in `y`, beyond that of its particle.
    pub fn slide(&self) -> f64 {
        self.sliding_rate() * self.sliding.map_or(0.0, |sliding| sliding.height)
    }

    /// Does one step.
    pub fn step(&mut self) -> Result<(), StepError<H::Error>> {
        self.predict()?;
        self.correct()?;
        self.advance()
    }

    /// Computes the velocities of all particles where they are, without contact.
    pub fn predict(&mut self) -> Result<(), StepError<H::Error>> {
        let is_first = self.part.is_first();
        if is_first {
            (self.part, self.motion) = (Part::WHOLE, StepMotion::default());
        }
        self.part = self.accuracy.begin(self.part, self.dt, self.most_halvings);
        let (step, time) = (self.step, self.time());
        let start = std::time::Instant::now();
        let predicted = self.predicted();
        let named = predicted.as_ref().map_or(&[][..], |flow| &flow.statistics.phases);
        self.book_flow(start.elapsed().as_secs_f64(), named);
        let mut flow = predicted?;
        if !is_first {
            flow.statistics = flow.statistics.after(&self.prediction.statistics);
        }
        self.prediction = flow;
        let (rate, start) = (self.prediction.rate, self.part.start());
        self.clock.iter_mut().for_each(|clock| clock.reach(step, start, self.dt, rate));
        match self.twists().iter().position(|twist| !is_finite(twist)) {
            Some(index) => Err(StepError::NotFinite { particle: index + 1, step, time }),
            None => Ok(()),
        }
    }

    /// What the flow says of the particles where they are, and of the forces by which they repel each other.
    fn predicted(&mut self) -> Result<Prediction<D>, StepError<H::Error>> {
        let (step, time, strain) = (self.step, self.time(), self.strain);
        let particles = &self.particles[..];
        let is_due = |sliding: Sliding| self.part.is_first() && step.is_multiple_of(sliding.stress_every);
        let with_stress = self.sliding.is_some_and(is_due);
        let tilt = strain * self.sliding.map_or(0.0, |sliding| sliding.height);
        let repulsion = self.repelling.as_mut().map(|repelling| repelling.between(particles, tilt));
        let (wrenches, pair_stress) = repulsion.unwrap_or_else(|| (Vec::new(), Matrix::zeros()));
        if !(wrenches.is_empty() || self.hydrodynamics.answers_to_forces()) {
            return Err(StepError::Forces { step, time, source: NoForces });
        }
        let (shear_factor, wrenches, contacts) = (self.shear_factor(), &wrenches[..], None);
        let start = StepStart {
            integrator: &self.integrator,
            step,
            dt: self.dt,
            part: self.part,
            most_halvings: self.most_halvings,
            accuracy: &self.accuracy,
            limits: self.iteration,
            tilt,
            slide: self.slide(),
            sliding_rate: self.sliding_rate(),
            films: &self.films,
        };
        let now = Configuration {
            time,
            particles,
            shear_factor,
            strain,
            with_stress,
            wrenches,
            pair_stress,
            contacts,
        };
        let Some(contact) = self.contact.in_flow() else {
            return self.hydrodynamics.predict(&now).map_err(|source| StepError::Flow { step, time, source });
        };
        let found = predicted_in_contact(&mut self.hydrodynamics, contact, &now, start)?;
        (self.part, self.films) = (found.part, found.films);
        self.motion.refused = found.refused.or(self.motion.refused.take());
        if self.part.is_first() {
            self.gaps = found.gaps;
        }
        Ok(found.prediction)
    }

    /// Corrects the predicted velocities so that films that lubrication keeps open stay open, halving the
    /// step until they do, and so that nothing overlaps.
    pub fn correct(&mut self) -> Result<(), StepError<H::Error>> {
        if let Some(contact) = self.contact.in_flow() {
            contact.finish();
            self.note_error();
            return Ok(());
        }
        let films = self.keep_apart()?;
        self.note_error();
        let (step, time, dt) = (self.step, self.time(), self.part_length());
        if let Some(Sliding { height, .. }) = self.sliding {
            self.contact.set_sliding(self.strain * height, self.sliding_rate() * height * dt);
        }
        let Self { integrator, particles, contact, prediction, .. } = self;
        let correct = || {
            integrator.with_step(dt, particles, |step| contact.correct_bodies(step, &mut prediction.twists))
        };
        let contacts = self.phases.time("contact", correct).map_err(|source| StepError::Contact {
            step,
            time,
            source,
        })?;
        if self.part.is_first() {
            self.gaps = GapReport { films, contacts, changes: Vec::new() };
        }
        self.gaps.films.largest_push = self.gaps.films.largest_push.max(films.largest_push);
        Ok(())
    }

    /// Notes how accurate the last part was, from the velocities before contacts that correct them after the
    /// flow: those jump.
    fn note_error(&mut self) {
        let length = self.part_length();
        let Self { accuracy, particles, prediction, motion, .. } = self;
        accuracy.note(&prediction.twists, particles, length, motion);
    }

    /// Moves the particles with the corrected velocities. Where these are for a part of the step only, the
    /// rest of it is done as well, part by part.
    pub fn advance(&mut self) -> Result<(), StepError<H::Error>> {
        self.advance_part();
        while let Some(next) = self.part.next() {
            self.part = next;
            self.predict()?;
            self.correct()?;
            self.advance_part();
        }
        self.part = Part::WHOLE;
        self.step += 1;
        Ok(())
    }

    fn advance_part(&mut self) {
        let dt = self.part_length();
        let (integrator, particles) = (&mut self.integrator, &mut self.particles);
        self.phases.time("motion", || integrator.advance(dt, particles, &self.prediction.twists));
        self.strain += self.sliding_rate() * dt;
        let StepMotion { parts, shortest, .. } = self.motion;
        let share = self.part.share();
        self.motion.shortest = if parts == 0 { share } else { shortest.min(share) };
        self.motion.parts += 1;
    }

    /// Reverses the shear from the next step on.
    ///
    /// In Stokes flow all velocities change sign at once, and so does the history of the integrator; what
    /// contacts remember of the impulse between particles stays. Where forces act that stay as they are, or
    /// rough surfaces push each other, velocities are others, and the integrator begins anew.
    pub fn reverse_shear(&mut self) {
        self.reversed = !self.reversed;
        let is_reversible = self.contact.in_flow().is_none_or(|contact| contact.is_reversible());
        match self.has_forces || !is_reversible {
            true => self.integrator.restart(),
            false => self.integrator.reverse(),
        }
        self.accuracy.estimate.restart();
        self.films.reverse();
        self.contact.reverse();
    }

    /// Whether the shear is reversed now.
    pub fn is_reversed(&self) -> bool {
        self.reversed
    }

    /// Steps done.
    pub fn step_index(&self) -> usize {
        self.step
    }

    /// Time reached.
    pub fn time(&self) -> f64 {
        (self.step as f64 + self.part.start()) * self.dt
    }

    /// Length of the part of the step that is being done.
    fn part_length(&self) -> f64 {
        self.dt * self.part.share()
    }

    /// The particles where they are now.
    pub fn particles(&self) -> &[Particle<D>] {
        &self.particles
    }

    /// The velocities computed last.
    pub fn twists(&self) -> &[Twist<D>] {
        &self.prediction.twists
    }

    /// The contact model.
    pub fn contact(&self) -> &C {
        &self.contact
    }

    /// Pairs in contact at the last correction.
    pub fn contacts(&self) -> &[Contact] {
        self.contact.contacts()
    }

    /// Effort and outcome of the last correction, of the first part of the step; the largest push of films is
    /// that of all parts so far.
    pub fn gaps(&self) -> &GapReport {
        &self.gaps
    }

    /// Flow fields of the last prediction.
    pub fn fields(&self) -> Option<Fields<D>> {
        self.hydrodynamics.fields()
    }

    /// The mean stress of the last prediction, where the flow has one.
    pub fn stress(&self) -> Option<&MeanStress<D>> {
        self.prediction.stress.as_ref()
    }

    /// What held the particles that move as they are told at the last prediction, if there are any.
    pub fn holding(&self) -> Option<&Holding<D>> {
        self.prediction.holding.as_ref()
    }

    /// Size and effort of the flows of the last step, or of the one that is being done so far.
    pub fn statistics(&self) -> &FlowStatistics {
        &self.prediction.statistics
    }

    /// How the particles were moved in the last step, or are in the one that is being done.
    pub fn motion(&self) -> &StepMotion {
        &self.motion
    }

    /// Wall time spent so far, phase by phase.
    pub fn phases(&self) -> &PhaseTable {
        &self.phases
    }

    /// The same, to book more on it.
    pub fn phases_mut(&mut self) -> &mut PhaseTable {
        &mut self.phases
    }

    /// The state that [`Simulation::restore`] needs; taken between steps.
    ///
    /// # Errors
    /// If the flow cannot store what it starts from.
    pub fn state(&self) -> Result<SimulationState<D>, H::Error> {
        Ok(SimulationState {
            step: self.step,
            reversed: self.reversed,
            strain: self.strain,
            clock: self.clock.clone(),
            particles: self.particles.clone(),
            integrator: self.integrator.clone(),
            estimate: self.accuracy.estimate.clone(),
            films: self.films.clone(),
            repelling: self.repelling.as_ref().map(Repelling::checkpoint).unwrap_or_default(),
            contact: self.contact.checkpoint(),
            hydrodynamics: self.hydrodynamics.checkpoint()?,
        })
    }

    /// Goes on from `state`.
    ///
    /// # Errors
    /// If it is not of a simulation like this one, which is unchanged then but for the flow.
    pub fn restore(&mut self, state: SimulationState<D>) -> Result<(), RestoreError<H::Error>> {
        let radii = state.particles.iter().map(|particle| particle.radius);
        if !radii.eq(self.particles.iter().map(|particle| particle.radius)) {
            let (saved, present) = (state.particles.len(), self.particles.len());
            return Err(RestoreError::Particles { saved, present });
        }
        self.hydrodynamics.resume(&state.hydrodynamics)?;
        self.contact.resume(state.contact)?;
        self.repelling.as_mut().map_or(Ok(()), |repelling| repelling.resume(state.repelling))?;
        self.step = state.step;
        self.reversed = state.reversed;
        self.strain = state.strain;
        self.clock = state.clock;
        self.particles = state.particles;
        self.integrator = state.integrator;
        self.accuracy.estimate = state.estimate;
        self.films = state.films;
        Ok(())
    }

    /// Books the time of a prediction on the phases that the flow names, and the rest on "flow".
    fn book_flow(&mut self, seconds: f64, named: &[(&'static str, f64)]) {
        let rest = seconds - named.iter().map(|(_, seconds)| seconds).sum::<f64>();
        named.iter().for_each(|(name, seconds)| self.phases.add(name, *seconds));
        self.phases.add("flow", rest.max(0.0));
    }
}

fn is_finite<const D: usize>(twist: &Twist<D>) -> bool {
    let numbers = twist.velocity.iter().chain(Dim::<D>::spin_slice(&twist.spin));
    numbers.into_iter().all(|number| number.is_finite())
}
