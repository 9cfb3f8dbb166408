//! The stress that is given, and the rate that follows.

use gluey_geom::Matrix;

/// Control of the stress.
#[derive(Clone, Copy, Debug)]
pub(super) struct StressControl<const D: usize> {
    /// The stress that is given, positive.
    pub stress: f64,
    /// Minus the mean product of the forces between particles with the lines between centres.
    pub pair_stress: Matrix<D>,
    /// The rate of the last flow, positive also while the shear is reversed.
    pub rate: f64,
}

impl<const D: usize> StressControl<D> {
    /// A suspension under this stress, at rest.
    pub fn new(stress: f64) -> Self {
        Self { stress, pair_stress: Matrix::zeros(), rate: 1.0 }
    }
}
