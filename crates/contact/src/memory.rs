//! The memory of contacts, kept from step to step, and the rule that updates it.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::{ContactLaw, ContactParams, GammaUpdate, PairKey};

/// Memory of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct PairState {
    /// The two particles.
    pub pair: PairKey,
    /// Minus the impulse by which they were pressed together, `<= 0`; unit: length^2.
    pub gamma: f64,
    /// Force of the last step over `6 pi eta`, positive apart; unit: length^2/time.
    pub lambda: f64,
}

/// A memory that no step leaves behind.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the memory of {pair}: gamma {gamma} must be finite and at most 0, lambda {lambda} must be finite")]
pub struct MemoryError {
    /// The pair.
    pub pair: PairKey,
    /// Its gamma; unit: length^2.
    pub gamma: f64,
    /// Its force; unit: length^2/time.
    pub lambda: f64,
}

/// The memory of a contact model: pairs with `gamma < 0` or a force, sorted.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct ContactState {
    /// The pairs.
    pub pairs: Vec<PairState>,
    /// Forces of contacts that act in the flow.
    pub in_flow: Vec<ForceState>,
    /// Forces by which pairs repelled each other in the last step; unit: that of the mobility.
    pub repelled: Vec<(PairKey, f64)>,
}

/// Force of a contact that acts in the flow, with the line of centres that it belongs to; in 2D the third
/// components are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct ForceState {
    /// The two particles.
    pub pair: PairKey,
    /// From the first to its partner, of length one.
    pub normal: [f64; 3],
    /// Force on the partner.
    pub force: [f64; 3],
}

impl ContactState {
    /// Memory of a pair; none is `gamma = lambda = 0`.
    pub fn get(&self, pair: PairKey) -> PairState {
        self.find(pair).copied().unwrap_or(PairState { pair, gamma: 0.0, lambda: 0.0 })
    }

    /// Memory of a pair that has one.
    pub(crate) fn find(&self, pair: PairKey) -> Option<&PairState> {
        let place = self.pairs.binary_search_by_key(&pair, |state| state.pair).ok()?;
        Some(&self.pairs[place])
    }

    /// Changes the sign of the forces.
    pub(crate) fn reverse(&mut self) {
        self.pairs.iter_mut().for_each(|pair| pair.lambda = -pair.lambda);
    }

    /// Sorts by pair, and drops repetitions and pairs without memory or force.
    ///
    /// # Errors
    /// If a gamma is positive, or a number is not finite.
    pub(crate) fn checked(mut self) -> Result<Self, MemoryError> {
        let is_good = |state: &PairState| state.gamma <= 0.0 && (state.gamma + state.lambda).is_finite();
        if let Some(&PairState { pair, gamma, lambda }) = self.pairs.iter().find(|state| !is_good(state)) {
            return Err(MemoryError { pair, gamma, lambda });
        }
        let is_finite = |state: &ForceState| state.force.iter().chain(&state.normal).all(|x| x.is_finite());
        if let Some(&ForceState { pair, force, .. }) = self.in_flow.iter().find(|state| !is_finite(state)) {
            return Err(MemoryError { pair, gamma: 0.0, lambda: force.iter().sum() });
        }
        if let Some(&(pair, lambda)) = self.repelled.iter().find(|(_, force)| !force.is_finite()) {
            return Err(MemoryError { pair, gamma: 0.0, lambda });
        }
        self.repelled.sort_unstable_by_key(|(pair, _)| *pair);
        self.repelled.dedup_by_key(|(pair, _)| *pair);
        self.in_flow.sort_unstable_by_key(|state| state.pair);
        self.in_flow.dedup_by_key(|state| state.pair);
        self.pairs.retain(|state| state.gamma < 0.0 || state.lambda != 0.0);
        self.pairs.sort_unstable_by_key(|state| state.pair);
        self.pairs.dedup_by_key(|state| state.pair);
        Ok(self)
    }
}

/// The update rule of gamma in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GammaRule {
    law: ContactLaw,
    gamma_update: GammaUpdate,
    gamma_min: f64,
    /// Weights of this step's and the last step's force in the impulse of the step.
    weights: [f64; 2],
}

impl GammaRule {
    /// The rule for a step of length `dt` in which velocities have the weight `c`.
    pub(crate) fn new(params: &ContactParams, velocity_weight: f64, dt: f64) -> Self {
        let weights = match params.gamma_update {
            GammaUpdate::Paper => [dt, 0.0],
            GammaUpdate::Consistent => [velocity_weight, dt - velocity_weight],
        };
        let gamma_min = params.gamma_min.unwrap_or(f64::NEG_INFINITY);
        Self { law: params.law, gamma_update: params.gamma_update, gamma_min, weights }
    }

    /// Smallest force a contact with the memory `gamma`, `last` admits: `-inf` keeps it closed.
    pub(crate) fn floor(&self, gamma: f64, last: f64) -> f64 {
        match (self.law, self.gamma_update) {
            (ContactLaw::Gluey, GammaUpdate::Paper) if gamma < 0.0 => f64::NEG_INFINITY,
            (ContactLaw::Gluey, GammaUpdate::Consistent) => {
                let [now, before] = self.weights;
                (gamma - before * last) / now
            }
            _ => 0.0,
        }
    }

    /// Gamma after a step with the force `lambda` (Verdon et al. 2010, eq. 30).
    pub(crate) fn update(&self, gamma: f64, last: f64, lambda: f64) -> f64 {
        if self.law != ContactLaw::Gluey {
            return 0.0;
        }
        let [now, before] = self.weights;
        let gamma = gamma - now * lambda - before * last;
        gamma.max(self.gamma_min).min(0.0)
    }
}
