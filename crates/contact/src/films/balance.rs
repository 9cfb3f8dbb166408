//! Gaps after a step, in balance with the drag of the particles.
//!
//! Each film asks for an impulse `I`. Particles may be so crowded that they have fewer ways to move than
//! there are films, and cannot do what all ask for. Displaced by `x` from where the flow takes it, the
//! particle `i` of the radius `a_i` meets the impulse `a_i x_i` of its drag, and
//!
//! `a_i x_i = sum_k +- n_k L_k`, `L_k = I_k - Phi(g_k)`, `g_k = gap_k(x) > 0`:
//!
//! what films do not get loads the particles. That is the minimum of `sum_k int (Phi - I_k) dg_k + sum_i a_i
//! |x_i|^2 / 2`. A film much thinner than its neighbours is changed by them in proportion to itself: none is
//! closed, whatever they ask for.
//!
//! Solved for the loads `L`, which are free: `gap_k(x(L)) - Phi^-1(I_k - L_k) = 0`, where gaps are linear
//! in `x` the gradient of a convex function, by Newton's method with conjugate gradients. Gaps are linearised
//! about the bodies where they are, then about where they went, until they are exact. The distance of
//! centres is convex in `x`: gaps are never below those linearised.

use gluey_geom::{Dim, Space, Twist, Vector};

use super::error::FilmError;
use super::film::Film;
use super::step::Step;

/// A gap this near to where it should be, relative to it, is there: what is left adds up over thousands of
/// steps...
const TOLERANCE: f64 = 1e-10;
/// ... or as near as this share of the thinnest film.
const LEAST: f64 = 1e-2;
/// After the last linearisation a gap may be off by this share of itself, and by that of the thinnest film.
const ACCEPTED: f64 = 1e-6;
/// Linearisations of the gaps at most. Steps in which particles move far around each other would take more.
const MOST_PASSES: usize = 50;
/// Newton steps of one of them at most. A linear problem takes one to ten.
const MOST_NEWTON_STEPS: usize = 100;
/// Iterations of a Newton step at most; what is left then is left to the next.
const MOST_ITERATIONS: usize = 2000;
/// Films are taken to yield at least so much in a Newton step, over the mobility of their particles
/// (Levenberg 1944, 10.1090/qam/10666): where more of them are closed than particles have ways to move, gaps
/// do not tell their loads. More where steps had to be shortened a lot, less where they were right.
const SOFTENINGS: [f64; 2] = [1e-6, 0.1];
/// By which factor.
const HARDENING: f64 = 10.0;
/// Newton steps are shortened where the slope along them does not fall to this share of itself...
const SLOPE: f64 = 0.9;
/// ... to no less than this share.
const SHORTEST: f64 = 1e-12;
/// Steps below this share are much shortened.
const SHORT: f64 = 0.25;
/// Linear problems are solved this much more accurately than gaps.
const MARGIN: f64 = 0.1;

/// Films whose gaps are linear in the displacements of their particles.
struct Balance<'a, const D: usize> {
    /// Films, and the impulses that they ask for.
    wanted: &'a [(&'a Film<D>, f64)],
    /// Their particles; a wall has the number that comes after those of the particles.
    ends: Vec<[usize; 2]>,
    /// `1/a` of each particle; zero for those that are held, and for walls.
    mobilities: Vec<f64>,
    normals: Vec<Vector<D>>,
    /// Gaps without loads.
    free_gaps: Vec<f64>,
    /// `L`.
    loads: Vec<f64>,
    state: State,
    /// Newton steps so far.
    corrections: usize,
}

/// What loads lead to.
#[derive(Clone, Default)]
struct State {
    /// Gaps that films have under their loads.
    gaps: Vec<f64>,
    /// `-dg/dL` of each film.
    compliances: Vec<f64>,
    /// Gaps between the particles less those of their films.
    excess: Vec<f64>,
}

/// Moves particles so that impulses balance; returns those that films have then.
///
/// # Errors
/// [`FilmError`].
pub(super) fn balance<const D: usize>(
    step: &Step<'_, D>,
    wanted: &[(&Film<D>, f64)],
    twists: &mut [Twist<D>],
) -> Result<Vec<f64>, FilmError>
where
    Dim<D>: Space<D>,
{
    let free = twists.to_vec();
    let mut balance = Balance::new(step, wanted);
    for pass in 0..MOST_PASSES {
        balance.linearise(step, &free, (pass > 0).then_some(&*twists));
        let is_solved = balance.solve();
        for ((twist, free), moved) in twists.iter_mut().zip(&free).zip(balance.displacements(&balance.loads))
        {
            twist.velocity = free.velocity + moved / step.weight;
        }
        if !is_solved {
            break;
        }
        let off = |k: usize| step.gap_after(wanted[k].0, twists) - balance.state.gaps[k];
        let allowed = |k: usize| ACCEPTED * balance.state.gaps[k] + LEAST * wanted[k].0.thinnest();
        let is_accepted = pass + 1 == MOST_PASSES && (0..wanted.len()).all(|k| off(k).abs() <= allowed(k));
        if is_accepted || balance.farthest(off) <= 2.0 * TOLERANCE {
            return Ok(balance.impulses());
        }
    }
    Err(balance.failure(step, twists))
}

