//! Keeps the films of a step open.

use gluey_geom::Vector;

use super::balance::balance;
use super::error::FilmError;
use super::film::{Film, FilmLaw};
use crate::rows::Row;
use crate::{BodyStep, PairState};

/// Gaps that corrections push below this share of the reach are corrected too.
const PUSHED: f64 = 0.5;

/// Displacements of the particles, beside the `free` ones, with which films have the gaps that the impulses
/// of `states` give, as far as these agree and surfaces do not touch at the gaps `floors`; puts there what
/// the films have in the end.
///
/// # Errors
/// [`FilmError`].
pub(super) fn open<const D: usize>(
    step: &BodyStep<'_, D>,
    films: &[Film<D>],
    floors: &[f64],
    states: &mut [PairState],
    free: &[Vector<D>],
) -> Result<Vec<Vector<D>>, FilmError> {
    let rows: Vec<Row<D>> = films.iter().map(|film| film.row(step.dt)).collect();
    let gap = |k: usize, moved: &[Vector<D>]| rows[k].gap_at(&rows[k].between(|place| moved[place as usize]));
    let is_near = |k: usize, moved: &[Vector<D>], share: f64| {
        !films[k].is_given() && gap(k, moved) < share * films[k].reach_of_correction()
    };
    let concerns = |k: usize| {
        let is_wanted = films[k].gap < films[k].reach_of_correction() || states[k].gamma < 0.0;
        is_near(k, free, 1.0) || (is_wanted && !films[k].is_given())
    };
    let mut is_in: Vec<bool> = (0..films.len()).map(concerns).collect();
    let (chosen, mut found) = loop {
        let chosen: Vec<usize> = (0..films.len()).filter(|&k| is_in[k]).collect();
        let laws =
            chosen.iter().map(|&k| FilmLaw { film: &films[k], asked: states[k].gamma, floor: floors[k] });
        let found = balance(step, free, laws.collect())?;
        // Large steps push particles onto others that were far away.
        let more: Vec<usize> =
            (0..films.len()).filter(|&k| !is_in[k] && is_near(k, &found.moved, PUSHED)).collect();
        more.iter().for_each(|&k| is_in[k] = true);
        if more.is_empty() {
            break (chosen, found);
        }
    };
    chosen.into_iter().zip(found.impulses()).for_each(|(k, impulse)| states[k].gamma = impulse);
    for (k, film) in films.iter().enumerate() {
        check(film, gap(k, &found.moved), step.radii)?;
    }
    Ok(found.changes.split_off(1))
}

/// Refuses what closes a film by more than rounding, such as given motions.
fn check<const D: usize>(film: &Film<D>, left: f64, radii: &[f64]) -> Result<(), FilmError> {
    if left >= -film.thinnest() {
        return Ok(());
    }
    let radius = radii[film.pair.first as usize];
    let (gap, left) = (film.gap / radius, left / radius);
    Err(FilmError::Closed { pair: film.pair, gap, left, is_given: film.is_given() })
}
