//! Points of contact between two bodies that turn: rows of the Jacobian with moments.

use gluey_geom::{Dim, Twist, Vector};

use crate::delassus::{JacobianRow, Response};
use crate::solver::Factor;

/// The row `G = (-n, -(r_i x n), n, r_j x n)` of a contact between the bodies `i` and `j`.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointRow<const D: usize> {
    pub normal: Vector<D>,
    /// Points of the cores, from the centres.
    pub arms: [Vector<D>; 2],
    pub bodies: [usize; 2],
}

impl<const D: usize> JacobianRow for PointRow<D> {
    type Motion = Twist<D>;
    /// For translation and for rotation.
    type Weight = [f64; 2];

    fn zero() -> Twist<D> {
        Twist::default()
    }

    fn scaled(&self, factor: f64) -> Self {
        Self { normal: self.normal * factor, ..*self }
    }

    fn compliance(&self, weights: &[[f64; 2]]) -> f64 {
        let part = |side: usize| {
            let [translation, rotation] = weights[self.bodies[side]];
            let torque = Dim::<D>::moment(&self.arms[side], &self.normal);
            translation + rotation * Dim::<D>::spin_slice(&torque).iter().map(|x| x * x).sum::<f64>()
        };
        part(0) + part(1)
    }

    fn add_force(&self, force: f64, loads: &mut [Twist<D>]) {
        for ((body, arm), sign) in self.bodies.iter().zip(&self.arms).zip([-1.0, 1.0]) {
            let push = self.normal * (sign * force);
            let load = &mut loads[*body];
            load.velocity += push;
            load.spin += Dim::<D>::moment(arm, &push);
        }
    }

    fn opening(&self, motions: &[Twist<D>]) -> f64 {
        let [i, j] = self.bodies;
        self.normal.dot(&(motions[j].velocity_at(&self.arms[1]) - motions[i].velocity_at(&self.arms[0])))
    }
}

/// Bodies that feel their own drag only, with `c` times their mobilities for translation and rotation.
pub(super) struct OwnDrag<'a>(pub &'a [[f64; 2]]);

impl<const D: usize> Response<PointRow<D>> for OwnDrag<'_> {
    const IS_COUPLED: bool = false;

    fn respond(&self, motions: &mut [Twist<D>]) {
        for (motion, [translation, rotation]) in motions.iter_mut().zip(self.0) {
            motion.velocity *= *translation;
            motion.spin = motion.spin * *rotation;
        }
    }

    /// With the roots of the mobilities, which are squared in `A`.
    fn factor(&self, rows: &[PointRow<D>]) -> Option<Factor> {
        let rigid = Dim::<D>::RIGID;
        let mut factor = Factor::new(rigid * self.0.len());
        for row in rows {
            let entries = [(0, -1.0), (1, 1.0)].into_iter().flat_map(|(side, sign): (usize, f64)| {
                let (body, torque) = (row.bodies[side], Dim::<D>::moment(&row.arms[side], &row.normal));
                let [translation, rotation] = self.0[body].map(|weight| sign * weight.sqrt());
                let linear = row.normal.iter().map(|x| x * translation).collect::<Vec<f64>>();
                let angular =
                    Dim::<D>::spin_slice(&torque).iter().map(|x| x * rotation).collect::<Vec<f64>>();
                linear.into_iter().chain(angular).enumerate().map(move |(d, value)| (rigid * body + d, value))
            });
            // What does not move has no degrees of freedom.
            factor.push(entries.filter(|(_, value)| *value != 0.0));
        }
        Some(factor)
    }
}
