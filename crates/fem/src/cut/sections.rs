//! Integrals over the part of a body in a cell, its sections with the faces, and its flats, by rays.

use super::ball::BallInCell;
use super::corners::HalfSpace;
use super::disc::{AngleRule, Lanes, RAYS, Ray, Rays};
use super::flat::FlatInCell;
use super::frame::SectionFrame;
use super::intervals::{Interval, Intervals};
use super::polynomials::{Line, POINTS, Polynomials, integrals, legendre};
use super::rays::{for_each_plane, parts_of_rays};
use super::slice::{Edge, End, Slice};
use crate::element::gauss;
use gluey_linalg::vectorised;

/// Points of the rule on the parts of the angle of planes.
const RULE: usize = 8;
/// Points of a face, at most.
const FACE: usize = POINTS * POINTS;

/// Sums in a plane: rows across the rays, columns along them.
type Plane = [Line; POINTS];

/// Integrals of the Lagrange polynomials over parts of a body.
pub struct Body<const D: usize> {
    /// The part in the cell; x fastest.
    pub volume: Vec<f64>,
    /// The sections with the lower and the upper face across each axis; in their plane, the first of the
    /// other axes fastest.
    pub faces: [[[f64; FACE]; 2]; D],
    /// The flats, in space.
    pub flats: Vec<Vec<f64>>,
}

/// The rules and the frames of cells with the same shear.
pub struct Sections<const D: usize> {
    /// By the direction of the rays.
    frames: [SectionFrame; D],
    /// On parts of the angles of planes.
    heights: Vec<(f64, f64)>,
    /// On those of the angles of rays.
    angles: AngleRule,
    /// Of one direction.
    pub polynomials: Polynomials,
}

/// Sums that rays in one direction add to: Legendre sums, planes by their height.
struct Sums {
    volume: [Plane; POINTS],
    flats: Vec<[Plane; POINTS]>,
}

impl<const D: usize> Sections<D> {
    /// For this shear.
    pub fn new(shear: f64) -> Self {
        Self {
            frames: std::array::from_fn(|direction| SectionFrame::new::<D>(shear, direction)),
            heights: gauss(RULE),
            angles: AngleRule::new(),
            polynomials: Polynomials::new(),
        }
    }

    /// The integrals over a ball cut flat. Each flat is seen by the rays along its largest component.
    pub fn of_body(&self, ball: &BallInCell<D>, flats: &[FlatInCell<D>]) -> Body<D> {
        let zeros = || vec![0.0; POINTS.pow(D as u32)];
        let mut parts = Intervals::default();
        let mut body = Body {
            volume: zeros(),
            faces: std::array::from_fn(|axis| {
                [0, 1].map(|side| self.face(ball, flats, [axis, side], &mut parts))
            }),
            flats: flats.iter().map(|_| zeros()).collect(),
        };
        for direction in 0..D {
            if direction > 0 && flats.iter().all(|flat| flat.main_axis() != direction) {
                continue;
            }
            let sums = self.sums(ball, flats, direction, &mut parts);
            if direction == 0 {
                self.set(direction, &sums.volume, &mut body.volume);
            }
            for (k, sum) in sums.flats.iter().enumerate().filter(|(k, _)| flats[*k].main_axis() == direction)
            {
                self.set(direction, sum, &mut body.flats[k]);
            }
        }
        body
    }

    /// The sums of the rays in a direction, plane by plane.
    fn sums(
        &self,
        ball: &BallInCell<D>,
        flats: &[FlatInCell<D>],
        direction: usize,
        parts: &mut Intervals,
    ) -> Sums {
        let frame = &self.frames[direction];
        let zeros = [[[0.0; POINTS]; POINTS]; POINTS];
        let mut sums = Sums { volume: zeros, flats: vec![zeros; flats.len()] };
        if D == 2 {
            let slice = Slice { disc: frame.section(ball, 0.0).0, edges: edges(frame, flats, 0.0) };
            self.add_plane(&slice, &[1.0], &mut sums, parts);
            return sums;
        }
        let in_3d = ball.in_3d();
        let half_spaces: Vec<HalfSpace> =
            flats.iter().map(|flat| frame.half_space(&in_3d, &flat.in_3d())).collect();
        let mut inner = Intervals::default();
        for_each_plane(&in_3d, frame, &half_spaces, &self.heights, parts, |disc, z, width| {
            let slice = Slice { disc, edges: edges(frame, flats, z) };
            if !slice.is_empty() {
                self.add_plane(&slice, &legendre(z).map(|p| p * width), &mut sums, &mut inner);
            }
        });
        sums
    }

    /// Adds the rays of a plane to layers with these weights.
    fn add_plane(&self, slice: &Slice, layers: &[f64], sums: &mut Sums, parts: &mut Intervals) {
        let Sums { volume, flats } = sums;
        let of_flats = |ray: &Ray, ends: &[End; 2]| {
            for end in ends.iter().filter(|end| end.is_in_cell) {
                let Some((flat, share)) = end.flat else { continue };
                let mut own = Plane::default();
                add_product(&legendre(end.at), ray, share, &mut own);
                add_layers(&own, layers, &mut flats[flat]);
            }
        };
        let parts = parts_of_rays(slice, parts);
        vectorised(
            #[inline(always)]
            || add_layers(&self.plane(slice, parts, of_flats), layers, volume),
        );
    }

