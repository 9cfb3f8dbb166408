//! Heights at which the sections of a ball cut flat change their form.
//!
//! Where a corner, in which three of sphere, flats and faces meet, passes through the plane, the moments have
//! a kink; where a flat begins to cut the disc, at the highest and the lowest point of its edge, they behave
//! like a square root.

use gluey_geom::Vector;
use std::f64::consts::{FRAC_PI_2, PI};

use super::intervals::Breakpoint;

/// How far outside the body or the cell a corner may lie, by rounding.
const SLACK: f64 = 1e-9;
/// How far outside the body or the cell, in units of the cell, a point may lie whose square root is felt.
const BESIDE: f64 = 1.0;
/// Planes that meet at an angle below this are parallel.
const PARALLEL: f64 = 1e-12;
/// Angles nearer than this are one.
const SAME: f64 = 1e-13;

/// A half-space `n . x <= offset`, coordinates relative to the centre of the ball.
#[derive(Clone, Copy, Debug)]
pub struct HalfSpace {
    /// Unit normal: along the rays, across them, across the planes.
    pub normal: Vector<3>,
    /// Distance of its border from the centre.
    pub offset: f64,
}

/// The angles of heights at which the sections of a ball of this radius change, which flats cut and which
/// lies in a cell with these faces along the height.
pub fn breakpoints(radius: f64, flats: &[HalfSpace], faces: &[HalfSpace; 4]) -> Vec<Breakpoint> {
    let mut planes = flats.to_vec();
    planes.extend(faces);
    let is_corner = |corner: &Vector<3>| {
        let is_inside = |plane: &HalfSpace| plane.normal.dot(corner) <= plane.offset + SLACK;
        corner.norm() <= radius + SLACK && planes.iter().all(is_inside)
    };
    let mut corners: Vec<f64> = corners(&planes, flats.len(), radius)
        .filter(is_corner)
        .chain(ends_of_edges(faces, radius))
        .map(|corner| (corner[2] / radius).clamp(-1.0, 1.0).asin())
        .collect();
    corners.sort_by(f64::total_cmp);
    corners.dedup_by(|a, b| (*a - *b).abs() < SAME);
    let kinks = corners.into_iter().map(|at| Breakpoint { at, is_root: false });
    let is_near =
        |point: &Vector<3>| planes.iter().all(|plane| plane.normal.dot(point) <= plane.offset + BESIDE);
    let roots = planes.iter().flat_map(|plane| ends_of_section(plane, radius));
    let roots = roots.filter(|(point, _)| is_near(point));
    kinks.chain(roots.map(|(_, at)| Breakpoint { at, is_root: true })).collect()
}

/// The points in which the edges of a cell along the height meet the sphere.
fn ends_of_edges(faces: &[HalfSpace; 4], radius: f64) -> impl Iterator<Item = Vector<3>> {
    let edges = (0..4).filter_map(move |k| common_line(&faces[k / 2], &faces[2 + k % 2]));
    let ends = move |(point, direction): (Vector<3>, Vector<3>)| {
        let half = (radius * radius - point.norm_squared()).sqrt();
        [-half, half].into_iter().filter(|half| half.is_finite()).map(move |s| point + direction * s)
    };
    edges.flat_map(ends)
}

/// The points in which one of the first `flat_count` planes and another meet the sphere or a third plane.
fn corners(planes: &[HalfSpace], flat_count: usize, radius: f64) -> impl Iterator<Item = Vector<3>> {
    let pairs = (0..flat_count).flat_map(move |i| (i + 1..planes.len()).map(move |j| (i, j)));
    let lines = pairs.filter_map(|(i, j)| Some((j, common_line(&planes[i], &planes[j])?)));
    lines.flat_map(move |(j, (point, direction))| {
        let half = (radius * radius - point.norm_squared()).sqrt();
        let on_sphere = [-half, half].map(|s| point + direction * s);
        let on_plane = planes[j + 1..].iter().map(move |plane| {
            let s = (plane.offset - plane.normal.dot(&point)) / plane.normal.dot(&direction);
            point + direction * s
        });
        on_sphere.into_iter().chain(on_plane)
    })
}

/// The line in which two planes meet: its point nearest to the centre and its direction.
fn common_line(a: &HalfSpace, b: &HalfSpace) -> Option<(Vector<3>, Vector<3>)> {
    let cross = a.normal.cross(&b.normal);
    let sin = cross.norm();
    let point = (b.normal.cross(&cross) * a.offset + cross.cross(&a.normal) * b.offset) / (sin * sin);
    (sin > PARALLEL).then(|| (point, cross / sin))
}

/// The highest and the lowest point of the circle in which a plane meets the sphere, and their angles.
fn ends_of_section(flat: &HalfSpace, radius: f64) -> impl Iterator<Item = (Vector<3>, f64)> {
    let level = flat.normal.xy().norm();
    let from_axis = level.atan2(flat.normal[2]);
    let half = (flat.offset / radius).acos();
    // Angles from the axis, which the edge may pass on its other side.
    let folded = (half + from_axis).min(2.0 * PI - half - from_axis);
    let middle = flat.normal * flat.offset;
    let up = (Vector::<3>::z() - flat.normal * flat.normal[2]) * (radius * half.sin() / level);
    [(middle + up, (half - from_axis).abs()), (middle - up, folded)]
        .into_iter()
        .map(|(point, angle)| (point, FRAC_PI_2 - angle))
        .filter(|(_, at)| !at.is_nan())
}
