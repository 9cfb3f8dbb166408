//! Coulomb's problem of a step, as a fixed point.
//!
//! Forces `F` change motions by `u = u_0 + M B^T F`. Each pair answers to what these do with the force that
//! its own compliance asks for, within Coulomb's cone,
//!
//! `F_n <- max(0, F_n - (g - g_0) / (c d_n))`, `F_t <- P(F_t - v_t / d_t)`, `|P| <= mu max(0, F_n - F_c)`,
//!
//! with the gap `g` at the end of the step, the smallest gap `g_0` and the slip `v_t`. A fixed point is a
//! solution, exact in the gaps. Where the two repel each other, that force and the one of the contact are
//! found together, for both follow from the gap. In a mobility with films between the pairs `d` is close to
//! the inverse of `B M B^T`, so that steps are few; [`Anderson`]'s acceleration makes them fewer.

use gluey_geom::{Matrix, Twist, Vector, Wrench};

use super::params::FlowContactParams;
use super::touch::Touch;
use crate::{BodyStep, TwistMobility};

/// Gaps are known to so many times the rounding of positions.
const NOISE: f64 = 16.0;

/// Forces between pairs that may touch, in a step from motions without them.
pub(super) struct Coulomb<'a, const D: usize> {
    pub step: &'a BodyStep<'a, D>,
    pub touches: &'a [Touch<D>],
    pub params: &'a FlowContactParams,
    /// The rate by which forces count, over that of the critical load.
    pub rate: f64,
    pub mobility: &'a mut dyn TwistMobility<D>,
    /// Motions without the forces.
    pub free: &'a [Twist<D>],
}

/// Force on the partner of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PairForce<const D: usize> {
    /// The force of their contact.
    pub contact: Vector<D>,
    /// Repulsion beyond that at the beginning of the step, positive apart.
    pub excess: f64,
}

impl<const D: usize> PairForce<D> {
    /// A force of a contact.
    pub fn of_contact(contact: Vector<D>) -> Self {
        Self { contact, excess: 0.0 }
    }

    /// The difference of two.
    pub fn minus(&self, other: &Self) -> Self {
        Self { contact: self.contact - other.contact, excess: self.excess - other.excess }
    }

    /// Contact and repulsion.
    pub fn total(&self, touch: &Touch<D>) -> Vector<D> {
        self.contact + touch.normal * self.excess
    }

    /// Components of the contact's force, and repulsion.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + use<D> {
        let numbers: [f64; D] = self.contact.into();
        numbers.into_iter().chain([self.excess])
    }

    /// Numbers whose squares are powers.
    fn weighted(&self, touch: &Touch<D>) -> impl Iterator<Item = f64> + use<D> {
        let [along, across] = touch.compliance.map(f64::sqrt);
        let pressing = touch.normal * (touch.normal.dot(&self.contact) * along);
        let contact = pressing + touch.across(&self.contact) * across;
        let numbers: [f64; D] = contact.into();
        numbers.into_iter().chain([self.excess * along])
    }
}

/// Motion of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairMotion<const D: usize> {
    /// The gap at the end of the step.
    pub gap: f64,
    /// Velocity of the partner's surface beyond that of the particle's.
    pub velocity: Vector<D>,
}

impl<const D: usize> PairMotion<D> {
    /// Adds a velocity over a step in which it counts by `weight`.
    pub fn add(&mut self, touch: &Touch<D>, velocity: &Vector<D>, weight: f64) {
        self.velocity += velocity;
        self.gap += touch.normal.dot(velocity) * weight;
    }
}

/// Motions that forces make, and what pairs ask for then.
pub(super) struct State<const D: usize> {
    /// Motions with the forces.
    pub twists: Vec<Twist<D>>,
    /// How pairs move.
    pub motions: Vec<PairMotion<D>>,
    /// The forces that pairs ask for.
    pub asked: Vec<PairForce<D>>,
    /// What these are beyond the forces, as numbers whose squares are powers.
    pub change: Vec<f64>,
    /// Size of the change, over that of the forces.
    pub residual: f64,
}

/// Forces that pairs ask for.
pub(super) struct Wish<const D: usize> {
    pub asked: Vec<PairForce<D>>,
    /// What these are beyond the forces, as numbers whose squares are powers.
    pub change: Vec<f64>,
    /// Size of the change, over that of the forces.
    pub residual: f64,
}