    /// The sums of the chords of a plane.
    #[inline(always)]
    fn plane(&self, slice: &Slice, parts: &[Interval], mut visit: impl FnMut(&Ray, &[End; 2])) -> Plane {
        // By ray of a part.
        let mut sums = [[[0.0; RAYS]; POINTS]; POINTS];
        for part in parts {
            let rays = slice.disc.rays(part, &self.angles);
            add_chords(&slice.chords(&rays, &mut visit), &rays, &mut sums);
        }
        sums.map(
            #[inline(always)]
            |row| row.map(sum_of_lanes),
        )
    }

    /// The section of a body with a face.
    fn face(
        &self,
        ball: &BallInCell<D>,
        flats: &[FlatInCell<D>],
        [axis, side]: [usize; 2],
        parts: &mut Intervals,
    ) -> [f64; FACE] {
        let (place, frame) = (side as f64, &self.frames[(axis + 1) % D]);
        let mut face = [0.0; FACE];
        if D == 2 {
            let slice = Slice { disc: frame.section(ball, 0.0).0, edges: edges(frame, flats, 0.0) };
            let ends = slice.disc.ray_at(place).and_then(|ray| slice.ends(&ray));
            let ends = ends.map_or([0.0; 2], |ends| ends.map(|end| end.at));
            face[..POINTS].copy_from_slice(&chord(ends));
            self.polynomials.convert(&mut face[..POINTS], 1);
            return face;
        }
        let height = frame.height(ball, place);
        if height.abs() >= ball.radius {
            return face;
        }
        let slice = Slice { disc: frame.section(ball, height).0, edges: edges(frame, flats, place) };
        if slice.is_empty() {
            return face;
        }
        let parts = parts_of_rays(&slice, parts);
        let plane = vectorised(
            #[inline(always)]
            || self.plane(&slice, parts, |_, _| ()),
        );
        // The rays of the second axis run along the last one, across the first.
        let is_turned = axis == 1;
        for (j, row) in plane.iter().enumerate() {
            for (i, &sum) in row.iter().enumerate() {
                face[if is_turned { j + POINTS * i } else { i + POINTS * j }] = sum;
            }
        }
        [1, POINTS].into_iter().for_each(|stride| self.polynomials.convert(&mut face, stride));
        face
    }

    /// Writes the sums of rays in a direction as integrals of the Lagrange polynomials.
    fn set(&self, direction: usize, sums: &[Plane; POINTS], to: &mut [f64]) {
        let [along, across, height] = self.frames[direction].axes.map(|axis| POINTS.pow(axis as u32));
        let layers = if D == 2 { 1 } else { POINTS };
        for (k, plane) in sums[..layers].iter().enumerate() {
            for (j, row) in plane.iter().enumerate() {
                row.iter().enumerate().for_each(|(i, &sum)| to[i * along + j * across + k * height] = sum);
            }
        }
        (0..D as u32).for_each(|axis| self.polynomials.convert(to, POINTS.pow(axis)));
    }
}

/// The flats in a plane of rays.
fn edges<const D: usize>(frame: &SectionFrame, flats: &[FlatInCell<D>], place: f64) -> Vec<Edge> {
    let [along, across, height] = frame.axes;
    let edge = |(k, flat): (usize, &FlatInCell<D>)| {
        let normal = flat.normal();
        Edge {
            normal: [along, across].map(|d| normal[d]),
            offset: flat.offset() - if D == 3 { normal[height] * place } else { 0.0 },
            flat: (flat.main_axis() == along).then(|| (k, 1.0 / normal[along].abs())),
        }
    };
    flats.iter().enumerate().map(edge).collect()
}

/// Integrals over the part of an interval in the cell, zero if there is none.
fn chord([from, to]: [f64; 2]) -> Line {
    let [from, to] = [from.max(0.0), to.min(1.0)];
    if from >= to {
        return [0.0; POINTS];
    }
    let [from, to] = [integrals(from), integrals(to)];
    std::array::from_fn(|k| to[k] - from[k])
}

/// Adds integrals over chords, for each ray of a part by itself.
#[inline(always)]
fn add_chords([from, to]: &[Lanes; 2], rays: &Rays, sums: &mut [[Lanes; POINTS]; POINTS]) {
    let [mut along, mut across] = [[[0.0; RAYS]; POINTS]; 2];
    for q in 0..RAYS {
        let [start, end, polynomials] = [integrals(from[q]), integrals(to[q]), legendre(rays.at[q])];
        for k in 0..POINTS {
            along[k][q] = end[k] - start[k];
            across[k][q] = rays.weight[q] * polynomials[k];
        }
    }
    for (row, across) in sums.iter_mut().zip(&across) {
        for (sum, along) in row.iter_mut().zip(&along) {
            for q in 0..RAYS {
                sum[q] += across[q] * along[q];
            }
        }
    }
}

/// The sum of the numbers of all rays.
#[inline(always)]
fn sum_of_lanes(lanes: Lanes) -> f64 {
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// `sum += factor along across^T` for the polynomials across a ray.
fn add_product(along: &Line, ray: &Ray, factor: f64, sum: &mut Plane) {
    let across = legendre(ray.at);
    for (row, across) in sum.iter_mut().zip(across) {
        let factor = factor * ray.weight * across;
        row.iter_mut().zip(along).for_each(|(sum, along)| *sum += factor * along);
    }
}

#[inline(always)]
fn add_layers(plane: &Plane, layers: &[f64], sums: &mut [Plane; POINTS]) {
    for (sum, layer) in sums.iter_mut().zip(layers) {
        for (sum, own) in sum.as_flattened_mut().iter_mut().zip(plane.as_flattened()) {
            *sum += layer * own;
        }
    }
}
