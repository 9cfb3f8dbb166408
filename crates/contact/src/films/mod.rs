//! Steps in which no gap closes.
//!
//! What lubrication adds to the drag of two particles at the gap `g` is a force `F = R(g) dg/dt` that varies
//! slowly, and a resistance `R` that grows without bound as `g -> 0`: like `1/g` between spheres, like
//! `g^(-3/2)` between discs. An explicit scheme for `g` itself is inaccurate once the gap halves in a few
//! steps, and may step over zero. The *impulse*
//!
//! `Phi(g) = int R dg`, `d Phi/dt = F`,
//!
//! is taken by the same scheme instead, at the same order: the film asks for the impulse `I = Phi(g^n) + c
//! F^n + (dt - c) F^{n-1}`. What it asks for and what it has at the gap after the step are brought to balance
//! with the drag of the particles ([`balance`]): for one pair, which the flow alone would take to the gap
//! `g*`, `g + 2 Phi(g)/A = g* + 2 I/A`. Since `Phi -> -inf` as `g -> 0`, gaps stay positive for any step.
//! `Phi` is what the gluey contact model remembers as `gamma` (Lefebvre 2009, 10.1051/m2an/2008042): in its
//! limit of a vanishing viscosity a gap is closed as long as `gamma < 0`. Here that limit is met where a film
//! is thinner than positions resolve.
//!
//! Only the shape of `R` matters, not its scale: over the drag of two particles against each other, `A/2` in
//! the units of contact, it is `s (rho(g) - rho(G))` for `g < G`, and next to nothing beyond, with
//! `rho = A/g` for spheres, `(A/g)^(3/2)` for discs, where `2/A = 1/a + 1/b` for radii `a` and `b`.

mod balance;
mod error;
mod film;
mod opening;
mod step;

pub use error::FilmError;
pub use film::Film;
use opening::open;
pub use step::Step as FilmStep;
use step::Step;

use gluey_geom::{Dim, Space, Twist};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::{ContactState, PairState};

/// Films push a particle at most so many of its radii in a step. They are known up to gaps of three radii
/// beyond what the flow closes, so that no two can meet that were not known to be near.
const MOST_PUSHED: f64 = 1.0;

/// Forces and impulses of films at the last step, remembered like those of contacts: `lambda = -F`,
/// `gamma = Phi`.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct FilmMemory(ContactState);

/// What films did in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmReport {
    /// Films that are closed before the step: their gaps, 0.5e-9 to 1e-9 `A`, are a floor and no measurement.
    pub closed_count: usize,
    /// How far they move a particle from where the flow alone takes it, at most, in radii.
    pub largest_push: f64,
}

impl FilmMemory {
    /// Tells that the flow was reversed.
    pub fn reverse(&mut self) {
        self.0.reverse();
    }

    /// Corrects `twists` so that films have the gaps that their impulses give, and remembers the forces.
    ///
    /// # Errors
    /// [`FilmError`] where others leave no room; the memory is as before then.
    pub fn correct<const D: usize>(
        &mut self,
        step: &Step<'_, D>,
        films: &[Film<D>],
        twists: &mut [Twist<D>],
    ) -> Result<FilmReport, FilmError>
    where
        Dim<D>: Space<D>,
    {
        let free = twists.to_vec();
        let asked = |film: &Film<D>| {
            let gap = film.gap.max(film.thinnest());
            let force = |twists: &[Twist<D>]| {
                let rate = film.branch.normalize().dot(&film.across(|k| twists[k].velocity, 1.0));
                -film.resistance(gap) * rate
            };
            let (before, lambda) = (self.0.find(film.pair), force(twists));
            let old_lambda = match (before, step.history) {
                (_, []) => 0.0,
                (Some(before), _) => before.lambda,
                (None, history) => force(history),
            };
            let closed = before.filter(|_| gap <= 2.0 * film.thinnest());
            let start = closed.map_or(film.impulse(gap), |before| before.gamma);
            let gamma = start - step.weight * lambda - step.history_weight * old_lambda;
            PairState { pair: film.pair, gamma, lambda }
        };
        let mut states: Vec<PairState> = films.iter().map(asked).collect();
        open(step, films, &mut states, twists)?;
        let (particle, largest_push) = step.largest_push(&free, twists);
        if largest_push > MOST_PUSHED {
            return Err(FilmError::Pushed { particle, pushed: largest_push });
        }
        states.sort_unstable_by_key(|state| state.pair);
        self.0.pairs = states;
        let closed_count = films.iter().filter(|film| film.is_closed()).count();
        Ok(FilmReport { closed_count, largest_push })
    }
}
