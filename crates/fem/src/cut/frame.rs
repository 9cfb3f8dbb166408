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
use super::slice::Edge;

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

/// A flat of a ball seen along its largest component: the other two coordinates of its points.
#[derive(Clone, Debug)]
pub struct FlatFrame {
    /// Axis along the rays in the flat, across them, and the one that it is seen along.
    pub axes: [usize; 3],
    /// `x_3 = place - slopes[0] x_1 - slopes[1] x_2`.
    pub place: f64,
    /// Whether the body lies below.
    is_above: bool,
    /// See `place`.
    pub slopes: [f64; 2],
    /// Where the ball cuts the plane.
    pub disc: Disc,
}

impl FlatFrame {
    /// The frame of a flat of a ball in cells with this shear, if the plane cuts the ball.
    pub fn new<const D: usize>(shear: f64, ball: &BallInCell<D>, flat: &FlatInCell<D>) -> Option<Self> {
        let seen = flat.main_axis();
        let axes = std::array::from_fn(|k| if k == 2 { seen } else { (seen + 1 + k) % D });
        let m = flat.normal();
        // In two dimensions there is nothing across.
        let others = if D == 2 { 1 } else { 2 };
        let slopes = std::array::from_fn(|k| if k < others { m[axes[k]] / m[seen] } else { 0.0 });
        let distance = flat.distance(ball);
        let round = (ball.radius - distance) * (ball.radius + distance);
        let mut center = [0.0; D];
        let normal: [f64; D] = std::array::from_fn(|d| if d == 1 { m[1] - shear * m[0] } else { m[d] });
        for d in 0..D {
            let lean = if d == 0 { shear * normal[1] } else { 0.0 };
            center[d] = ball.center[d] + distance * (normal[d] - lean);
        }
        // Directions in the plane, in space.
        let direction = |k: usize| -> [f64; D] {
            let mut way = std::array::from_fn(|d| f64::from(u8::from(d == axes[k])));
            way[seen] -= slopes[k];
            way[0] += shear * way[1];
            way
        };
        let ways = [0, 1].map(direction);
        let metric = |k: usize, l: usize| ways[k].iter().zip(&ways[l]).map(|(a, b)| a * b).sum::<f64>();
        let first = metric(0, 0).sqrt();
        let mixed = metric(0, 1) / first;
        let second = if D == 2 { 1.0 } else { (metric(1, 1) - mixed * mixed).sqrt() };
        let disc = Disc {
            along: center[axes[0]],
            across: if D == 2 { 0.5 } else { center[axes[1]] },
            radius: round.sqrt(),
            widths: [1.0 / first, 1.0 / second],
            lean: if D == 2 { 0.0 } else { -mixed / (first * second) },
        };
        (round > 0.0).then_some(Self {
            axes,
            place: flat.offset() / m[seen],
            is_above: m[seen] > 0.0,
            slopes,
            disc,
        })
    }

    /// The faces that it is seen through: none where it is parallel to them.
    pub fn faces(&self) -> impl Iterator<Item = Edge> + use<> {
        let Self { place, slopes, .. } = *self;
        let lower = Edge { normal: slopes, offset: place };
        let upper = Edge { normal: slopes.map(|slope| -slope), offset: 1.0 - place };
        [lower, upper].into_iter().filter(move |_| slopes != [0.0; 2])
    }

    /// Whether the cell has a part of it, if it is parallel to faces. A flat on a face of the cell belongs to
    /// the cell on its outer side, where the fluid is.
    pub fn is_in_cell(&self) -> bool {
        let is_inside = if self.is_above {
            (0.0..1.0).contains(&self.place)
        } else {
            0.0 < self.place && self.place <= 1.0
        };
        self.slopes != [0.0; 2] || is_inside
    }

    /// Another half-space in the plane.
    pub fn edge<const D: usize>(&self, flat: &FlatInCell<D>) -> Edge {
        let m = flat.normal();
        let seen = m[self.axes[2]];
        let component = |k: usize| if k + 1 < D { m[self.axes[k]] - seen * self.slopes[k] } else { 0.0 };
        Edge { normal: [component(0), component(1)], offset: flat.offset() - seen * self.place }
    }
}