impl<'a, const D: usize> Balance<'a, D>
where
    Dim<D>: Space<D>,
{
    fn new(step: &Step<'_, D>, wanted: &'a [(&'a Film<D>, f64)]) -> Self {
        let wall = step.particles.len();
        let mut mobilities: Vec<f64> = step.particles.iter().map(|particle| 1.0 / particle.radius).collect();
        mobilities.push(0.0);
        let mut ends = Vec::with_capacity(wanted.len());
        for (film, _) in wanted {
            let (first, second) = film.pair.particles();
            let both = [first, second.unwrap_or(wall)];
            both.iter().zip(film.is_held).filter(|(_, held)| *held).for_each(|(&k, _)| mobilities[k] = 0.0);
            ends.push(both);
        }
        let (zeros, normals) = (vec![0.0; wanted.len()], Vec::with_capacity(wanted.len()));
        let state = State { gaps: wanted.iter().map(|(film, _)| film.gap).collect(), ..State::default() };
        let (free_gaps, loads) = (zeros.clone(), zeros);
        Self { wanted, ends, mobilities, normals, free_gaps, loads, state, corrections: 0 }
    }

    /// Linearises about the bodies where these velocities take them, or where they are now: the gap after
    /// displacements is `n . (b + x) - |b| + g`.
    fn linearise(&mut self, step: &Step<'_, D>, free: &[Twist<D>], moved: Option<&[Twist<D>]>) {
        self.normals.clear();
        for ((film, _), free_gap) in self.wanted.iter().zip(&mut self.free_gaps) {
            let normal = match moved {
                Some(moved) if !film.is_flat() => step.branch_after(film, moved).normalize(),
                _ => film.branch.normalize(),
            };
            *free_gap = normal.dot(&step.branch_after(film, free)) - film.branch.norm() + film.gap;
            self.normals.push(normal);
        }
    }

    /// Why there is no balance: a film that is closed, or the one that is farthest off.
    fn failure(&self, step: &Step<'_, D>, twists: &[Twist<D>]) -> FilmError {
        let left = |k: usize| step.gap_after(self.wanted[k].0, twists);
        let off =
            |k: usize| (left(k) - self.state.gaps[k]).abs().max(self.state.excess[k].abs()) / self.unit(k);
        let most = |of: &dyn Fn(usize) -> f64| {
            let films = 0..self.wanted.len();
            films.max_by(|&a, &b| of(a).total_cmp(&of(b))).expect("without films there is balance")
        };
        let (thinnest, farthest) = (most(&|k| -left(k)), most(&off));
        let told = |k: usize| {
            let film = self.wanted[k].0;
            let radius = step.particles[film.pair.first as usize].radius;
            (film.pair, [film.gap, left(k), self.state.gaps[k]].map(|gap| gap / radius))
        };
        if left(thinnest) <= 0.0 {
            let (pair, [gap, left, _]) = told(thinnest);
            return FilmError::Closed { pair, gap, left, is_given: false };
        }
        let (pair, [gap, left, wanted]) = told(farthest);
        FilmError::NotBalanced { pair, gap, left, wanted, corrections: self.corrections }
    }
}

impl<const D: usize> Balance<'_, D> {
    /// The impulses of the films under their loads.
    fn impulses(&self) -> Vec<f64> {
        let loads = self.loads.iter().zip(self.wanted);
        loads.map(|(load, (_, impulse))| impulse - load).collect()
    }

    /// Displacements of all particles under these loads.
    fn displacements(&self, loads: &[f64]) -> Vec<Vector<D>> {
        let mut moved = vec![Vector::zeros(); self.mobilities.len()];
        for ((&[first, second], normal), &load) in self.ends.iter().zip(&self.normals).zip(loads) {
            moved[first] -= normal * load;
            moved[second] += normal * load;
        }
        moved.iter_mut().zip(&self.mobilities).for_each(|(moved, mobility)| *moved *= *mobility);
        moved
    }

    /// By how much these loads open each gap.
    fn openings(&self, loads: &[f64]) -> Vec<f64> {
        let moved = self.displacements(loads);
        let normals = self.ends.iter().zip(&self.normals);
        normals.map(|(&[first, second], normal)| normal.dot(&(moved[second] - moved[first]))).collect()
    }

    /// What these loads lead to; gaps are sought from those of the last.
    fn state(&self, loads: &[f64]) -> State {
        let openings = self.openings(loads);
        let mut state = State::default();
        for (k, (film, impulse)) in self.wanted.iter().enumerate() {
            let (gap, compliance) = film.gap_of(impulse - loads[k], self.state.gaps[k]);
            state.gaps.push(gap);
            state.compliances.push(compliance);
            state.excess.push(self.free_gaps[k] + openings[k] - gap);
        }
        state
    }

    /// The unit in which errors of a gap are told.
    fn unit(&self, k: usize) -> f64 {
        self.state.gaps[k] + LEAST / TOLERANCE * self.wanted[k].0.thinnest()
    }

    /// The largest of some errors of gaps, in their units.
    fn farthest(&self, error: impl Fn(usize) -> f64) -> f64 {
        // What is not a number is farthest.
        let farther = |most: f64, off: f64| if off > most || off.is_nan() { off } else { most };
        (0..self.wanted.len()).map(|k| error(k).abs() / self.unit(k)).fold(0.0, farther)
    }

    /// Newton's method for the loads; whether it came to an end.
    fn solve(&mut self) -> bool {
        self.state = self.state(&self.loads);
        let [least, most] = SOFTENINGS;
        let mut softening = least;
        for _ in 0..MOST_NEWTON_STEPS {
            let off = self.farthest(|k| self.state.excess[k]);
            if off <= TOLERANCE {
                return true;
            }
            self.corrections += 1;
            let step = self.newton_step(softening);
            softening = match self.go_along(&step) {
                ..SHORT => (softening * HARDENING).min(most),
                1.0 => (softening / HARDENING).max(least),
                _ => softening,
            };
        }
        false
    }

    /// Goes along a step as far as the slope of what is minimised allows; returns the share of it.
    fn go_along(&mut self, step: &[f64]) -> f64 {
        let slope_of = |state: &State| state.excess.iter().zip(step).map(|(f, x)| f * x).sum::<f64>();
        let slope = slope_of(&self.state);
        let mut length = 1.0;
        loop {
            let loads: Vec<f64> = self.loads.iter().zip(step).map(|(load, x)| load + length * x).collect();
            let state = self.state(&loads);
            if slope_of(&state) <= SLOPE * slope.abs() || length <= SHORTEST {
                (self.loads, self.state) = (loads, state);
                return length;
            }
            length *= 0.5;
        }
    }

    /// Solves `(B M B^T + C) x = -excess` with the compliances `C`, by conjugate gradients with its diagonal
    /// as preconditioner (Hestenes and Stiefel 1952).
    fn newton_step(&self, softening: f64) -> Vec<f64> {
        let State { compliances, excess, .. } = &self.state;
        let soft = self.ends.iter().zip(compliances).map(|(ends, c)| c + softening * self.mobility(ends));
        let compliances: Vec<f64> = soft.collect();
        let diagonal: Vec<f64> =
            self.ends.iter().zip(&compliances).map(|(ends, c)| c + self.mobility(ends)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let scaled = |r: &[f64]| r.iter().zip(&diagonal).map(|(r, d)| r / d).collect::<Vec<f64>>();
        let mut residual: Vec<f64> = excess.iter().map(|f| -f).collect();
        let mut x = vec![0.0; residual.len()];
        let mut direction = scaled(&residual);
        let mut square = dot(&residual, &direction);
        for _ in 0..MOST_ITERATIONS {
            if self.farthest(|k| residual[k]) <= MARGIN * TOLERANCE {
                break;
            }
            let mut image = self.openings(&direction);
            image.iter_mut().zip(&compliances).zip(&direction).for_each(|((y, c), x)| *y += c * x);
            let length = square / dot(&direction, &image);
            for k in 0..x.len() {
                x[k] += length * direction[k];
                residual[k] -= length * image[k];
            }
            let ahead = scaled(&residual);
            let next = dot(&residual, &ahead);
            let turn = next / square;
            direction.iter_mut().zip(ahead).for_each(|(x, y)| *x = y + turn * *x);
            square = next;
        }
        x
    }

    fn mobility(&self, ends: &[usize; 2]) -> f64 {
        ends.iter().map(|&k| self.mobilities[k]).sum()
    }
}
