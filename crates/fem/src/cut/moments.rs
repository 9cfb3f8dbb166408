//! Moments of a cell that balls cut, whole ones or such as planes cut flat.

use super::ball::BallInCell;
use super::corners::HalfSpace;
use super::disc::Ray;
use super::flat::FlatInCell;
use super::frame::Frame;
use super::rays::{for_each_plane, for_each_ray};
use super::slice::{Line, Slice};
use crate::element::{gauss, gauss_cube};

/// Gauss points per direction: their polynomials have degree 4 in each coordinate.
pub const POINTS: usize = 5;
/// Points of the rule on the parts of an angle.
const RULE: usize = 8;

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

    /// The same for a cell that is sheared: a point of the unit cube has the place `x + shear y e_1`. Normals
    /// and areas are those of the sheared cell, in which balls are round.
    pub fn sheared<'a>(
        shear: f64,
        balls: impl ExactSizeIterator<Item = (&'a BallInCell<D>, &'a [FlatInCell<D>])>,
    ) -> Self {
        let mut new = Self {
            volume: gauss_cube::<D>(POINTS).into_iter().map(|point| point.1).collect(),
            surfaces: Vec::with_capacity(balls.len()),
        };
        let rules = Rules::new(shear);
        for (ball, flats) in balls {
            let inside = rules.inside(ball, flats);
            new.volume.iter_mut().zip(inside.volume).for_each(|(whole, part)| *whole -= part);
            let normal = inside.normal.into_iter().map(|n| sheared_normal(shear, n).map(|n| -n)).collect();
            new.surfaces.push(SurfaceMoments { normal, area: inside.area });
        }
        new
    }

    /// Share of the cell outside the balls.
    pub fn fraction(&self) -> f64 {
        self.volume.iter().sum()
    }
}

/// `n dS` of a surface element from `N dS'` in coordinates of the cell (Nanson's formula).
fn sheared_normal<const D: usize>(shear: f64, mut normal: [f64; D]) -> [f64; D] {
    normal[1] -= shear * normal[0];
    normal
}

/// Integrals over the part of a ball in a cell, and over its surface there with the normal out of the ball,
/// in coordinates of the cell.
struct Inside<const D: usize> {
    volume: Vec<f64>,
    normal: Vec<[f64; D]>,
    area: Vec<f64>,
}

/// The one-dimensional rules that integrals are made of.
struct Rules {
    /// Shear of the cell.
    shear: f64,
    /// On parts of angles.
    angles: Vec<(f64, f64)>,
    /// Along chords: exact for the polynomials.
    chords: Vec<(f64, f64)>,
    lagrange: Lagrange,
}

impl Rules {
    fn new(shear: f64) -> Self {
        Self { shear, angles: gauss(RULE), chords: gauss(POINTS.div_ceil(2)), lagrange: Lagrange::new() }
    }

    /// By rays in every direction for the surface; those in the first give the volume too.
    fn inside<const D: usize>(&self, ball: &BallInCell<D>, flats: &[FlatInCell<D>]) -> Inside<D> {
        let count = POINTS.pow(D as u32);
        let mut inside =
            Inside { volume: vec![0.0; count], normal: vec![[0.0; D]; count], area: vec![0.0; count] };
        if flats.iter().any(FlatInCell::takes_cell) {
            return inside;
        }
        let matters = |flat: &&FlatInCell<D>| !flat.leaves_cell() && !flat.leaves_ball(ball);
        let flats: Vec<FlatInCell<D>> = flats.iter().filter(matters).copied().collect();
        for direction in 0..D {
            self.add_rays(ball, &flats, direction, &mut inside);
        }
        inside
    }

    /// Adds what the rays in a direction tell, plane by plane.
    fn add_rays<const D: usize>(
        &self,
        ball: &BallInCell<D>,
        flats: &[FlatInCell<D>],
        direction: usize,
        inside: &mut Inside<D>,
    ) {
        let frame = Frame::new::<D>(self.shear, direction);
        let [_, across, height] = frame.axes;
        let strides = [direction, across].map(stride);
        let center = ball.center[direction];
        let lines = |offset: &dyn Fn(&FlatInCell<D>) -> f64| -> Vec<Line> {
            let line = |flat: &FlatInCell<D>| Line {
                normal: [direction, across].map(|d| flat.normal()[d]),
                slope: raised(self.shear, flat.normal(), direction),
                offset: offset(flat),
            };
            flats.iter().map(line).collect()
        };
        if D == 2 {
            let slice = Slice { disc: frame.section(ball, 0.0).0, lines: lines(&FlatInCell::offset) };
            let plane = self.plane(&slice, (center, ball.radius));
            return plane.add_to(inside, direction, strides, &[(0, 1.0)]);
        }
        let in_3d = BallInCell::<3> { center: std::array::from_fn(|d| ball.center[d]), radius: ball.radius };
        let half_spaces: Vec<HalfSpace> =
            flats.iter().map(|flat| frame.half_space(&in_3d, &flat.in_3d())).collect();
        for_each_plane(&in_3d, &frame, &half_spaces, &self.angles, |disc, z, width| {
            let slice = Slice { disc, lines: lines(&|flat| flat.offset() - flat.normal()[height] * z) };
            if slice.is_empty() {
                return;
            }
            let values = self.lagrange.values(z);
            let layers: Vec<(usize, f64)> =
                (0..POINTS).map(|k| (k * stride(height), width * values[k])).collect();
            self.plane(&slice, (center, ball.radius)).add_to(inside, direction, strides, &layers);
        });
    }

