//! Moments of a cell that balls cut, whole ones or such as planes cut flat.
//!
//! Rays give the integrals over the part `P` of a body in the cell and over its sections `F_d0`, `F_d1` with
//! the faces. The rest follows from the divergence theorem, with the normal `N` out of the body and the arm
//! `r` from the centre of the ball, in coordinates of the cell:
//!
//! `int_G f N_d = int_P d_d f - int_F_d1 f + int_F_d0 f`, `int_G f r.N = int_P div (f r) - faces`,
//!
//! where `r.N` is the radius `a` on the ball and the distance of the plane on a flat, whose own integrals
//! rays give too. So the theorem holds in every cell to rounding, whatever the error of the rules.

use super::ball::BallInCell;
use super::flat::FlatInCell;
use super::polynomials::POINTS;
use super::sections::{Body, Sections};
use crate::element::gauss_cube;

/// Integrals of the Lagrange polynomials of a cell's Gauss points over what balls leave of it and over their
/// surfaces, in units in which the cell is the unit cube. Points are numbered with x fastest.
///
/// Balls are taken one by one: where they overlap, the overlap is taken away twice.
#[derive(Clone, Debug, PartialEq)]
pub struct CutMoments<const D: usize> {
    /// Over the part of the cell outside the balls.
    pub volume: Vec<f64>,
    /// Over the surface of each ball in the cell.
    pub surfaces: Vec<SurfaceMoments<D>>,
}

/// Integrals over the part of a ball's surface in a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceMoments<const D: usize> {
    /// Integrals of the polynomials times the normal, which points into the ball.
    pub normal: Vec<[f64; D]>,
    /// Integrals of the polynomials.
    pub area: Vec<f64>,
}

impl<const D: usize> CutMoments<D> {
    /// Integrals over all surfaces.
    pub fn area(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.volume.len()];
        for surface in &self.surfaces {
            sum.iter_mut().zip(&surface.area).for_each(|(sum, area)| *sum += area);
        }
        sum
    }

    /// The moments of a cell that these balls cut.
    pub fn new(balls: &[BallInCell<D>]) -> Self {
        Self::truncated(balls.iter().map(|ball| (ball, &[][..])))
    }

    /// The moments of a cell that balls cut which are themselves cut flat: each ball with its flats.
    pub fn truncated<'a>(
        balls: impl ExactSizeIterator<Item = (&'a BallInCell<D>, &'a [FlatInCell<D>])>,
    ) -> Self {
        Self::sheared(0.0, balls)
    }

    /// The same for a cell that is sheared, see [`CutRules::new`].
    pub fn sheared<'a>(
        shear: f64,
        balls: impl ExactSizeIterator<Item = (&'a BallInCell<D>, &'a [FlatInCell<D>])>,
    ) -> Self {
        CutRules::new(shear).moments(balls)
    }

    /// Share of the cell outside the balls.
    pub fn fraction(&self) -> f64 {
        self.volume.iter().sum()
    }
}

/// Rules that moments of all cells with the same shear are integrated with.
pub struct CutRules<const D: usize> {
    shear: f64,
    /// Integrals over all of a cell.
    whole: Vec<f64>,
    sections: Sections<D>,
}

impl<const D: usize> CutRules<D> {
    /// The rules for sheared cells: a point of the unit cube has the place `x + shear y e_1`. Normals and
    /// areas are those of the sheared cell, in which balls are round.
    pub fn new(shear: f64) -> Self {
        Self {
            shear,
            whole: gauss_cube::<D>(POINTS).into_iter().map(|point| point.1).collect(),
            sections: Sections::new(shear),
        }
    }

    /// The moments of a cell that balls cut, each ball with its flats.
    pub fn moments<'a>(
        &self,
        balls: impl ExactSizeIterator<Item = (&'a BallInCell<D>, &'a [FlatInCell<D>])>,
    ) -> CutMoments<D> {
        let mut new = CutMoments { volume: self.whole.clone(), surfaces: Vec::with_capacity(balls.len()) };
        for (ball, flats) in balls {
            let inside = self.inside(ball, flats);
            new.volume.iter_mut().zip(inside.volume).for_each(|(whole, part)| *whole -= part);
            let into_ball = |normal| sheared_normal(self.shear, normal).map(|n| -n);
            let normal = inside.normal.into_iter().map(into_ball).collect();
            new.surfaces.push(SurfaceMoments { normal, area: inside.area });
        }
        new
    }

    fn inside(&self, ball: &BallInCell<D>, flats: &[FlatInCell<D>]) -> Inside<D> {
        if flats.iter().any(|flat| flat.takes(ball, self.shear)) {
            return Inside::zeros();
        }
        let flats: Vec<FlatInCell<D>> =
            flats.iter().filter(|flat| !flat.leaves(ball, self.shear)).copied().collect();
        let body = self.sections.of_body(ball, &flats);
        let mut inside = Inside::zeros();
        for axis in 0..D {
            self.add_direction(axis, ball, &body, &mut inside);
        }
        for (q, area) in inside.area.iter_mut().enumerate() {
            *area = (*area + D as f64 * body.volume[q]) / ball.radius;
            for (flat, own) in flats.iter().zip(&body.flats) {
                *area += (1.0 - flat.distance(ball) / ball.radius) * own[q];
            }
        }
        Inside { volume: body.volume, ..inside }
    }

    /// The normals along an axis, and `int r_d N_d` without the term `int d_d r_d` among the areas.
    fn add_direction(&self, axis: usize, ball: &BallInCell<D>, body: &Body<D>, to: &mut Inside<D>) {
        let polynomials = &self.sections.polynomials;
        let stride = POINTS.pow(axis as u32);
        for (q, normal) in to.normal.iter_mut().enumerate() {
            let i = q / stride % POINTS;
            let first = q - i * stride;
            // Place among the points of a face.
            let face = first % stride + first / (stride * POINTS) * stride;
            let [mut slopes, mut arms] = [0.0; 2];
            for (j, (slope, arm)) in polynomials.slopes[i].iter().zip(&polynomials.arms[i]).enumerate() {
                let part = body.volume[first + j * stride];
                slopes += slope * part;
                arms += arm * part;
            }
            let [lower, upper] = [0, 1].map(|side| polynomials.ends[side][i] * body.faces[axis][side][face]);
            normal[axis] = slopes - upper + lower;
            to.area[q] += arms - upper - ball.center[axis] * normal[axis];
        }
    }
}

/// `n dS` of a surface element from `N dS'` in coordinates of the cell (Nanson's formula).
fn sheared_normal<const D: usize>(shear: f64, mut normal: [f64; D]) -> [f64; D] {
    normal[1] -= shear * normal[0];
    normal
}

/// Integrals over the part of a body in a cell, and over its surface there with the normal out of the body,
/// in coordinates of the cell.
struct Inside<const D: usize> {
    volume: Vec<f64>,
    normal: Vec<[f64; D]>,
    area: Vec<f64>,
}

impl<const D: usize> Inside<D> {
    fn zeros() -> Self {
        let count = POINTS.pow(D as u32);
        Self { volume: vec![0.0; count], normal: vec![[0.0; D]; count], area: vec![0.0; count] }
    }
}

#[cfg(test)]
mod tests;