impl<const D: usize> Coulomb<'_, D> {
    /// What these forces do.
    pub fn state(&mut self, forces: &[PairForce<D>]) -> State<D> {
        let twists = self.twists(forces);
        let motion = |touch: &Touch<D>| PairMotion {
            gap: touch.gap_after(self.step, &twists),
            velocity: touch.velocity(&twists),
        };
        let motions: Vec<PairMotion<D>> = self.touches.iter().map(motion).collect();
        let Wish { asked, change, residual } = self.wish(forces, &motions);
        State { twists, motions, asked, change, residual }
    }

    /// What pairs ask for that have these forces and move like this.
    pub fn wish(&self, forces: &[PairForce<D>], motions: &[PairMotion<D>]) -> Wish<D> {
        let parts = self.touches.iter().zip(forces).zip(motions);
        let asked = parts.map(|((touch, force), motion)| self.asked(touch, force, touch.compliance, motion));
        let asked: Vec<PairForce<D>> = asked.collect();
        let changes: Vec<PairForce<D>> =
            asked.iter().zip(forces).map(|(asked, force)| asked.minus(force)).collect();
        let change = self.weighted(&changes);
        let (change_size, size) = (norm(&change), norm(&self.weighted(forces)));
        let residual = if change_size > 0.0 { change_size / size.max(f64::MIN_POSITIVE) } else { 0.0 };
        Wish { asked, change, residual }
    }

    /// Sets forces from the numbers of all, each within its cone.
    pub fn set(&self, forces: &mut [PairForce<D>], numbers: &[f64]) {
        for ((force, touch), next) in forces.iter_mut().zip(self.touches).zip(numbers.chunks_exact(D + 1)) {
            let contact = Vector::from_column_slice(&next[..D]);
            let pressing = touch.normal.dot(&contact);
            let contact = self.admitted(touch, pressing, touch.across(&contact));
            *force = PairForce { contact, excess: next[D] };
        }
    }

    /// The motions that a force on the partner of a pair adds.
    pub fn response(&mut self, touch: &Touch<D>, force: &Vector<D>) -> Vec<Twist<D>> {
        let mut loads = vec![Wrench::default(); self.free.len()];
        touch.add_to(force, &mut loads);
        let mut twists = vec![Twist::default(); loads.len()];
        self.mobility.respond(&loads, &mut twists);
        twists
    }

    /// The size of changes that positions do not resolve.
    pub fn noise(&self) -> f64 {
        let resolved = resolution(self.step) / self.step.velocity_weight;
        let squares = self.touches.iter().map(|touch| resolved * resolved / touch.compliance[0]);
        squares.sum::<f64>().sqrt()
    }

    /// The motions with these forces.
    fn twists(&mut self, forces: &[PairForce<D>]) -> Vec<Twist<D>> {
        let mut loads = vec![Wrench::default(); self.free.len()];
        self.touches
            .iter()
            .zip(forces)
            .for_each(|(touch, force)| touch.add_to(&force.total(touch), &mut loads));
        let mut twists = vec![Twist::default(); loads.len()];
        self.mobility.respond(&loads, &mut twists);
        twists.iter_mut().zip(self.free).for_each(|(twist, free)| *twist = *twist + *free);
        twists
    }

    /// The force that a pair asks for which yields like this and moves like this with `force`.
    pub fn asked(
        &self,
        touch: &Touch<D>,
        force: &PairForce<D>,
        [along, across]: [f64; 2],
        motion: &PairMotion<D>,
    ) -> PairForce<D> {
        let yielding = along * self.step.velocity_weight;
        let gap = motion.gap;
        let slip = touch.across(&motion.velocity);
        let pressing = touch.normal.dot(&force.contact);
        let free = gap + yielding * (touch.least - pressing - force.excess);
        let mut excess = touch.repulsion.map_or(0.0, |law| law.excess(free, yielding));
        let mut asked = touch.least;
        if touch.least + excess < pressing + force.excess - (gap - touch.floor) / yielding {
            excess = touch.repulsion.map_or(0.0, |law| law.excess_at(touch.floor));
            asked = pressing + force.excess - (gap - touch.floor) / yielding - excess;
        }
        let tangential = touch.across(&force.contact) - slip / across;
        PairForce { contact: self.admitted(touch, asked, tangential), excess }
    }

    /// Slopes of what a pair asks for: the matrices `N` and `S` of `(N + S) dF - (N / d_n + S / d_t) dv`, its
    /// change with the force and the velocity of the pair. Without repulsion.
    pub fn slopes(&self, touch: &Touch<D>, force: &PairForce<D>, motion: &PairMotion<D>) -> [Matrix<D>; 2] {
        let [along, across] = touch.compliance;
        let normal = touch.normal;
        let yielding = along * self.step.velocity_weight;
        let pressing = normal.dot(&force.contact) - (motion.gap - touch.floor) / yielding;
        let tangential = touch.across(&force.contact) - touch.across(&motion.velocity) / across;
        let is_apart = pressing <= touch.least;
        let (most, size) =
            (self.params.friction.most(pressing.max(touch.least), self.rate), tangential.norm());
        let plane = Matrix::identity() - normal * normal.transpose();
        let along = if is_apart { Matrix::zeros() } else { normal * normal.transpose() };
        if size <= most {
            return [along, plane];
        }
        let direction = tangential / size;
        let sticking = (plane - direction * direction.transpose()) * (most / size);
        let growing = if is_apart || most == 0.0 { 0.0 } else { self.params.friction.coefficient };
        [along + direction * normal.transpose() * growing, sticking]
    }

    /// The nearest force within the cone, its normal part first.
    fn admitted(&self, touch: &Touch<D>, pressing: f64, tangential: Vector<D>) -> Vector<D> {
        let pressing = pressing.max(touch.least);
        let most = self.params.friction.most(pressing, self.rate);
        let size = tangential.norm();
        let share = if size > most { most / size } else { 1.0 };
        touch.normal * pressing + tangential * share
    }

    /// Forces of pairs as numbers whose squares are powers.
    fn weighted(&self, forces: &[PairForce<D>]) -> Vec<f64> {
        forces.iter().zip(self.touches).flat_map(|(force, touch)| force.weighted(touch)).collect()
    }
}

/// How well positions tell gaps.
pub(super) fn resolution<const D: usize>(step: &BodyStep<'_, D>) -> f64 {
    let extent = step.poses.iter().map(|pose| pose.position.amax()).fold(0.0, f64::max);
    NOISE * f64::EPSILON * extent
}

/// Euclidean.
pub(super) fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}
