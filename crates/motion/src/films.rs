//! Steps in which no gap closes.
//!
//! Where lubrication resists, the gap `g` of two particles follows `R(g) dg/dt = F` with a force `F` that
//! varies slowly and a resistance `R` that grows without bound as `g -> 0`: like `1/g` between spheres, like
//! `g^(-3/2)` between discs. An explicit scheme for `g` itself is inaccurate once the gap halves in a few
//! steps, and may step over zero. The *impulse*
//!
//! `Phi(g) = int R dg`, `d Phi/dt = F`,
//!
//! is taken by the same scheme instead, at the same order: `Phi(g^{n+1}) = Phi(g^n) + c F^n + (dt - c)
//! F^{n-1}`, and the particles are moved along the line of centres to the gap that this gives. Since `Phi ->
//! -inf` as `g -> 0`, gaps stay positive for any step. `Phi` is what the gluey contact model remembers as
//! `gamma` (Lefebvre 2009, 10.1051/m2an/2008042): in its limit of a vanishing viscosity a gap is closed as
//! long as `gamma < 0`. Here that limit is met where a film is thinner than positions resolve.
//!
//! Only the shape of `R` matters, not its scale: `R = 1 + s (rho(g) - rho(G))` for `g < G` and one beyond,
//! with `rho = A/g` for spheres, `(A/g)^(3/2)` for discs, where `2/A = 1/a + 1/b` for radii `a` and `b`.

use gluey_geom::{Dim, Particle, Space, Twist, Vector};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// Two particles, or one and a wall, with a film between them that lubrication keeps open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film<const D: usize> {
    /// Index of the particle.
    pub first: usize,
    /// Index of its partner; `None` for a wall, through which nothing flows: where the flow comes in or goes
    /// out a gap changes without a force, and the impulse says nothing.
    pub second: Option<usize>,
    /// From the centre of the first to that of its partner (the image that is meant), or to the wall.
    pub branch: Vector<D>,
    /// Velocity of the partner's image beyond its particle's own: in simple shear of the rate `r` the image
    /// `j` periods `H` up in `y` has `r j H` along `x` (Lees and Edwards 1972,
    /// 10.1088/0022-3719/5/15/006). Taken as constant in the step and the one before, but that it changes
    /// its sign with the flow. Zero for the particle itself and for walls.
    pub slide: Vector<D>,
    /// Whether the particle, and its partner, move as they are told and yield to nothing. Walls never yield,
    /// whatever is said of them here.
    pub is_held: [bool; 2],
    /// Distance of the surfaces; unit: length.
    pub gap: f64,
    /// `A`, with `2/A = 1/a + 1/b`; unit: length.
    pub curvature_radius: f64,
}

/// Films from this many `A` on are not corrected: `G / A`. Far enough for `F` to vary slowly: with the
/// paper's encounter of two spheres and a fifth of this, the error of reversibility is 16 times as large.
const REACH: f64 = 1.0;
/// Films are remembered up to this many times `G`, so that each has a history when it is first corrected.
const MEMORY_REACH: f64 = 1.5;
/// The scale `s` of the resistance: about that of two equal spheres.
const SCALE: f64 = 0.5;
/// Films are no thinner than this share of `A`, which positions resolve. Where the impulse asks for less it
/// is remembered, and the film opens when it has been made up for: that is the gluey contact.
const THINNEST: f64 = 1e-9;
/// Sweeps at most that open what is left closed then.
const MOST_OPENINGS: usize = 2000;
/// Sweeps over the films at most, widest first. Their targets may contradict each other where many particles
/// are close: what is left then, of the order of the error of the step, is left to the widest.
const MOST_SWEEPS: usize = 50;
/// A gap this near to its target, relative to it, is there.
const TOLERANCE: f64 = 1e-6;
/// A gap below this share of its target is opened whatever others ask for...
const LEAST_SHARE: f64 = 0.5;
/// ... to at least this share of `A`, so that sweeps come to an end.
const OPENING: f64 = 1e-2;

/// A gap that could not be kept open.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the film between {} would close: its gap of {gap} becomes {left} in a step; {}", names(*first, *second), cure(*is_given))]
pub struct FilmClosed {
    /// Index of the particle, from 0; messages count from 1.
    pub first: usize,
    /// Index of its partner; `None` for a wall.
    pub second: Option<usize>,
    /// Gap before the step.
    pub gap: f64,
    /// Gap after it.
    pub left: f64,
    /// Whether both move as they are told.
    pub is_given: bool,
}

fn names(first: usize, second: Option<usize>) -> String {
    match second {
        Some(second) => format!("particles {} and {}", first + 1, second + 1),
        None => format!("particle {} and a wall", first + 1),
    }
}

fn cure(is_given: bool) -> &'static str {
    match is_given {
        true => "both move as the case tells them to: let them pass each other, or end before",
        false => "take smaller steps",
    }
}

