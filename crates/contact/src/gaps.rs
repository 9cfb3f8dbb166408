//! The gaps of a step: contacts whose forces act in the flow, and the films between the same particles.

use gluey_geom::Twist;

use crate::{
    BodyStep, ContactError, Film, FilmError, FilmMemory, FilmReport, Floor, FlowContactReport, FlowForces,
    TwistMobility,
};

/// Reason why there are no motions that films and contacts allow.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GapError {
    /// Films are not in balance.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// Contacts have no forces.
    #[error(transparent)]
    Contact(#[from] ContactError),
}

/// Films of a step.
#[derive(Debug)]
pub struct StepFilms<'a, const D: usize> {
    /// Memory before the step, then that after it.
    pub memory: &'a mut FilmMemory,
    /// Films where particles are at the beginning of the step.
    pub near: &'a [Film<D>],
}

/// Corrects `twists`, those of a flow with the forces of contacts: first for the forces with which no film is
/// thinner than its contact allows, then so that films have the gaps that their impulses give.
///
/// # Errors
/// [`GapError`]; the memory is as before then, the twists are of no use.
pub fn correct_gaps<const D: usize>(
    contact: &mut dyn FlowForces<D>,
    films: StepFilms<'_, D>,
    step: &BodyStep<'_, D>,
    mobility: &mut dyn TwistMobility<D>,
    twists: &mut [Twist<D>],
) -> Result<(FlowContactReport, FilmReport), GapError> {
    let StepFilms { memory, near } = films;
    let standing =
        |film: &Film<D>| memory.standing_gap(step, film, contact.smallest_gap(film.pair, step.radii));
    let standing = near.iter().map(standing).collect();
    contact.set_standing_gaps(standing);
    let report = contact.correct(step, mobility, twists)?;
    let floor = |pair| {
        let is_pressed = contact.forces().binary_search_by_key(&pair, |force| force.pair).is_ok();
        Floor { gap: contact.smallest_gap(pair, step.radii), is_pressed }
    };
    let of_films = memory.open_above(step, near, &floor, twists)?;
    contact.measure_gaps(step, twists)?;
    Ok((report, of_films))
}
