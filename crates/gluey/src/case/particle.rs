//! A particle of a case.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A particle at time 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParticleSpec {
    /// Centre, one coordinate per dimension. Unit: length.
    #[schemars(length(min = 2, max = 3))]
    pub position: Vec<f64>,
    /// Radius. Unit: length.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
    /// Force beside its weight, one coordinate per dimension. Unit: viscosity length^2/time, in 2D viscosity
    /// length/time. Default: none.
    #[serde(default)]
    #[schemars(length(min = 2, max = 3))]
    pub force: Option<Vec<f64>>,
    /// Torque: one number in 2D (positive counter-clockwise), three in 3D. Unit: that of forces times a
    /// length. Default: none.
    #[serde(default)]
    #[schemars(length(min = 1, max = 3))]
    pub torque: Option<Vec<f64>>,
}

impl ParticleSpec {
    /// A particle without forces but its weight.
    pub fn new(position: Vec<f64>, radius: f64) -> Self {
        Self { position, radius, force: None, torque: None }
    }
}
