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
//! Rough surfaces touch at a gap `g_0`. Their contact force is found with the velocities
//! ([`crate::FlowContact`]), as the one with which `I = Phi(g_0)`; a film is at `g_0` then, for which `Phi`
//! falls there without bound.
//!
//! Only the shape of `R` matters, not its scale: over the drag of two particles against each other, `A/2` in
//! the units of contact, it is `s (rho(g) - rho(G))` for `g < G`, and next to nothing beyond, with
//! `rho = A/g` for spheres, `(A/g)^(3/2)` for discs, where `2/A = 1/a + 1/b` for radii `a` and `b`.

mod balance;
mod error;
mod film;
mod opening;

pub use error::FilmError;
pub use film::{Film, film_reach};
use opening::open;

use gluey_geom::Twist;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::{BodyStep, ContactReport, ContactState, PairKey, PairState, StandingGap};

/// Films push a particle at most so many of its radii in a step. They are known up to gaps of three radii
/// beyond what the flow closes, so that no two can meet that were not known to be near.
const MOST_PUSHED: f64 = 1.0;

/// Forces and impulses of films at the last step, remembered like those of contacts: `lambda = -F`,
/// `gamma = Phi`.
///
/// ```
/// use gluey_contact::{BodyStep, Film, FilmMemory, PairKey};
/// use gluey_geom::{Pose, Twist, Vector};
///
/// // Two spheres that would overlap by 0.3 after the step.
/// let along = |x: f64| Vector::<3>::new(x, 0.0, 0.0);
/// let (pair, branch, slide) = (PairKey::new(0, 1), along(2.1), Vector::zeros());
/// let film = Film { pair, branch, slide, is_held: [false; 2], gap: 0.1, curvature_radius: 1.0 };
/// let (poses, drift, dt) = ([0.0, 2.1].map(|x| Pose::at(along(x))), [Twist::default(); 2], 1.0);
/// let step = BodyStep { poses: &poses, radii: &[1.0; 2], drift: &drift, velocity_weight: dt, dt };
/// let mut twists = [0.2, -0.2].map(|x| Twist { velocity: along(x), ..Twist::default() });
/// FilmMemory::default().open(&step, &[film], &mut twists)?;
/// assert!(0.1 + dt * (twists[1].velocity.x - twists[0].velocity.x) > 0.0);
/// # Ok::<(), gluey_contact::FilmError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct FilmMemory(ContactState);

/// Gap at which the surfaces of a pair touch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Floor {
    /// The gap; zero for smooth surfaces.
    pub gap: f64,
    /// Whether a contact presses them together there in the step.
    pub is_pressed: bool,
}

/// Report on the films of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmReport {
    /// Films that are closed before the step: their gaps, 0.5e-9 to 1e-9 `A`, are a floor and no measurement.
    pub closed_count: usize,
    /// How far they move a particle from where the flow alone takes it, at most, in radii.
    pub largest_push: f64,
}

/// Report on the gaps of a step: those of films, then those of contacts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GapReport {
    /// Films.
    pub films: FilmReport,
    /// Contacts.
    pub contacts: ContactReport,
    /// Of contacts whose forces act in the flow, their change by each flow of the step.
    pub changes: Vec<f64>,
}

impl FilmMemory {
    /// Tells that the flow was reversed.
    pub fn reverse(&mut self) {
        self.0.reverse();
    }

    /// Corrects `twists` so that films have the gaps that their impulses give, and remembers the forces.
    ///
    /// # Errors
    /// [`FilmError`] where others leave no room; twists and memory are as before then.
    pub fn open<const D: usize>(
        &mut self,
        step: &BodyStep<'_, D>,
        films: &[Film<D>],
        twists: &mut [Twist<D>],
    ) -> Result<FilmReport, FilmError> {
        self.open_above(step, films, &|_| Floor::default(), twists)
    }

    /// The same for surfaces that touch at the gap `floor` of their pair: no gap is below it by more than
    /// 1e-9 `A`, and those of pairs that are pressed together are there.
    ///
    /// # Errors
    /// Those of [`FilmMemory::open`].
    pub fn open_above<const D: usize>(
        &mut self,
        step: &BodyStep<'_, D>,
        films: &[Film<D>],
        floor: &dyn Fn(PairKey) -> Floor,
        twists: &mut [Twist<D>],
    ) -> Result<FilmReport, FilmError> {
        let weight = step.velocity_weight;
        let floors: Vec<Floor> = films.iter().map(|film| floor(film.pair)).collect();
        let asked = |(film, &Floor { gap: floor, is_pressed }): (&Film<D>, &Floor)| {
            let resistance = film.resistance(film.gap.max(floor).max(film.thinnest()));
            let lambda = -resistance * film.branch.normalize().dot(&film.across(|k| twists[k].velocity, 1.0));
            let free = self.known(step, film, floor) - weight * lambda;
            let gamma = if is_pressed { film.pressed(floor) } else { free };
            PairState { pair: film.pair, gamma, lambda }
        };
        let mut states: Vec<PairState> = films.iter().zip(&floors).map(asked).collect();
        let changes = open(
            step,
            films,
            &floors.iter().map(|floor| floor.gap).collect::<Vec<_>>(),
            &mut states,
            &step.moves(twists),
        )?;
        let pushes = changes.iter().zip(step.radii).map(|(change, radius)| change.norm() / radius);
        let farther = |most: (usize, f64), next: (usize, f64)| if next.1 > most.1 { next } else { most };
        let (particle, largest_push) = pushes.enumerate().fold((0, 0.0), farther);
        if largest_push > MOST_PUSHED {
            return Err(FilmError::Pushed { particle, pushed: largest_push });
        }
        twists.iter_mut().zip(changes).for_each(|(twist, change)| twist.velocity += change / weight);
        states.sort_unstable_by_key(|state| state.pair);
        self.0.pairs = states;
        let closed_count = films.iter().filter(|film| film.is_closed()).count();
        Ok(FilmReport { closed_count, largest_push })
    }
    /// The gap at the end of a step in which a film's sides stand still against each other, for surfaces that
    /// touch at the gap `floor`.
    pub fn standing_gap<const D: usize>(
        &self,
        step: &BodyStep<'_, D>,
        film: &Film<D>,
        floor: f64,
    ) -> StandingGap {
        let now = film.gap.max(floor).max(film.thinnest());
        let seen = |impulse: f64| now + (impulse - film.impulse(now)) / film.resistance(now);
        let (gap, floor) =
            (seen(self.known(step, film, floor)), seen(film.impulse(floor.max(film.thinnest()))));
        StandingGap { pair: film.pair, gap, floor }
    }

    /// The impulse at the end of a step but for what the velocities of the step add.
    fn known<const D: usize>(&self, step: &BodyStep<'_, D>, film: &Film<D>, floor: f64) -> f64 {
        let old_weight = step.dt - step.velocity_weight;
        let gap = film.gap.max(floor).max(film.thinnest());
        let before = self.0.find(film.pair);
        let of_history = || {
            let normal = film.branch.normalize();
            -film.resistance(gap) * normal.dot(&film.across(|k| step.drift[k].velocity, old_weight))
        };
        let force = before.map_or_else(of_history, |before| old_weight * before.lambda);
        // Rough surfaces forget what pressed them together.
        let closed = before.filter(|_| gap <= 2.0 * film.thinnest());
        closed.map_or(film.impulse(gap), |before| before.gamma) - force
    }
}
