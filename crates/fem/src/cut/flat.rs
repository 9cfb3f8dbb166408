//! Planes that cut a ball flat, as a cell sees them.

use super::ball::BallInCell;

/// A plane this near to all of a face of the cell lies in the face. On either side of the face, cells agree.
const ON_FACE: f64 = 1e-9;
/// Steps of the search for the highest point that a ball has in the cell.
const STEPS: usize = 16;

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

    /// Whether all that a ball has in a cell with this shear lies inside.
    pub fn leaves(&self, ball: &BallInCell<D>, shear: f64) -> bool {
        is_below(self.normal, self.offset, ball, shear)
    }

    /// Whether nothing that a ball has in a cell with this shear lies inside or on the border.
    pub fn takes(&self, ball: &BallInCell<D>, shear: f64) -> bool {
        is_below(self.normal.map(|m| -m), -self.offset - ON_FACE, ball, shear)
    }
}

/// Whether `m . x <= offset` is found to hold in all that a ball has in the cell.
///
/// For every `p`, `m . x <= sum_d max(0, m_d - p_d) + p . c + r |A^-T p|` there: a bound for the cell and one
/// for the ball. The least is that of `p = l A^T A (x - c)` for the highest `x`, which maximises
/// `m . x - l/2 |A (x - c)|^2` in the cell for one `l`.
fn is_below<const D: usize>(m: [f64; D], offset: f64, ball: &BallInCell<D>, shear: f64) -> bool {
    let mut covector = m;
    covector[1] -= shear * m[0];
    let length = covector.iter().map(|n| n * n).sum::<f64>().sqrt();
    let center: f64 = (0..D).map(|d| m[d] * ball.center[d]).sum();
    if m.iter().map(|m| m.max(0.0)).sum::<f64>() <= offset || center + ball.radius * length <= offset {
        return true;
    }
    let (mut low, mut high, mut l) = (0.0, f64::INFINITY, length / ball.radius);
    for _ in 0..STEPS {
        let arm = highest(&m, l, ball, shear);
        let mut place = arm;
        place[0] += shear * arm[1];
        let distance = place.iter().map(|x| x * x).sum::<f64>().sqrt();
        let mut pull = place.map(|x| l * x);
        pull[1] += shear * pull[0];
        let of_cell: f64 = (0..D).map(|d| (m[d] - pull[d]).max(0.0)).sum();
        let of_ball: f64 = (0..D).map(|d| pull[d] * ball.center[d]).sum();
        if of_cell + of_ball + ball.radius * l * distance <= offset {
            return true;
        }
        if distance <= ball.radius {
            if (0..D).map(|d| m[d] * (ball.center[d] + arm[d])).sum::<f64>() > offset {
                return false;
            }
            high = l;
        } else {
            low = l;
        }
        l = if high == f64::INFINITY {
            4.0 * l
        } else if low == 0.0 {
            0.25 * l
        } else {
            (low * high).sqrt()
        };
    }
    false
}

/// The point of the cell, from the centre of the ball, in which `m . x - l/2 |A (x - c)|^2` is largest.
fn highest<const D: usize>(m: &[f64; D], l: f64, ball: &BallInCell<D>, shear: f64) -> [f64; D] {
    let mut arm = [0.0; D];
    // Two coordinates depend on each other in a sheared cell; the bound holds wherever this stops.
    for _ in 0..if shear == 0.0 { 1 } else { 4 } {
        for d in 0..D {
            let free = match d {
                0 => m[0] / l - shear * arm[1],
                1 => (m[1] / l - shear * arm[0]) / (1.0 + shear * shear),
                _ => m[d] / l,
            };
            arm[d] = free.clamp(-ball.center[d], 1.0 - ball.center[d]);
        }
    }
    arm
}
