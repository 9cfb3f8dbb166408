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
    /// Whether it is held where it is: it neither moves nor turns. What holds it is written to
    /// `<name>-forces.csv`. In `unfitted`. Default: false.
    #[serde(default, skip_serializing_if = "is_false")]
    pub held: bool,
    /// Velocity at which it is driven, one coordinate per dimension: it moves so whatever the fluid does. It
    /// is reversed with the shear, as that of walls is. In `unfitted`. Unit: length/time. Default: that of
    /// the fluid, or 0 where `spin` is given.
    #[serde(default)]
    #[schemars(length(min = 2, max = 3))]
    pub velocity: Option<Vec<f64>>,
    /// Spin with which it is driven: one number in 2D (positive counter-clockwise), three in 3D. It is
    /// reversed with the shear. In `unfitted`. Unit: 1/time. Default: that of the fluid, or 0 where
    /// `velocity` is given.
    #[serde(default)]
    #[schemars(length(min = 1, max = 3))]
    pub spin: Option<Vec<f64>>,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

impl ParticleSpec {
    /// A particle that is free, without forces but its weight.
    pub fn new(position: Vec<f64>, radius: f64) -> Self {
        Self { position, radius, force: None, torque: None, held: false, velocity: None, spin: None }
    }

    /// Whether it moves as it is told: not at all, or with a given velocity and spin.
    pub fn is_given_motion(&self) -> bool {
        self.held || self.velocity.is_some() || self.spin.is_some()
    }
}