/// The forces in films at the last step.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(bound = ""))]
pub(crate) struct FilmMemory<const D: usize>(Vec<Remembered<D>>);

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

/// The step of a scheme: displacements are `weight u^n + history_weight u^{n-1}`.
pub(crate) struct Step<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    pub weight: f64,
    pub history_weight: f64,
    pub particles: &'a [Particle<D>],
    /// `u^{n-1}`; empty at the first step.
    pub history: &'a [Twist<D>],
}

/// A film with the gap it is to have after the step.
struct Target<'a, const D: usize> {
    film: &'a Film<D>,
    gap: f64,
    /// Whether it is to have it, or only not to close.
    is_corrected: bool,
}

impl<const D: usize> Film<D> {
    /// Whether neither side can yield.
    fn is_given(&self) -> bool {
        self.is_held[0] && (self.is_held[1] || self.second.is_none())
    }

    fn thinnest(&self) -> f64 {
        THINNEST * self.curvature_radius
    }

    fn reach_of_correction(&self) -> f64 {
        REACH * self.curvature_radius
    }

    /// `R(g)`.
    fn resistance(&self, gap: f64) -> f64 {
        let rho = |gap: f64| match D {
            2 => (self.curvature_radius / gap).powf(1.5),
            _ => self.curvature_radius / gap,
        };
        let reach = self.reach_of_correction();
        if gap < reach { 1.0 + SCALE * (rho(gap) - rho(reach)) } else { 1.0 }
    }

    /// `Phi(g)`, zero at `G`.
    fn impulse(&self, gap: f64) -> f64 {
        let (reach, a) = (self.reach_of_correction(), self.curvature_radius);
        if gap >= reach {
            return gap - reach;
        }
        let singular = match D {
            2 => {
                -2.0 * a.powf(1.5) * (gap.powf(-0.5) - reach.powf(-0.5))
                    - (a / reach).powf(1.5) * (gap - reach)
            }
            _ => a * (gap / reach).ln() - a / reach * (gap - reach),
        };
        gap - reach + SCALE * singular
    }

    /// The gap with this impulse, from the one at the beginning of the step: Newton's method in `ln g`, in
    /// which the impulse is convex, kept in a bracket.
    fn gap_of(&self, impulse: f64) -> f64 {
        let reach = self.reach_of_correction();
        if impulse >= 0.0 {
            return reach + impulse;
        }
        let (mut lower, mut upper) = (self.thinnest(), reach);
        if impulse <= self.impulse(lower) {
            return lower;
        }
        let mut gap = self.gap.clamp(lower, upper);
        for _ in 0..200 {
            let excess = self.impulse(gap) - impulse;
            if excess > 0.0 {
                upper = gap
            } else {
                lower = gap
            }
            let step = excess / (self.resistance(gap) * gap);
            if step.abs() <= 1e-14 {
                break;
            }
            let next = gap * (-step).exp();
            gap = if lower < next && next < upper { next } else { (lower * upper).sqrt() };
        }
        gap
    }

    /// Difference of a vector between the partner and the first; walls have none. An image moves for a time
    /// by its own slide besides: 1 makes velocities of it, the length of a step displacements.
    fn across(&self, of: impl Fn(usize) -> Vector<D>, time: f64) -> Vector<D> {
        self.second.map_or(Vector::zeros(), |second| of(second) + self.slide * time) - of(self.first)
    }
}

