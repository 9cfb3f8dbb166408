//! Coulomb's problem of a step, by an accelerated fixed point.
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

use gluey_geom::{Twist, Vector, Wrench};

use super::course::{Course, Pace};
use super::params::FlowContactParams;
use super::touch::Touch;
use crate::solver::ResidualHistory;
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
    pub pace: Pace,
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

    fn minus(&self, other: &Self) -> Self {
        Self { contact: self.contact - other.contact, excess: self.excess - other.excess }
    }

    /// Contact and repulsion.
    fn total(&self, touch: &Touch<D>) -> Vector<D> {
        self.contact + touch.normal * self.excess
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

/// Outcome of the iteration.
pub(super) struct Outcome<const D: usize> {
    /// Motions with the forces.
    pub twists: Vec<Twist<D>>,
    pub iterations: usize,
    /// The last residual, over the size of the forces.
    pub residual: f64,
}

/// An iteration that did not end.
pub(super) struct Stalled {
    pub residual: f64,
    pub iterations: usize,
    pub history: ResidualHistory,
    /// The pair with the largest residual.
    pub worst: usize,
}

impl<const D: usize> Coulomb<'_, D> {
    /// The forces on the partners, from a guess.
    pub fn solve(&mut self, forces: &mut [PairForce<D>]) -> Result<Outcome<D>, Stalled> {
        let mut course = Course::new(self.pace);
        let mut history = Vec::new();
        for iterations in 0usize.. {
            let twists = self.twists(forces);
            let asked: Vec<PairForce<D>> = self
                .touches
                .iter()
                .zip(&*forces)
                .map(|(touch, force)| self.asked(touch, force, &twists))
                .collect();
            let changes: Vec<PairForce<D>> =
                asked.iter().zip(&*forces).map(|(asked, force)| asked.minus(force)).collect();
            let change = self.weighted(&changes);
            let (change_size, size) = (self.pace.softness() * norm(&change), norm(&self.weighted(forces)));
            let residual = if change_size > 0.0 { change_size / size.max(f64::MIN_POSITIVE) } else { 0.0 };
            if iterations == 0 || iterations.is_power_of_two() {
                history.push((iterations, residual));
            }
            if residual <= self.params.tolerance || change_size <= self.noise() {
                if drop_parted(forces, &asked) {
                    continue;
                }
                return Ok(Outcome { twists, iterations, residual });
            }
            if iterations == self.pace.iteration_limit(self.params) || residual.is_nan() {
                let of_pair = |k: usize| changes[k].total(&self.touches[k]).norm();
                let worst = (0..forces.len()).max_by(|&a, &b| of_pair(a).total_cmp(&of_pair(b))).unwrap_or(0);
                let history = ResidualHistory { entries: history };
                return Err(Stalled { residual, iterations, history, worst });
            }
            let next = course.next(change_size, &flat(forces), flat(&asked), change);
            for (k, (force, next)) in forces.iter_mut().zip(next.chunks_exact(D + 1)).enumerate() {
                let (touch, contact) = (&self.touches[k], Vector::from_column_slice(&next[..D]));
                let pressing = touch.normal.dot(&contact);
                let contact = self.admitted(touch, pressing, touch.across(&contact));
                *force = PairForce { contact, excess: next[D] };
            }
        }
        unreachable!("the loop ends by itself")
    }

    /// The size of changes that positions do not resolve.
    fn noise(&self) -> f64 {
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

    /// The force that a pair asks for where motions with `force` are these.
    fn asked(&self, touch: &Touch<D>, force: &PairForce<D>, twists: &[Twist<D>]) -> PairForce<D> {
        let [along, across] = touch.compliance.map(|compliance| compliance * self.pace.softness());
        let yielding = along * self.step.velocity_weight;
        let gap = touch.gap_after(self.step, twists);
        let slip = touch.across(&touch.velocity(twists));
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

/// Lets go of what is left of the forces of contacts that part; tells whether there are any.
fn drop_parted<const D: usize>(forces: &mut [PairForce<D>], asked: &[PairForce<D>]) -> bool {
    let mut is_any = false;
    for (force, asked) in forces.iter_mut().zip(asked) {
        if asked.contact.amax() == 0.0 && force.contact.amax() > 0.0 {
            (force.contact, is_any) = (Vector::zeros(), true);
        }
    }
    is_any
}

/// Components of the contacts' forces, and repulsion.
fn flat<const D: usize>(forces: &[PairForce<D>]) -> Vec<f64> {
    forces.iter().flat_map(|force| force.contact.iter().copied().chain([force.excess])).collect()
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}
