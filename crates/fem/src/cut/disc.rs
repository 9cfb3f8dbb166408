//! Sections of balls with planes of rays, and the rays, one by one or those of a part of an angle together.

use super::intervals::{Interval, LONGEST};
use crate::element::gauss;

/// Rays of a part of an angle: points of a Gauss rule.
pub const RAYS: usize = 8;
/// A number for each of them.
pub type Lanes = [f64; RAYS];

/// The section of a ball with a plane of rays: the points `across + widths[1] rho sin(t)` across the rays and
/// `along + lean rho sin(t) + widths[0] rho cos(t)` along them. A disc where cells are cubes.
#[derive(Clone, Copy, Debug)]
pub struct Disc {
    /// Coordinate of the centre along the rays.
    pub along: f64,
    /// Coordinate of the centre across the rays.
    pub across: f64,
    /// Radius `rho` of the section, in which it is round.
    pub radius: f64,
    /// Widths along and across the rays in coordinates of the cell, for one of the round section.
    pub widths: [f64; 2],
    /// How far along the rays their middle moves for one across the round section.
    pub lean: f64,
}

/// A ray through a disc.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Its coordinate across.
    pub at: f64,
    /// The middle of its chord.
    pub middle: f64,
    /// Half the length of its chord.
    pub half: f64,
    /// Width of the strip it stands for.
    pub weight: f64,
}

/// The rays of a part of an angle.
#[derive(Clone, Copy, Debug)]
pub struct Rays {
    /// See [`Ray::at`].
    pub at: Lanes,
    /// See [`Ray::middle`].
    pub middle: Lanes,
    /// See [`Ray::half`].
    pub half: Lanes,
    /// See [`Ray::weight`].
    pub weight: Lanes,
}

/// The Gauss rule with a ray at each point, on an interval of length one about zero.
#[derive(Clone, Copy, Debug)]
pub struct AngleRule {
    points: Lanes,
    weights: Lanes,
}

impl AngleRule {
    /// The rule.
    pub fn new() -> Self {
        let rule = gauss(RAYS);
        Self { points: std::array::from_fn(|q| rule[q].0 - 0.5), weights: std::array::from_fn(|q| rule[q].1) }
    }
}

impl Rays {
    /// The ray through the middle of a disc, with this weight, and others of none.
    pub fn through(disc: &Disc, weight: f64) -> Self {
        let mut weights = [0.0; RAYS];
        weights[0] = weight;
        let half = disc.widths[0] * disc.radius;
        Self { at: [disc.across; RAYS], middle: [disc.along; RAYS], half: [half; RAYS], weight: weights }
    }
}

impl Disc {
    /// The rays at the points of the rule on a part of the angle.
    #[inline(always)]
    pub fn rays(&self, part: &Interval, rule: &AngleRule) -> Rays {
        let length = part.to - part.from;
        let (sin, cos) = (0.5 * (part.from + part.to)).sin_cos();
        let mut rays = Rays { at: [0.0; RAYS], middle: [0.0; RAYS], half: [0.0; RAYS], weight: [0.0; RAYS] };
        for q in 0..RAYS {
            let [s, c] = sin_cos_of_small(length * rule.points[q]);
            let ray = self.ray([sin * c + cos * s, cos * c - sin * s], length * rule.weights[q]);
            (rays.at[q], rays.middle[q], rays.half[q], rays.weight[q]) =
                (ray.at, ray.middle, ray.half, ray.weight);
        }
        rays
    }

    /// The ray through the disc at an angle of this sine and cosine, for a part of the angle.
    #[inline(always)]
    pub fn ray(&self, [sin, cos]: [f64; 2], weight: f64) -> Ray {
        let Self { along, across, radius, widths, lean } = self;
        Ray {
            at: across + widths[1] * radius * sin,
            middle: along + lean * radius * sin,
            half: widths[0] * radius * cos,
            weight: weight * widths[1] * radius * cos,
        }
    }

    /// The ray with this coordinate across, if it meets the disc.
    pub fn ray_at(&self, at: f64) -> Option<Ray> {
        let sin = (at - self.across) / (self.widths[1] * self.radius);
        let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
        // Exactly where it was wanted: a flat may lie there.
        (sin.abs() < 1.0).then(|| Ray { at, ..self.ray([sin, cos], 0.0) })
    }
}

/// Sine and cosine of an angle that is at most half of [`LONGEST`], to rounding, by their series.
#[inline(always)]
fn sin_cos_of_small(x: f64) -> [f64; 2] {
    const { assert!(LONGEST <= 1.0, "the series are cut for angles up to 0.5") };
    let square = x * x;
    let series = |inverses: [f64; 7]| inverses.iter().rev().fold(0.0, |sum, c| c * (1.0 - square * sum));
    // Each factor is the ratio of two terms.
    let sin = x * series([1.0, 1.0 / 6.0, 1.0 / 20.0, 1.0 / 42.0, 1.0 / 72.0, 1.0 / 110.0, 1.0 / 156.0]);
    let cos = [1.0 / 2.0, 1.0 / 12.0, 1.0 / 30.0, 1.0 / 56.0, 1.0 / 90.0, 1.0 / 132.0, 1.0 / 182.0];
    [sin, 1.0 - square * series(cos)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_are_right_to_rounding() {
        for k in -50..=50 {
            let x = f64::from(k) / 50.0 * 0.5 * LONGEST;
            let [sin, cos] = sin_cos_of_small(x);
            assert!((sin - x.sin()).abs() <= 1.2e-16 && (cos - x.cos()).abs() <= 2.3e-16, "{x}");
        }
    }
}