impl<const D: usize> FilmMemory<D>
where
    Dim<D>: Space<D>,
{
    /// Tells that the flow was reversed.
    pub fn reverse(&mut self) {
        self.0.iter_mut().for_each(|film| film.force = -film.force);
    }

    /// Forgets.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Corrects `twists` so that films have the gaps that their impulses give, and remembers the forces.
    ///
    /// # Errors
    /// [`FilmClosed`] where others leave no room; the memory is as before then.
    pub fn correct(
        &mut self,
        step: &Step<'_, D>,
        films: &[Film<D>],
        twists: &mut [Twist<D>],
    ) -> Result<(), FilmClosed> {
        let (mut targets, mut memory) = (Vec::new(), Vec::with_capacity(films.len()));
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
            let target = film.gap_of(impulse);
            let is_corrected = !film.is_given() && gap.min(target) < film.reach_of_correction();
            targets.push(Target { film, gap: target, is_corrected });
        }
        targets.sort_by(|a, b| b.film.gap.total_cmp(&a.film.gap));
        step.open(&targets, twists)?;
        self.0 = memory;
        Ok(())
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

impl<const D: usize> Step<'_, D>
where
    Dim<D>: Space<D>,
{
    /// See [`crate::Integrator::film_reach`].
    pub fn reach(&self, twists: &[Twist<D>]) -> f64 {
        let farthest = (0..twists.len()).map(|k| self.shift(k, twists).norm()).fold(0.0, f64::max);
        // Two particles approach each other at twice the speed of each.
        self.memory_reach() + 2.0 * farthest
    }

    /// See [`crate::Integrator::film_reach_in_shear`].
    pub fn reach_in_shear(&self, twists: &[Twist<D>], rate: f64) -> f64 {
        let strain = rate * (self.weight + self.history_weight);
        let rest = |k: usize| {
            let mut shift = self.shift(k, twists);
            shift[0] -= strain * self.particles[k].pose.position[1];
            shift
        };
        let count = twists.len();
        let mean = (0..count).map(rest).sum::<Vector<D>>() / count.max(1) as f64;
        let farthest = (0..count).map(|k| (rest(k) - mean).norm()).fold(0.0, f64::max);
        // Centres at the distance `2 a + reach` approach each other by the strain times that, besides.
        let (strain, diameter) = (strain.abs(), 2.0 * self.largest_radius());
        (self.memory_reach() + 2.0 * farthest + strain * diameter) / (1.0 - strain.min(0.5))
    }

    /// The gap up to which films are remembered; a wall has `A = 2 a`.
    fn memory_reach(&self) -> f64 {
        2.0 * self.largest_radius() * REACH * MEMORY_REACH
    }

    fn largest_radius(&self) -> f64 {
        self.particles.iter().map(|particle| particle.radius).fold(0.0, f64::max)
    }

    /// Displacement of a particle.
    fn shift(&self, k: usize, twists: &[Twist<D>]) -> Vector<D> {
        let old = self.history.get(k).map_or(Vector::zeros(), |twist| twist.velocity);
        twists[k].velocity * self.weight + old * self.history_weight
    }

    /// Moves particles along their lines of centres, pair after pair, until gaps are what they should be.
    fn open(&self, targets: &[Target<'_, D>], twists: &mut [Twist<D>]) -> Result<(), FilmClosed> {
        for _ in 0..MOST_SWEEPS {
            let mut worst = 0.0f64;
            for target in targets.iter().filter(|target| target.is_corrected) {
                worst = worst.max(self.move_to(target, twists));
            }
            if worst <= TOLERANCE {
                break;
            }
        }
        let mut given = targets.iter().filter(|target| target.film.is_given());
        given.try_for_each(|target| self.check_given(target.film, twists))?;
        for _ in 0..MOST_OPENINGS {
            let mut is_open = true;
            for target in targets.iter().filter(|target| !target.film.is_given()) {
                let least = LEAST_SHARE * target.gap.min(target.film.reach_of_correction());
                if self.gap_after(target.film, twists).0 < least {
                    is_open = false;
                    let gap = (2.0 * least).max(OPENING * target.film.curvature_radius);
                    self.move_to(&Target { gap, ..*target }, twists);
                }
            }
            if is_open {
                return Ok(());
            }
        }
        let closed =
            targets.iter().filter(|target| !target.film.is_given()).find_map(|Target { film, .. }| {
                let left = self.gap_after(film, twists).0;
                let Film { first, second, gap, .. } = **film;
                (left <= 0.0).then_some(FilmClosed { first, second, gap, left, is_given: false })
            });
        closed.map_or(Ok(()), Err)
    }

    /// Refuses given motions that close a film by more than rounding.
    fn check_given(&self, film: &Film<D>, twists: &[Twist<D>]) -> Result<(), FilmClosed> {
        let left = self.gap_after(film, twists).0;
        let Film { first, second, gap, .. } = *film;
        match left < -film.thinnest() {
            true => Err(FilmClosed { first, second, gap, left, is_given: true }),
            false => Ok(()),
        }
    }

    /// Gap of a film after the step, and its direction.
    fn gap_after(&self, film: &Film<D>, twists: &[Twist<D>]) -> (f64, Vector<D>) {
        let dt = self.weight + self.history_weight;
        let moved = film.branch + film.across(|k| self.shift(k, twists), dt);
        let distance = film.branch.norm();
        match film.second {
            Some(_) => (moved.norm() - distance + film.gap, moved.normalize()),
            // Along a wall the distance is that along its normal.
            None => {
                let n = film.branch / distance;
                (moved.dot(&n) - distance + film.gap, n)
            }
        }
    }

    /// Brings a film to its gap and returns by how much it was off, relative to that.
    fn move_to(&self, target: &Target<'_, D>, twists: &mut [Twist<D>]) -> f64 {
        let Film { first, second, is_held, .. } = *target.film;
        let (gap, n) = self.gap_after(target.film, twists);
        let velocity = n * ((target.gap - gap) / self.weight);
        // By their mobilities, which go like the inverse of the radius, or are zero.
        let share = match (is_held, second) {
            ([true, _], _) => 0.0,
            ([_, true], _) | (_, None) => 1.0,
            (_, Some(second)) => {
                let [a, b] = [first, second].map(|k| self.particles[k].radius);
                b / (a + b)
            }
        };
        twists[first].velocity -= velocity * share;
        if let Some(second) = second {
            twists[second].velocity += velocity * (1.0 - share);
        }
        (target.gap - gap).abs() / target.gap
    }
}