    /// The moments of a plane of rays through a ball with this radius and centre along the rays.
    fn plane(&self, slice: &Slice, ball: (f64, f64)) -> Plane {
        let mut plane = Plane::default();
        for_each_ray(slice, &self.angles, |ray| self.add_ray(slice, ball, ray, &mut plane));
        plane
    }

    fn add_ray(&self, slice: &Slice, ball: (f64, f64), ray: Ray, plane: &mut Plane) {
        let Some(ends) = slice.ends(&ray, ball) else { return };
        let across = self.lagrange.values(ray.at).map(|value| value * ray.weight);
        let chord = self.chord([ends[0].at.max(0.0), ends[1].at.min(1.0)]);
        add_product(&chord, &across, 1.0, &mut plane.volume);
        for (end, normal) in ends.into_iter().zip([-1.0, 1.0]).filter(|end| end.0.is_in_cell) {
            let along = self.lagrange.values(end.at);
            add_product(&along, &across, normal, &mut plane.normal);
            add_product(&along, &across, end.slope, &mut plane.area);
        }
    }

    /// Integrals of the polynomials over an interval, zero if it is empty.
    fn chord(&self, [from, to]: [f64; 2]) -> [f64; POINTS] {
        let mut sum = [0.0; POINTS];
        let length = (to - from).max(0.0);
        for &(t, weight) in &self.chords {
            let values = self.lagrange.values(from + t * length);
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += length * weight * value);
        }
        sum
    }
}

/// A component of `A^-1 n = A^-1 A^-T m`.
fn raised<const D: usize>(shear: f64, m: &[f64; D], component: usize) -> f64 {
    let second = m[1] - shear * m[0];
    match component {
        0 => m[0] - shear * second,
        1 => second,
        _ => m[component],
    }
}

/// Distance of neighbouring points along an axis.
fn stride(axis: usize) -> usize {
    POINTS.pow(axis as u32)
}

fn add_product(
    along: &[f64; POINTS],
    across: &[f64; POINTS],
    factor: f64,
    sum: &mut [[f64; POINTS]; POINTS],
) {
    for (row, across) in sum.iter_mut().zip(across) {
        row.iter_mut().zip(along).for_each(|(sum, along)| *sum += factor * across * along);
    }
}

/// Moments in a plane: rows across the rays, columns along them.
#[derive(Default)]
struct Plane {
    volume: [[f64; POINTS]; POINTS],
    normal: [[f64; POINTS]; POINTS],
    area: [[f64; POINTS]; POINTS],
}

impl Plane {
    /// Adds the moments in every layer, given by its first point and its weight. Those of the volume are
    /// added for the first direction only.
    fn add_to<const D: usize>(
        &self,
        inside: &mut Inside<D>,
        direction: usize,
        [along, across]: [usize; 2],
        layers: &[(usize, f64)],
    ) {
        for &(first, weight) in layers {
            for j in 0..POINTS {
                for i in 0..POINTS {
                    let q = first + i * along + j * across;
                    inside.normal[q][direction] += weight * self.normal[j][i];
                    inside.area[q] += weight * self.area[j][i];
                    if direction == 0 {
                        inside.volume[q] += weight * self.volume[j][i];
                    }
                }
            }
        }
    }
}

/// Lagrange polynomials of the Gauss points in one dimension.
struct Lagrange {
    points: [f64; POINTS],
    /// Inverse products of the distances to the others.
    scales: [f64; POINTS],
}

impl Lagrange {
    fn new() -> Self {
        let line = gauss(POINTS);
        let points: [f64; POINTS] = std::array::from_fn(|i| line[i].0);
        let others = |i: usize| (0..POINTS).filter(move |&j| j != i);
        let scales = std::array::from_fn(|i| 1.0 / others(i).map(|j| points[i] - points[j]).product::<f64>());
        Self { points, scales }
    }

    /// Values of all of them at `x`, by products from both sides.
    fn values(&self, x: f64) -> [f64; POINTS] {
        let mut values = self.scales;
        let (mut left, mut right) = (1.0, 1.0);
        for i in 0..POINTS {
            values[i] *= left;
            left *= x - self.points[i];
            let last = POINTS - 1 - i;
            values[last] *= right;
            right *= x - self.points[last];
        }
        values
    }
}

#[cfg(test)]
mod tests;
