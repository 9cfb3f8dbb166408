//! A particle of a case.

use serde::{Deserialize, Serialize};

/// A particle at time 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParticleSpec {
    /// Centre, one coordinate per dimension.
    pub position: Vec<f64>,
    /// Radius `a > 0`.
    pub radius: f64,
    /// Force beside its weight, one coordinate per dimension; none when absent.
    #[serde(default)]
    pub force: Option<Vec<f64>>,
    /// Torque: one number in 2D (positive counter-clockwise), three in 3D; none when absent.
    #[serde(default)]
    pub torque: Option<Vec<f64>>,
}

impl ParticleSpec {
    /// A particle without forces but its weight.
    pub fn new(position: Vec<f64>, radius: f64) -> Self {
        Self { position, radius, force: None, torque: None }
    }
}
