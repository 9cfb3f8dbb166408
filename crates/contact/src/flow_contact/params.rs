//! Parameters of contacts whose forces act in the flow.

#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::ContactParams;

/// Friction between surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Friction {
    /// The coefficient `mu`; 0 for none, infinite for surfaces that never slip.
    pub coefficient: f64,
    /// Normal force below which a contact is without friction, the critical load of Mari et al. (2014,
    /// 10.1122/1.4890747): `|F_t| <= mu (F_n - load)`. Unit: that of forces in [`crate::TwistMobility`].
    pub load: f64,
}

impl Friction {
    /// The largest tangential force under a normal one, where forces count by a rate that is so many times
    /// the one of the load.
    pub(super) fn most(&self, pressing: f64, rate: f64) -> f64 {
        let above = pressing - self.load / rate;
        if above > 0.0 { self.coefficient * above } else { 0.0 }
    }
}

/// Law of the normal forces.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum NormalLaw {
    /// Surfaces push each other where they are as near as their roughness, and never pull.
    Rough {
        /// Smallest gap, in mean radii of the pair.
        roughness: f64,
    },
    /// Smooth surfaces with the law and the memory of [`crate::PairContact`].
    Smooth(ContactParams),
    /// Surfaces that do not touch, wherever they are: they may repel each other.
    None,
}

/// Parameters of [`super::FlowContact`].
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct FlowContactParams {
    /// Law of the normal forces.
    pub law: NormalLaw,
    /// Friction.
    pub friction: Friction,
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// Change of the forces in a last iteration over their size, by the power that they have.
    pub tolerance: f64,
    /// Iterations at most.
    pub iteration_limit: usize,
}

impl FlowContactParams {
    /// The usual change of forces by another flow of the step, over their size, by the power that they have,
    /// at which they are those of the step.
    pub const FLOW_TOLERANCE: f64 = 0.05;
    /// The usual roughness, in mean radii.
    pub const ROUGHNESS: f64 = 5e-3;
    /// The usual coefficient of friction.
    pub const FRICTION: f64 = 0.5;

    /// Smallest gap, in mean radii.
    pub(super) fn roughness(&self) -> f64 {
        match self.law {
            NormalLaw::Rough { roughness } => roughness,
            NormalLaw::Smooth(_) | NormalLaw::None => 0.0,
        }
    }
}

impl Default for FlowContactParams {
    fn default() -> Self {
        Self {
            law: NormalLaw::Rough { roughness: Self::ROUGHNESS },
            friction: Friction { coefficient: Self::FRICTION, load: 0.0 },
            viscosity: 1.0,
            tolerance: 1e-10,
            iteration_limit: 2000,
        }
    }
}
