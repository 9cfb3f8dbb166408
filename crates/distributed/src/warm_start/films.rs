//! What is kept of films, on its way from the rank that had a film to the one that has it now.

use gluey_levelset::Ball;
use gluey_parallel::{Communicator, route};
use gluey_stokes::Partition;
use gluey_stokes::part::numbers_of_film;
use serde::{Deserialize, Serialize};

/// Numbers of a film beside its bodies, at most.
const MOST_NUMBERS: usize = 12;

/// A film of a flow that is kept: how old the flow is, the bodies by their numbers among all, and numbers
/// that [`gluey_stokes::NodalFields::films`] has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptFilm([u64; 3 + MOST_NUMBERS]);

impl KeptFilm {
    /// 0 for the last flow, 1 for the one before.
    pub fn age(&self) -> usize {
        self.0[0] as usize
    }

    /// As it is after one more flow.
    #[must_use]
    pub fn older(mut self) -> Self {
        self.0[0] += 1;
        self
    }

    fn first_body(&self) -> u32 {
        self.0[1] as u32
    }

    /// Negative for a wall.
    fn partner(&self) -> f64 {
        f64::from_bits(self.0[2])
    }
}

/// Films of the last flow whose bodies are places in `ids`.
pub fn kept<const D: usize>(ids: &[u32], films: &[f64]) -> Vec<KeptFilm> {
    let id = |place: f64| if place < 0.0 { place } else { f64::from(ids[place as usize]) };
    let film = |numbers: &[f64]| {
        let mut film = [0; 3 + MOST_NUMBERS];
        film[1] = id(numbers[0]) as u64;
        film[2] = id(numbers[1]).to_bits();
        film[3..].iter_mut().zip(&numbers[2..]).for_each(|(bits, number)| *bits = number.to_bits());
        KeptFilm(film)
    };
    films.chunks_exact(numbers_of_film::<D>()).map(film).collect()
}

/// The other way round, without films of bodies that are not among `ids`, which ascend.
pub fn near<'f, const D: usize>(ids: &[u32], films: impl Iterator<Item = &'f KeptFilm>) -> Vec<f64> {
    let place = |id: u32| ids.binary_search(&id).ok().map(|place| place as f64);
    let mut numbers = Vec::new();
    for film in films {
        let partner = film.partner();
        let partner = if partner < 0.0 { Some(partner) } else { place(partner as u32) };
        let Some((body, partner)) = place(film.first_body()).zip(partner) else { continue };
        numbers.extend([body, partner]);
        let rest = numbers_of_film::<D>() - 2;
        numbers.extend(film.0[3..][..rest].iter().map(|&bits| f64::from_bits(bits)));
    }
    numbers
}

/// The films whose first bodies are near the part of the rank, wherever they were. `films` become those of
/// first bodies that it owns. All ranks call this.
pub fn exchanged<const D: usize>(
    partition: &Partition<D>,
    balls: &[Ball<D>],
    films: &mut Vec<KeptFilm>,
) -> Vec<KeptFilm> {
    let (ranks, asked) = (&partition.ranks, &partition.bodies.ids);
    let owner = |body: u32| partition.owner_of_point(balls[body as usize].center());
    let sent = films.iter().map(|film| (owner(film.first_body()), film.0)).collect();
    *films = route(ranks, sent).into_iter().map(KeptFilm).collect();
    films.sort_by_key(KeptFilm::first_body);
    let questions = asked.iter().map(|&body| (owner(body), [ranks.rank() as u64, u64::from(body)]));
    let mut answers = Vec::new();
    for [asker, body] in route(ranks, questions.collect()) {
        let first = films.partition_point(|film| u64::from(film.first_body()) < body);
        let of_body = films[first..].iter().take_while(|film| film.0[1] == body);
        answers.extend(of_body.map(|film| (asker as usize, film.0)));
    }
    route(ranks, answers).into_iter().map(KeptFilm).collect()
}
