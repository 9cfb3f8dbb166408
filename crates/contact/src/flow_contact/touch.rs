//! A pair that may touch in a step.

use gluey_geom::{Dim, Twist, Vector, Wrench};

use super::pair_repulsion::PairRepulsion;
use crate::{BodyStep, Domain, PairKey, Partner, Repulsion, StandingGap};

/// A pair where it is at the beginning of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch<const D: usize> {
    pub pair: PairKey,
    /// From the particle to its partner, of length one.
    pub normal: Vector<D>,
    /// The smallest gap that roughness leaves, in a film as [`StandingGap`] has it; minus infinity where
    /// surfaces do not touch.
    pub floor: f64,
    /// How the two repel each other.
    pub repulsion: Option<PairRepulsion<D>>,
    /// From the centres of the particle and its partner to the middle of the gap.
    pub arms: [Vector<D>; 2],
    /// Velocity of the partner beyond that of its particle: of an image that slides, or of a wall.
    pub slide: Vector<D>,
    /// From the particle's partner to the image that is meant, at the end of the step.
    shift: Vector<D>,
    /// Distance of the centres where the surfaces meet; of a wall its offset and the radius, at the end of
    /// the step.
    rest: f64,
    half_gap: f64,
    /// The gap at the end of the step where the two stand still against each other, if a film says.
    standing_gap: Option<f64>,
    /// Radii; infinite of a wall.
    radii: [f64; 2],
    /// The least normal force: negative for contacts that pull.
    pub least: f64,
    /// Velocity per force along the normal and across it.
    pub compliance: [f64; 2],
}

/// The radius that the roughness of a pair is a share of.
pub(super) fn mean_radius(pair: PairKey, radii: &[f64]) -> f64 {
    let (first, second) = pair.particles();
    0.5 * (radii[first] + second.map_or(radii[first], |second| radii[second]))
}

impl<const D: usize> Touch<D> {
    /// The pair of this name in a step with this roughness, over the mean radius. `None` for particles whose
    /// centres coincide.
    pub fn new(pair: PairKey, step: &BodyStep<'_, D>, domain: &Domain<D>, roughness: f64) -> Option<Self> {
        let position = |k: usize| step.poses[k].position;
        let (first, second) = pair.particles();
        let radius = step.radii[first];
        let (branch, other, shift, slide) = match pair.second {
            Partner::Particle { index, image } => {
                let [start, end] = [domain.shift(&image), domain.end_shift(&image)];
                let other = step.radii[index as usize];
                (position(index as usize) + start - position(first), other, end, (end - start) / step.dt)
            }
            Partner::Wall(wall) => {
                let wall = &domain.walls[wall as usize];
                let branch = wall.normal * -wall.distance(&position(first));
                (branch, 0.0, Vector::zeros(), wall.normal * wall.speed)
            }
        };
        let distance = branch.norm();
        let normal = (distance > 0.0).then(|| branch / distance)?;
        let gap = distance - radius - other;
        let rest = match pair.second {
            Partner::Particle { .. } => radius + other,
            Partner::Wall(wall) => {
                let wall = &domain.walls[wall as usize];
                wall.offset + wall.speed * step.dt + radius
            }
        };
        Some(Self {
            pair,
            normal,
            floor: roughness * mean_radius(pair, step.radii),
            arms: [normal * (radius + 0.5 * gap), normal * -(other + 0.5 * gap)],
            slide,
            shift,
            rest,
            half_gap: 0.5 * gap,
            standing_gap: None,
            radii: [radius, second.map_or(f64::INFINITY, |_| other)],
            repulsion: None,
            least: 0.0,
            compliance: [1.0; 2],
        })
    }

    /// Lets the two repel each other, after a step with the force `before`, where forces count by `rate`.
    pub fn repel(&mut self, law: Repulsion, before: f64, rate: f64, step: &BodyStep<'_, D>) {
        let repulsion = PairRepulsion::new(law, self.radii, 2.0 * self.half_gap, before, rate, step);
        self.repulsion = Some(repulsion);
    }

    /// Whether the two act on each other where the step ends with this gap: touch, or repel each other now or
    /// then.
    pub fn acts_at(&self, gap: f64, resolution: f64) -> bool {
        let reaches = |law: PairRepulsion<D>| gap.min(2.0 * self.half_gap) < law.reach();
        gap < self.floor - resolution || self.repulsion.is_some_and(reaches)
    }

    /// Velocity of the partner's surface beyond that of the particle's in the middle of the gap.
    pub fn velocity(&self, twists: &[Twist<D>]) -> Vector<D> {
        let (first, second) = self.pair.particles();
        let of_partner = second.map_or(Vector::zeros(), |k| twists[k].velocity_at(&self.arms[1]));
        of_partner + self.slide - twists[first].velocity_at(&self.arms[0])
    }

    /// What of a vector is across the normal.
    pub fn across(&self, vector: &Vector<D>) -> Vector<D> {
        vector - self.normal * self.normal.dot(vector)
    }

    /// Lets the gap follow the impulse of the film between the two.
    pub fn follow(&mut self, film: &StandingGap) {
        (self.standing_gap, self.floor) = (Some(film.gap), film.floor);
    }

    /// The gap at the end of the step; in a film as [`StandingGap`] has it.
    pub fn gap_after(&self, step: &BodyStep<'_, D>, twists: &[Twist<D>]) -> f64 {
        if let Some(gap) = self.standing_gap {
            return gap + self.normal.dot(&self.velocity(twists)) * step.velocity_weight;
        }
        self.gap_at_end(step, twists)
    }

    /// The gap where the particles are at the end of the step.
    pub fn gap_at_end(&self, step: &BodyStep<'_, D>, twists: &[Twist<D>]) -> f64 {
        // As the integrator does it: first each end position, rounded, then their difference.
        let end = |k: usize| {
            step.poses[k].position + (twists[k].velocity * step.velocity_weight + step.drift[k].velocity)
        };
        let (first, second) = self.pair.particles();
        match second {
            Some(second) => (end(second) + self.shift - end(first)).norm() - self.rest,
            None => -self.normal.dot(&end(first)) - self.rest,
        }
    }

    /// From the centre of the particle to that of its partner, or to the wall.
    pub fn branch(&self) -> Vector<D> {
        let beyond =
            if self.pair.particles().1.is_some() { self.arms[1] } else { self.normal * -self.half_gap };
        self.arms[0] - beyond
    }

    /// Whether a force moves the two apart.
    pub fn can_yield(&self) -> bool {
        self.compliance[0] > 0.0
    }

    /// Power of a force by what the pair yields.
    pub fn power(&self, force: &Vector<D>) -> f64 {
        let [along, across] = self.compliance;
        along * self.normal.dot(force).powi(2) + across * self.across(force).norm_squared()
    }

    /// Adds a force on the partner, and the opposite one on the particle, to the loads of the particles.
    pub fn add_to(&self, force: &Vector<D>, loads: &mut [Wrench<D>]) {
        let (first, second) = self.pair.particles();
        let at = |arm: &Vector<D>, force: Vector<D>| Wrench { force, torque: Dim::<D>::moment(arm, &force) };
        loads[first] = loads[first] + at(&self.arms[0], -*force);
        if let Some(second) = second {
            loads[second] = loads[second] + at(&self.arms[1], *force);
        }
    }
}
