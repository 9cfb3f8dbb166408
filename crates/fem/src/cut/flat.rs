//! Planes that cut a ball flat, as a cell sees them.

use super::ball::BallInCell;

/// A plane this near to all of a face of the cell lies in the face. On either side of the face, cells agree.
const ON_FACE: f64 = 1e-9;

/// A half-space `m . x <= offset` that a body does not leave, in coordinates in which the cell is the unit
/// cube. Where the cell is sheared by `A`, `m = A^T n` for the unit normal `n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatInCell<const D: usize> {
    normal: [f64; D],
    offset: f64,
}

impl<const D: usize> FlatInCell<D> {
    /// The half-space with this `m`, the unit normal if the cell is a cube; one whose border is a face of the
    /// cell but for rounding ends there, so that the surface belongs to one of two neighbours.
    pub fn new(normal: [f64; D], offset: f64) -> Self {
        let new = Self { normal, offset };
        let on_face = |k: usize| {
            let (axis, face) = (k / 2, (k % 2) as f64);
            let rest = || (0..D).filter(move |&e| e != axis).map(|e| normal[e]);
            let middle = normal[axis] * face + 0.5 * rest().sum::<f64>() - offset;
            let spread = 0.5 * rest().map(f64::abs).sum::<f64>();
            (middle.abs() + spread <= ON_FACE).then(|| Self {
                normal: std::array::from_fn(|d| if d == axis { normal[axis] } else { 0.0 }),
                offset: normal[axis] * face,
            })
        };
        (0..2 * D).find_map(on_face).unwrap_or(new)
    }

    /// `m`, out of the body.
    pub fn normal(&self) -> &[f64; D] {
        &self.normal
    }

    /// The axis along which `m` is largest.
    pub(super) fn main_axis(&self) -> usize {
        let largest =
            |best: usize, d: usize| if self.normal[d].abs() > self.normal[best].abs() { d } else { best };
        (1..D).fold(0, largest)
    }

    /// The same half-space of a cube.
    pub(super) fn in_3d(&self) -> FlatInCell<3> {
        let normal = std::array::from_fn(|d| self.normal.get(d).copied().unwrap_or(0.0));
        FlatInCell { normal, offset: self.offset }
    }

    /// Value of `m . x` on the border.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Distance of the border from the centre of a ball, negative if the centre is cut away.
    pub fn distance(&self, ball: &BallInCell<D>) -> f64 {
        self.offset - self.normal.iter().zip(&ball.center).map(|(m, c)| m * c).sum::<f64>()
    }

    /// Whether the cell lies inside.
    pub fn leaves_cell(&self) -> bool {
        self.normal.iter().map(|n| n.max(0.0)).sum::<f64>() <= self.offset
    }

    /// Whether the cell lies outside and does not touch the border.
    pub fn takes_cell(&self) -> bool {
        self.normal.iter().map(|n| n.min(0.0)).sum::<f64>() > self.offset
    }

    /// Whether a ball lies inside.
    pub fn leaves_ball(&self, ball: &BallInCell<D>) -> bool {
        self.distance(ball) >= ball.radius
    }
}
