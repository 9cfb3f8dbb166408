//! Integrals over the part of a body in a cell, its sections with the faces, and its flats, by rays.

use super::ball::BallInCell;
use super::corners::HalfSpace;
use super::disc::{AngleRule, Lanes, RAYS, Rays};
use super::flat::FlatInCell;
use super::frame::{FlatFrame, SectionFrame};
use super::intervals::{Interval, Intervals};
use super::polynomials::{Line, POINTS, Polynomials, integrals, legendre};
use super::rays::{for_each_plane, parts_of_rays};
use super::slice::{Edge, Slice};
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
    shear: f64,
    /// By the direction of the rays.
    frames: [SectionFrame; D],
    /// On parts of the angles of planes.
    heights: Vec<(f64, f64)>,
    /// On those of the angles of rays.
    angles: AngleRule,
    /// On chords of flats, exact for products of two of the polynomials.
    chords: [(f64, f64); POINTS],
    /// Of one direction.
    pub polynomials: Polynomials,
}

impl<const D: usize> Sections<D> {
    /// For this shear.
    pub fn new(shear: f64) -> Self {
        let rule = gauss(POINTS);
        Self {
            shear,
            frames: std::array::from_fn(|direction| SectionFrame::new::<D>(shear, direction)),
            heights: gauss(RULE),
            angles: AngleRule::new(),
            chords: std::array::from_fn(|k| rule[k]),
            polynomials: Polynomials::new(),
        }
    }

    /// The integrals over a ball cut flat.
    pub fn of_body(&self, ball: &BallInCell<D>, flats: &[FlatInCell<D>]) -> Body<D> {
        let mut parts = Intervals::default();
        Body {
            volume: self.volume(ball, flats, &mut parts),
            faces: std::array::from_fn(|axis| {
                [0, 1].map(|side| self.face(ball, flats, [axis, side], &mut parts))
            }),
            flats: (0..flats.len()).map(|k| self.flat(ball, flats, k, &mut parts)).collect(),
        }
    }

    /// The part in the cell, plane by plane.
    fn volume(&self, ball: &BallInCell<D>, flats: &[FlatInCell<D>], parts: &mut Intervals) -> Vec<f64> {
        let frame = &self.frames[0];
        let mut sums = [[[0.0; POINTS]; POINTS]; POINTS];
        let mut add = |slice: &Slice, layers: &[f64], parts: &mut Intervals| {
            let parts = parts_of_rays(slice, parts);
            vectorised(
                #[inline(always)]
                || add_layers(&self.plane(slice, parts), layers, &mut sums),
            );
        };
        if D == 2 {
            let slice = Slice { disc: frame.section(ball, 0.0).0, edges: edges(frame, flats, 0.0) };
            add(&slice, &[1.0], parts);
            return self.integrals(frame.axes, &sums);
        }
        let in_3d = ball.in_3d();
        let half_spaces: Vec<HalfSpace> =
            flats.iter().map(|flat| frame.half_space(&in_3d, &flat.in_3d())).collect();
        let mut inner = Intervals::default();
        for_each_plane(&in_3d, frame, &half_spaces, &self.heights, parts, |disc, z, width| {
            let slice = Slice { disc, edges: edges(frame, flats, z) };
            if !slice.is_empty() {
                add(&slice, &legendre(z).map(|p| p * width), &mut inner);
            }
        });
        self.integrals(frame.axes, &sums)
    }

    /// A flat: its part `dA` as it is seen along the axis of the largest component `m_d` of its covector
    /// belongs to `dA / |m_d|` of the flat.
    fn flat(
        &self,
        ball: &BallInCell<D>,
        flats: &[FlatInCell<D>],
        k: usize,
        parts: &mut Intervals,
    ) -> Vec<f64> {
        let mut sums = [[[0.0; POINTS]; POINTS]; POINTS];
        let Some(frame) = FlatFrame::new(self.shear, ball, &flats[k]) else {
            return vec![0.0; POINTS.pow(D as u32)];
        };
        let others = flats.iter().enumerate().filter(|other| other.0 != k).map(|other| frame.edge(other.1));
        let slice = Slice { disc: frame.disc, edges: others.chain(frame.faces()).collect() };
        if frame.is_in_cell() && !slice.is_empty() {
            let share = 1.0 / flats[k].normal()[frame.axes[2]].abs();
            if D == 2 {
                self.add_flat(&frame, &slice, &Rays::through(&slice.disc, share), &mut sums);
            } else {
                for part in parts_of_rays(&slice, parts) {
                    let mut rays = slice.disc.rays(part, &self.angles);
                    rays.weight.iter_mut().for_each(|weight| *weight *= share);
                    self.add_flat(&frame, &slice, &rays, &mut sums);
                }
            }
        }
        let [along, across, seen] = frame.axes;
        self.integrals([along, seen, across], &sums)
    }

