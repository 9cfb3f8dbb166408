//! What keeps particles apart before contacts that correct velocities after the flow: repulsion, then films.

use gluey_contact::{ContactError, ContactModel, FilmError, FilmReport, GapError, TwistMobility, film_reach};
use gluey_geom::Twist;
use gluey_motion::{Configuration, Hydrodynamics, NoForces};

use super::error::{StepError, end_after, half_after};
use super::part::Part;
use super::repelling::Repelling;
use super::{Simulation, Sliding};

impl<const D: usize, H, C> Simulation<D, H, C>
where
    H: Hydrodynamics<D>,
    C: ContactModel<D>,
{
    /// Lets particles repel each other and films stay open in the part of the step that is to be done, which
    /// is halved until they do, and until the time scheme is accurate.
    pub(super) fn keep_apart(&mut self) -> Result<FilmReport, StepError<H::Error>> {
        let mut mobility = self.mobility_of_repulsion()?;
        let (predicted, films) = (self.prediction.twists.clone(), self.films.clone());
        loop {
            let repelled =
                mobility.as_deref_mut().map_or(Ok(()), |mobility| self.repel(mobility, &predicted));
            let opened = repelled.map_err(GapError::from);
            let error = match opened.and_then(|()| Ok(self.open_films()?)) {
                Ok(report) => {
                    if let Some(half) = self.half_for_accuracy() {
                        self.part = half;
                        self.films = films.clone();
                        self.prediction.twists.copy_from_slice(&predicted);
                        continue;
                    }
                    self.repelling.iter_mut().for_each(Repelling::finish);
                    return Ok(report);
                }
                Err(error) => error,
            };
            let (step, time, length) = (self.step, self.time(), self.part_length());
            let (half, reason) = (half_after(&error, self.part, self.most_halvings), error.to_string());
            self.part = half.ok_or_else(|| end_after(error, step, time, length))?;
            self.motion.refused = Some(reason);
        }
    }

    fn half_for_accuracy(&self) -> Option<Part> {
        let Self { accuracy, part, most_halvings, dt, prediction, particles, .. } = self;
        accuracy.half_of(*part, *most_halvings, *dt, &prediction.twists, particles)
    }

    /// The mobility in which the repulsion of the step is sought.
    fn mobility_of_repulsion(&self) -> Result<Option<Box<dyn TwistMobility<D>>>, StepError<H::Error>> {
        if self.repelling.is_none() {
            return Ok(None);
        }
        let (step, time) = (self.step, self.time());
        let mobility = self.hydrodynamics.near_mobility(&self.configuration());
        let mobility = mobility.map_err(|source| StepError::Flow { step, time, source })?;
        mobility.map(Some).ok_or(StepError::Forces { step, time, source: NoForces })
    }

    /// The motions with the repulsion of the part of the step, from those with that of its beginning.
    fn repel(
        &mut self,
        mobility: &mut dyn TwistMobility<D>,
        predicted: &[Twist<D>],
    ) -> Result<(), ContactError> {
        let (dt, rate) = (self.part_length(), self.prediction.rate);
        let tilt = self.strain * self.sliding.map_or(0.0, |Sliding { height, .. }| height);
        let surroundings = [tilt, self.slide() * dt, rate];
        let Self { integrator, particles, repelling, prediction, phases, .. } = self;
        prediction.twists.copy_from_slice(predicted);
        let Some(repelling) = repelling else { return Ok(()) };
        integrator.with_step(dt, particles, |step| {
            phases.time("motion", || repelling.correct(surroundings, step, mobility, &mut prediction.twists))
        })
    }

    fn open_films(&mut self) -> Result<FilmReport, FilmError> {
        let (dt, rate, time) = (self.part_length(), self.sliding_rate(), self.time());
        let (shear_factor, strain) = (self.shear_factor(), self.strain);
        let Self { integrator, particles, hydrodynamics, films, prediction, phases, .. } = self;
        integrator.with_step(dt, particles, |step| {
            let now = Configuration { shear_factor, strain, ..Configuration::at(time, particles) };
            let near = hydrodynamics.films(&now, film_reach(step, &prediction.twists, rate));
            phases.time("motion", || films.open(step, &near, &mut prediction.twists))
        })
    }

    /// Particles and surroundings where they are.
    fn configuration(&self) -> Configuration<'_, D> {
        let (shear_factor, strain) = (self.shear_factor(), self.strain);
        Configuration { shear_factor, strain, ..Configuration::at(self.time(), &self.particles) }
    }
}
