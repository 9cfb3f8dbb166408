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
//! `g*`,
//! `g + Phi(g) = g* + I`. Since `Phi -> -inf` as `g -> 0`, gaps stay positive for any step. `Phi` is what the
//! gluey contact model remembers as `gamma` (Lefebvre 2009, 10.1051/m2an/2008042): in its limit of a
//! vanishing viscosity a gap is closed as long as `gamma < 0`. Here that limit is met where a film is thinner
//! than positions resolve.
//!
//! Only the shape of `R` matters, not its scale: over the drag of two particles against each other it is
//! `R = s (rho(g) - rho(G))` for `g < G`, and next to nothing beyond, with `rho = A/g` for spheres,
//! `(A/g)^(3/2)` for discs, where `2/A = 1/a + 1/b` for radii `a` and `b`.

mod balance;
mod error;
mod film;
mod opening;
mod step;

pub use error::{FilmClosed, FilmEnds, FilmError};
pub use film::Film;
use opening::open;
pub use step::Step as FilmStep;
use step::Step;

use gluey_geom::{Dim, Space, Twist, Vector};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// Films push a particle at most so many of its radii in a step. They are known up to gaps of three radii
/// beyond what the flow closes, so that no two can meet that were not known to be near.
const MOST_PUSHED: f64 = 1.0;

/// The forces in films at the last step.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub struct FilmMemory<const D: usize>(Vec<Remembered<D>>);

/// What films did in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmReport {
    /// Films that are closed before the step: their gaps, 0.5e-9 to 1e-9 `A`, are a floor and no measurement.
    pub closed_count: usize,
    /// How far they move a particle from where the flow alone takes it, at most, in radii.
    pub largest_push: f64,
}

/// The force `F` in a film and its impulse.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
struct Remembered<const D: usize> {
    first: usize,
    second: Option<usize>,
    branch: Vector<D>,
    force: f64,
    /// `Phi` after the step.
    impulse: f64,
}

impl<const D: usize> FilmMemory<D>
where
    Dim<D>: Space<D>,
{
    /// Tells that the flow was reversed.
    pub fn reverse(&mut self) {
        self.0.iter_mut().for_each(|film| film.force = -film.force);
    }

    /// Corrects `twists` so that films have the gaps that their impulses give, and remembers the forces.
    ///
    /// # Errors
    /// [`FilmError`] where others leave no room; the memory is as before then.
    pub fn correct(
        &mut self,
        step: &Step<'_, D>,
        films: &[Film<D>],
        twists: &mut [Twist<D>],
    ) -> Result<FilmReport, FilmError> {
        let free = twists.to_vec();
        let (mut impulses, mut memory) = (Vec::with_capacity(films.len()), Vec::with_capacity(films.len()));
        for film in films {
            let Film { first, second, branch, .. } = *film;
            let gap = film.gap.max(film.thinnest());
            let rate =
                |twists: &[Twist<D>]| branch.normalize().dot(&film.across(|k| twists[k].velocity, 1.0));
            let force = film.resistance(gap) * rate(twists);
            let before = self.of(film, films);
            let old_force = match (before, step.history) {
                (_, []) => 0.0,
                (Some(before), _) => before.force,
                (None, history) => film.resistance(gap) * rate(history),
            };
            let closed = before.filter(|_| gap <= 2.0 * film.thinnest());
            let start = closed.map_or(film.impulse(gap), |before| before.impulse);
            let impulse = start + step.weight * force + step.history_weight * old_force;
            memory.push(Remembered { first, second, branch, force, impulse });
            impulses.push(impulse);
        }
        open(step, films, &mut impulses, twists)?;
        memory.iter_mut().zip(impulses).for_each(|(film, impulse)| film.impulse = impulse);
        let (particle, largest_push) = step.largest_push(&free, twists);
        if largest_push > MOST_PUSHED {
            return Err(FilmError::Pushed { particle, pushed: largest_push });
        }
        self.0 = memory;
        let closed_count = films.iter().filter(|film| film.is_closed()).count();
        Ok(FilmReport { closed_count, largest_push })
    }

    /// What is remembered of a film, which is one of these.
    fn of(&self, film: &Film<D>, films: &[Film<D>]) -> Option<&Remembered<D>> {
        let old = of_pair(&self.0, film, |old| (old.first, old.second));
        let apart = |old: &Remembered<D>, film: &Film<D>| (old.branch - film.branch).norm_squared();
        let nearest = old.iter().min_by(|a, b| apart(a, film).total_cmp(&apart(b, film)))?;
        // Of images across borders, the one in about this direction, if it is not that of another film.
        let mut others = of_pair(films, film, |film| (film.first, film.second)).iter();
        let is_of_another = others.any(|other| apart(nearest, other) < apart(nearest, film));
        (nearest.branch.dot(&film.branch) > 0.0 && !is_of_another).then_some(nearest)
    }
}

/// The part of a list, sorted by particles, that joins the same as a film.
fn of_pair<'a, T, const D: usize>(
    list: &'a [T],
    film: &Film<D>,
    pair: impl Fn(&T) -> (usize, Option<usize>),
) -> &'a [T] {
    let wanted = (film.first, film.second);
    let start = list.partition_point(|item| pair(item) < wanted);
    let count = list[start..].iter().take_while(|item| pair(item) == wanted).count();
    &list[start..start + count]
}