    /// Adds the rays of a part of a flat: layers across them, rows along the axis that it is seen along.
    fn add_flat(&self, frame: &FlatFrame, slice: &Slice, rays: &Rays, sums: &mut [Plane; POINTS]) {
        vectorised(
            #[inline(always)]
            || {
                let [from, to] = slice.chords(rays);
                for q in 0..RAYS {
                    let mut plane = Plane::default();
                    for (t, weight) in self.chords {
                        let along = from[q] + (to[q] - from[q]) * t;
                        let seen = frame.place - frame.slopes[0] * along - frame.slopes[1] * rays.at[q];
                        let weight = weight * (to[q] - from[q]) * rays.weight[q];
                        let [along, seen] = [legendre(along), legendre(seen).map(|p| p * weight)];
                        for (row, seen) in plane.iter_mut().zip(&seen) {
                            row.iter_mut().zip(&along).for_each(|(sum, along)| *sum += seen * along);
                        }
                    }
                    let layers = legendre(rays.at[q]);
                    add_layers(&plane, if D == 2 { &layers[..1] } else { &layers }, sums);
                }
            },
        );
    }

    /// The sums of the chords of a plane.
    #[inline(always)]
    fn plane(&self, slice: &Slice, parts: &[Interval]) -> Plane {
        // By ray of a part.
        let mut sums = [[[0.0; RAYS]; POINTS]; POINTS];
        for part in parts {
            let rays = slice.disc.rays(part, &self.angles);
            add_chords(&slice.chords(&rays), &rays, &mut sums);
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
            face[..POINTS].copy_from_slice(&chord(ends.unwrap_or([0.0; 2])));
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
            || self.plane(&slice, parts),
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

    /// The integrals of the Lagrange polynomials from Legendre sums with rows, columns and layers along these
    /// axes.
    fn integrals(&self, axes: [usize; 3], sums: &[Plane; POINTS]) -> Vec<f64> {
        let mut integrals = vec![0.0; POINTS.pow(D as u32)];
        let [along, across, height] = axes.map(|axis| POINTS.pow(axis as u32));
        let layers = if D == 2 { 1 } else { POINTS };
        for (k, plane) in sums[..layers].iter().enumerate() {
            for (j, row) in plane.iter().enumerate() {
                for (i, &sum) in row.iter().enumerate() {
                    integrals[i * along + j * across + k * height] = sum;
                }
            }
        }
        (0..D as u32).for_each(|axis| self.polynomials.convert(&mut integrals, POINTS.pow(axis)));
        integrals
    }
}

/// The flats in a plane of rays.
fn edges<const D: usize>(frame: &SectionFrame, flats: &[FlatInCell<D>], place: f64) -> Vec<Edge> {
    let [along, across, height] = frame.axes;
    let edge = |flat: &FlatInCell<D>| {
        let normal = flat.normal();
        Edge {
            normal: [along, across].map(|d| normal[d]),
            offset: flat.offset() - if D == 3 { normal[height] * place } else { 0.0 },
        }
    };
    flats.iter().map(edge).collect()
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

#[inline(always)]
fn add_layers(plane: &Plane, layers: &[f64], sums: &mut [Plane; POINTS]) {
    for (sum, layer) in sums.iter_mut().zip(layers) {
        for (sum, own) in sum.as_flattened_mut().iter_mut().zip(plane.as_flattened()) {
            *sum += layer * own;
        }
    }
}
