//! A film between two particles, and how it resists.

use gluey_geom::{Twist, Vector};

use crate::neighbours::{AffineFit, KnownMotion};
use crate::rows::{GROUND, Row};
use crate::solver::GapLaw;
use crate::{BodyStep, PairKey};

/// Two particles, or one and a wall, with a film between them that lubrication keeps open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film<const D: usize> {
    /// The particle and its partner. Nothing flows through a wall: where the flow comes in or goes out a gap
    /// changes without a force, and the impulse says nothing.
    pub pair: PairKey,
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
/// The scale `s` of the resistance: that of two spheres, over the drag that they have far apart.
const SCALE: f64 = 0.5;
/// What is left of the resistance from there on, so that each impulse has its gap. Results hardly depend on
/// it: the paper's encounter ends within 3 % of its error at a tenth of this.
const REST: f64 = 0.1;
/// Films are no thinner than about this share of `A`, which positions resolve. Where the impulse asks for
/// less it is remembered, and the film opens when it has been made up for: that is the gluey contact.
const THINNEST: f64 = 1e-9;

/// The gap up to which films have to be known before a step with these velocities. Where images slide in a
/// simple shear of this rate displacements count from the sheared lattice, in which particles move little
/// against each other, however far up in `y` they are.
pub fn film_reach<const D: usize>(step: &BodyStep<'_, D>, twists: &[Twist<D>], rate: f64) -> f64 {
    let shear = rate * step.dt;
    let centers: Vec<Vector<D>> = step.poses.iter().map(|pose| pose.position).collect();
    let moves = step.moves(twists);
    let lattice = AffineFit::new(&centers, &moves, &KnownMotion { free: [false; D], shear });
    let farthest = centers.iter().zip(&moves).map(|(x, s)| lattice.rest(x, s)).fold(0.0, f64::max);
    let largest = step.radii.iter().copied().fold(0.0, f64::max);
    // A wall has `A = 2 a`.
    let memory = 2.0 * largest * REACH * MEMORY_REACH;
    // Two particles approach each other at twice the speed of each; centres at the distance `2 a + reach` by
    // the strain times that, besides.
    (memory + 2.0 * farthest + shear.abs() * 2.0 * largest) / (1.0 - shear.abs().min(0.5))
}

impl<const D: usize> Film<D> {
    /// Whether neither side can yield.
    pub(super) fn is_given(&self) -> bool {
        self.is_held[0] && (self.is_held[1] || self.is_flat())
    }

    /// Whether it is one at a wall: its gap is that along the normal.
    pub(super) fn is_flat(&self) -> bool {
        self.pair.particles().1.is_none()
    }

    pub(super) fn thinnest(&self) -> f64 {
        THINNEST * self.curvature_radius
    }

    /// Whether it is thinner than positions resolve: its gap is no measurement then.
    pub(super) fn is_closed(&self) -> bool {
        self.gap <= self.thinnest()
    }

    pub(super) fn reach_of_correction(&self) -> f64 {
        REACH * self.curvature_radius
    }

    /// The drag of the two particles against each other, over `6 pi eta`.
    fn drag(&self) -> f64 {
        0.5 * self.curvature_radius
    }

    /// `R(g)`, a force over `6 pi eta` per velocity.
    pub(super) fn resistance(&self, gap: f64) -> f64 {
        let rho = |gap: f64| match D {
            2 => (self.curvature_radius / gap).powf(1.5),
            _ => self.curvature_radius / gap,
        };
        let reach = self.reach_of_correction();
        let over_drag = if gap < reach { REST + SCALE * (rho(gap) - rho(reach)) } else { REST };
        over_drag * self.drag()
    }

    /// `Phi(g)`, zero at `G`.
    pub(super) fn impulse(&self, gap: f64) -> f64 {
        let (reach, a) = (self.reach_of_correction(), self.curvature_radius);
        if gap >= reach {
            return REST * (gap - reach) * self.drag();
        }
        let singular = match D {
            2 => {
                -2.0 * a.powf(1.5) * (gap.powf(-0.5) - reach.powf(-0.5))
                    - (a / reach).powf(1.5) * (gap - reach)
            }
            _ => a * (gap / reach).ln() - a / reach * (gap - reach),
        };
        (REST * (gap - reach) + SCALE * singular) * self.drag()
    }

    /// An impulse so low that no load of neighbours takes the gap from `floor`.
    pub(super) fn pressed(&self, floor: f64) -> f64 {
        self.impulse(floor.max(self.thinnest())) - self.drag() * self.curvature_radius
    }

    /// The gap with this impulse, sought from another one, and its derivative by the impulse, where surfaces
    /// touch at a gap of `floor`.
    ///
    /// No thinner than the floor less half of what positions resolve. Where the impulse asks for less than
    /// that, the gap is all but fixed.
    pub(super) fn gap_of(&self, impulse: f64, floor: f64, start: f64) -> (f64, f64) {
        let floor = floor.max(self.thinnest());
        let missing = self.impulse(floor) - impulse;
        if missing <= 0.0 {
            let gap = self.open_gap_of(impulse, start);
            return (gap, 1.0 / self.resistance(gap));
        }
        let slack = 0.5 * self.thinnest();
        let steepness = 1.0 / (self.resistance(floor) * slack);
        let share = 1.0 / (1.0 + steepness * missing);
        (floor - slack * (1.0 - share), slack * steepness * share * share)
    }

    /// Where it is not closed: Newton's method in `ln g`, in which the impulse is convex, kept in a bracket.
    fn open_gap_of(&self, impulse: f64, start: f64) -> f64 {
        let reach = self.reach_of_correction();
        if impulse >= 0.0 {
            return reach + impulse / (REST * self.drag());
        }
        let (mut lower, mut upper) = (self.thinnest(), reach);
        let mut gap = start.clamp(lower, upper);
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
    pub(super) fn across(&self, of: impl Fn(usize) -> Vector<D>, time: f64) -> Vector<D> {
        let (first, second) = self.pair.particles();
        second.map_or(Vector::zeros(), |second| of(second) + self.slide * time) - of(first)
    }

    /// The row of its gap in a step of this length, for places that are displacements of the particles.
    pub(super) fn row(&self, dt: f64) -> Row<D> {
        let (first, second) = self.pair.particles();
        let (first, distance, slide) = (first as u32, self.branch.norm(), self.slide * dt);
        let (tail, head, sign) = second.map_or((GROUND, first, -1.0), |second| (first, second as u32, 1.0));
        Row {
            candidate: 0,
            tail,
            head,
            shift: self.branch + slide,
            slide,
            normal: self.branch * (sign / distance),
            rest: if tail == GROUND { 0.0 } else { distance } - self.gap,
            is_flat: tail == GROUND,
            rank: (0, 0, [0; 3]),
        }
    }
}

/// The law of a film that asks for an impulse: what it does not get loads its particles.
pub(super) struct FilmLaw<'a, const D: usize> {
    pub film: &'a Film<D>,
    /// The impulse.
    pub asked: f64,
    /// The gap at which surfaces touch.
    pub floor: f64,
}

impl<const D: usize> GapLaw for FilmLaw<'_, D> {
    fn gap(&self, load: f64, start: f64) -> (f64, f64) {
        self.film.gap_of(self.asked - load, self.floor, start)
    }

    fn thinnest(&self) -> f64 {
        self.film.thinnest()
    }
}
