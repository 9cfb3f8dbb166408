//! The bodies of a step: shapes, displacements without contact, mobilities.

use gluey_geom::{Twist, Vector};

use super::Shape;
use crate::{BodyStep, ContactParams, Mobility};

/// Bodies of a step and what is fixed in it.
pub(super) struct Bodies<'a, const D: usize, S> {
    pub shapes: &'a [S],
    pub step: &'a BodyStep<'a, D>,
    /// Displacements without contact.
    pub free: &'a [Twist<D>],
    /// `c` times the mobility of each body, for translation and rotation.
    pub weights: Vec<[f64; 2]>,
}

impl<'a, const D: usize, S: Shape<D>> Bodies<'a, D, S> {
    pub(super) fn new(
        shapes: &'a [S],
        step: &'a BodyStep<'a, D>,
        free: &'a [Twist<D>],
        mobility: &impl Mobility<D>,
    ) -> Self {
        let weight = |(body, shape): (usize, &S)| {
            let a = shape.drag_radius();
            let translation = step.velocity_weight * mobility.own(body, a);
            // 8 pi eta a^3 beside 6 pi eta a.
            [translation, translation * 3.0 / (4.0 * a * a)]
        };
        Self { shapes, step, free, weights: shapes.iter().enumerate().map(weight).collect() }
    }

    /// Centres and radii of balls that hold the bodies and reach so much farther.
    pub(super) fn balls(&self, slacks: &[f64]) -> (Vec<Vector<D>>, Vec<f64>) {
        let centers = self.step.poses.iter().map(|pose| pose.position).collect();
        let radii = self.shapes.iter().zip(slacks).map(|(shape, slack)| shape.reach() + slack).collect();
        (centers, radii)
    }

    /// [`ContactParams::residual`] of bodies that reach beyond their centres.
    pub(super) fn tolerance(&self, params: &ContactParams) -> f64 {
        let radius = self.shapes.iter().map(Shape::rounding).fold(f64::INFINITY, f64::min);
        let reach = self.shapes.iter().map(Shape::reach).fold(0.0, f64::max);
        let farthest = self.free.iter().map(|by| by.velocity.norm()).fold(0.0, f64::max);
        let extent = self.step.poses.iter().map(|pose| pose.position.amax()).fold(0.0, f64::max);
        params.residual(radius, farthest, extent + reach)
    }
}
