//! What a case says of repulsion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Repulsion of particles and walls, see [`gluey_contact::Repulsion`].
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
