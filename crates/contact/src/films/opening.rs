//! Keeps the films of a step open.

use gluey_geom::{Dim, Space, Twist};

use super::balance::balance;
use super::error::FilmError;
use super::film::Film;
use super::step::Step;
use crate::PairState;

/// Gaps that corrections push below this share of the reach are corrected too.
const PUSHED: f64 = 0.5;

/// Corrects velocities so that films have the gaps that the impulses of `states` give, as far as these agree,
/// and puts there what the films have in the end.
///
/// # Errors
/// [`FilmError`].
pub(super) fn open<const D: usize>(
    step: &Step<'_, D>,
    films: &[Film<D>],
    states: &mut [PairState],
    twists: &mut [Twist<D>],
) -> Result<(), FilmError>
where
    Dim<D>: Space<D>,
{
    let free = twists.to_vec();
    let is_near = |film: &Film<D>, twists: &[Twist<D>], share: f64| {
        !film.is_given() && step.gap_after(film, twists) < share * film.reach_of_correction()
    };
    let concerns = |k: usize| {
        let film = &films[k];
        let is_wanted = film.gap < film.reach_of_correction() || states[k].gamma < 0.0;
        is_near(film, &free, 1.0) || (is_wanted && !film.is_given())
    };
    let mut is_in: Vec<bool> = (0..films.len()).map(concerns).collect();
    let found = loop {
        twists.copy_from_slice(&free);
        let chosen: Vec<usize> = (0..films.len()).filter(|&k| is_in[k]).collect();
        let wanted: Vec<_> = chosen.iter().map(|&k| (&films[k], states[k].gamma)).collect();
        let found = balance(step, &wanted, twists)?;
        // Large steps push particles onto others that were far away.
        let more: Vec<usize> =
            (0..films.len()).filter(|&k| !is_in[k] && is_near(&films[k], twists, PUSHED)).collect();
        more.iter().for_each(|&k| is_in[k] = true);
        if more.is_empty() {
            break chosen.into_iter().zip(found);
        }
    };
    found.for_each(|(k, impulse)| states[k].gamma = impulse);
    films.iter().try_for_each(|film| check(step, film, twists))
}

/// Refuses what closes a film by more than rounding, such as given motions.
fn check<const D: usize>(step: &Step<'_, D>, film: &Film<D>, twists: &[Twist<D>]) -> Result<(), FilmError>
where
    Dim<D>: Space<D>,
{
    let left = step.gap_after(film, twists);
    if left >= -film.thinnest() {
        return Ok(());
    }
    let radius = step.particles[film.pair.first as usize].radius;
    let (gap, left) = (film.gap / radius, left / radius);
    Err(FilmError::Closed { pair: film.pair, gap, left, is_given: film.is_given() })
}
