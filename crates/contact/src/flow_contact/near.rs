//! The pairs that are near in a step, and which of them take part.

use gluey_geom::Twist;

use super::coulomb::{Coulomb, PairForce, resolution};
use super::params::FlowContactParams;
use super::solve::{Outcome, solve};
use super::touch::Touch;
use crate::{BodyStep, ContactError, PairKey, TwistMobility};

/// The force of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownForce<const D: usize> {
    pub pair: PairKey,
    pub force: PairForce<D>,
}

/// Pairs that are near in a step, sorted, of which some take part.
#[derive(Debug, Default)]
pub(super) struct NearPairs<const D: usize> {
    pub touches: Vec<Touch<D>>,
    pub forces: Vec<PairForce<D>>,
    pub takes_part: Vec<bool>,
}

impl<const D: usize> NearPairs<D> {
    /// The forces of those that take part.
    pub fn forces_by_pair(&self) -> Vec<KnownForce<D>> {
        self.parts().map(|(touch, force)| KnownForce { pair: touch.pair, force: *force }).collect()
    }

    /// Those that take part, with their forces.
    pub fn parts(&self) -> impl Iterator<Item = (&Touch<D>, &PairForce<D>)> {
        let all = self.touches.iter().zip(&self.forces).zip(&self.takes_part);
        all.filter(|part| *part.1).map(|(part, _)| part)
    }

    /// Lets pairs take part whose gaps these motions take below the roughness, or that repel each other;
    /// tells whether there are any.
    fn admit(&mut self, step: &BodyStep<'_, D>, twists: &[Twist<D>]) -> bool {
        let (mut is_any, resolution) = (false, resolution(step));
        for (touch, takes_part) in self.touches.iter().zip(&mut self.takes_part) {
            let acts = || touch.acts_at(touch.gap_after(step, twists), resolution);
            if !*takes_part && touch.can_yield() && acts() {
                (*takes_part, is_any) = (true, true);
            }
        }
        is_any
    }

    /// Solves for the forces of those that take part, until no other closes.
    pub fn solve(
        &mut self,
        step: &BodyStep<'_, D>,
        params: &FlowContactParams,
        rate: f64,
        mobility: &mut dyn TwistMobility<D>,
        free: &[Twist<D>],
    ) -> Result<Outcome<D>, ContactError> {
        self.admit(step, free);
        loop {
            let chosen: Vec<usize> = (0..self.touches.len()).filter(|&k| self.takes_part[k]).collect();
            let touches: Vec<Touch<D>> = chosen.iter().map(|&k| self.touches[k]).collect();
            let mut forces: Vec<PairForce<D>> = chosen.iter().map(|&k| self.forces[k]).collect();
            let mobility = &mut *mobility;
            let mut problem = Coulomb { step, touches: &touches, params, rate, mobility, free };
            let outcome = solve(&mut problem, &mut forces);
            let outcome = outcome.map_err(|stalled| ContactError::NotConverged {
                residual: stalled.residual,
                tolerance: params.tolerance,
                iterations: stalled.iterations,
                history: stalled.history,
                worst: touches[stalled.worst].pair,
            })?;
            chosen.iter().zip(forces).for_each(|(&k, force)| self.forces[k] = force);
            if !self.admit(step, &outcome.twists) {
                return Ok(outcome);
            }
        }
    }
}
