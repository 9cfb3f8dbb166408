//! What a case says of repulsion.

use gluey_suspension::Repulsion;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Case;

/// Repulsion of particles and walls, see [`Repulsion`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RepulsionSpec {
    /// Force between two particles of the mean radius in contact. It is not reversed with the shear. Unit:
    /// viscosity length^2/time, in 2D viscosity length/time. Default: 0.
    #[schemars(range(min = 0))]
    pub force: f64,
    /// Gap in which the force falls to a share of 1/e. Unit: mean radius. Default: 0.05.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub range: f64,
}

impl Default for RepulsionSpec {
    fn default() -> Self {
        Self { force: 0.0, range: 0.05 }
    }
}

impl Case {
    /// The law by which particles repel each other, if they do.
    pub fn repulsion(&self) -> Option<Repulsion> {
        let (RepulsionSpec { force, range }, radius) = (&self.repulsion, self.mean_radius());
        (*force > 0.0).then_some(Repulsion { force: *force, range: range * radius, radius })
    }
}
