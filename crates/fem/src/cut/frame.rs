//! Cells that are sheared, as planes of rays see them.
//!
//! In a cell with the coordinates `xi` in the unit cube the place is `A xi`, with the shear
//! `A = 1 + g e_1 (x) e_2`, so that a ball is an ellipsoid, `(xi - c)^T C (xi - c) <= r^2` with `C = A^T A`.
//! With the axes in the order along the rays, across them, across their planes, and with Cholesky's factor
//! `T` of `C = T^T T`, the ball is round in `s = T (xi - c)`; and since `T` is triangular, rays and planes of
//! rays are still such.

use gluey_geom::Vector;

use super::ball::BallInCell;
use super::corners::HalfSpace;
use super::disc::Disc;
use super::flat::FlatInCell;

/// The map to coordinates in which a ball is round.
#[derive(Clone, Copy, Debug)]
pub struct SectionFrame {
    /// Axis along the rays, across them, across their planes.
    pub axes: [usize; 3],
    /// `T`, its upper triangle.
    factor: [[f64; 3]; 3],
}

impl SectionFrame {
    /// The frame of rays in a direction through cells with this shear.
    pub fn new<const D: usize>(shear: f64, direction: usize) -> Self {
        let axes = std::array::from_fn(|k| (direction + k) % D);
        let metric = |a: usize, b: usize| match (axes[a].min(axes[b]), axes[a].max(axes[b])) {
            (1, 1) => 1.0 + shear * shear,
            (0, 1) => shear,
            (a, b) => f64::from(u8::from(a == b)),
        };
        let mut factor = [[0.0; 3]; 3];
        factor[2][2] = 1.0;
        for a in 0..D {
            for b in a..D {
                let rest = metric(a, b) - (0..a).map(|k| factor[k][a] * factor[k][b]).sum::<f64>();
                factor[a][b] = if a == b { rest.sqrt() } else { rest / factor[a][a] };
            }
        }
        Self { axes, factor }
    }

    /// The section of a ball with the plane of rays `s_3 = height`, and the coordinate of that plane.
    pub fn section<const D: usize>(&self, ball: &BallInCell<D>, height: f64) -> (Disc, f64) {
        let [[t11, t12, t13], [_, t22, t23], [_, _, t33]] = self.factor;
        let [along, across] = [0, 1].map(|k| ball.center[self.axes[k]]);
        let up = height / t33;
        let disc = Disc {
            along: along + (t12 * t23 / t22 - t13) * up / t11,
            across: across - t23 * up / t22,
            radius: ((ball.radius - height) * (ball.radius + height)).max(0.0).sqrt(),
            widths: [1.0 / t11, 1.0 / t22],
            lean: -t12 / (t11 * t22),
        };
        (disc, if D == 3 { ball.center[self.axes[2]] + up } else { 0.0 })
    }

    /// Height of a plane `xi_3 = place` relative to the centre of a ball.
    pub fn height<const D: usize>(&self, ball: &BallInCell<D>, place: f64) -> f64 {
        self.factor[2][2] * (place - ball.center[self.axes[2]])
    }

    /// Width along the third axis for one in `s_3`.
    pub fn width(&self, width: f64) -> f64 {
        width / self.factor[2][2]
    }

    /// A flat relative to the centre of its ball.
    pub fn half_space(&self, ball: &BallInCell<3>, flat: &FlatInCell<3>) -> HalfSpace {
        HalfSpace { normal: self.covector(flat.normal()), offset: flat.distance(ball) }
    }

    /// The faces of the cell along the height, relative to the centre of a ball.
    pub fn faces(&self, ball: &BallInCell<3>) -> [HalfSpace; 4] {
        std::array::from_fn(|k| {
            let axis = self.axes[k / 2];
            let sign = if k % 2 == 1 { 1.0 } else { -1.0 };
            let mut unit = [0.0; 3];
            unit[axis] = sign;
            let normal = self.covector(&unit);
            let length = normal.norm();
            let face = (k % 2) as f64;
            HalfSpace { normal: normal / length, offset: sign * (face - ball.center[axis]) / length }
        })
    }

    /// `T^-T m` for the covector of a plane `m . xi = offset`.
    fn covector(&self, m: &[f64; 3]) -> Vector<3> {
        let [[t11, t12, t13], [_, t22, t23], [_, _, t33]] = self.factor;
        let [d, a, h] = self.axes.map(|axis| m[axis]);
        let first = d / t11;
        let second = (a - t12 * first) / t22;
        Vector::<3>::new(first, second, (h - t13 * first - t23 * second) / t33)
    }
}
