//! Rays through a ball that stand on the faces of the unit cube.
//!
//! A ray in direction `d` lies at `y = c + rho sin(theta)` in a plane in which the ball is a disc of radius
//! `rho`, and is inside the ball for `|x - c_d| <= rho cos(theta)`. In 3D the planes lie at
//! `z = c + a sin(phi)`, where `rho = a cos(phi)`. Moments of a cut change their form where a chord ends on a
//! face (`rho cos(theta)` is the distance of a face); how they depend on `phi` changes where a disc begins to
//! reach a face, like a square root, or an edge.

use super::corners::{self, HalfSpace};
use super::disc::{Disc, Ray};
use super::intervals::{Breakpoint, for_each_point};
use super::slice::Slice;

/// The rays through the disc of `slice` that lie in the unit interval.
pub fn for_each_ray(slice: &Slice, rule: &[(f64, f64)], mut visit: impl FnMut(Ray)) {
    let Disc { along, across, radius } = slice.disc;
    let faces = [0.0, 1.0].map(|face: f64| (face - along).abs());
    let mut breakpoints: Vec<Breakpoint> = Vec::with_capacity(5);
    for distance in faces.into_iter().filter(|&distance| distance < radius) {
        let angle = (distance / radius).acos();
        breakpoints.extend([-angle, angle].map(|at| Breakpoint { at, is_root: false }));
    }
    breakpoints.extend(slice.corners().into_iter().map(|at| Breakpoint { at, is_root: false }));
    for_each_point(angles(across, radius), &breakpoints, rule, |angle, weight| {
        let (sin, cos) = angle.sin_cos();
        visit(Ray { at: across + radius * sin, half: radius * cos, weight: weight * radius * cos });
    });
}

/// Calls `visit(disc, z, width)` for the planes across a ball of the given centre (along the rays, across
/// them, across the planes) and radius, cut by these flats.
pub fn for_each_plane(
    (center, radius): ([f64; 3], f64),
    flats: &[HalfSpace],
    rule: &[(f64, f64)],
    mut visit: impl FnMut(Disc, f64, f64),
) {
    let [along, across, height] = center;
    let distances = [along, across].map(|c| [0.0, 1.0].map(|face: f64| (face - c).abs()));
    let mut breakpoints = Vec::with_capacity(17);
    let mut push = |distance: f64, is_root: bool| {
        if distance < radius {
            let angle = (distance / radius).acos();
            breakpoints.extend([-angle, angle].map(|at| Breakpoint { at, is_root }));
        }
    };
    distances.iter().flatten().for_each(|&face| push(face, true));
    for x in distances[0] {
        distances[1].iter().for_each(|y| push(x.hypot(*y), false));
    }
    if !flats.is_empty() {
        breakpoints.extend(corners::breakpoints(center, radius, flats));
    }
    for_each_point(angles(height, radius), &breakpoints, rule, |angle, weight| {
        let (sin, cos) = angle.sin_cos();
        let disc = Disc { along, across, radius: radius * cos };
        visit(disc, height + radius * sin, weight * radius * cos);
    });
}

/// The angles at which a circle about `center` lies in the unit interval.
fn angles(center: f64, radius: f64) -> [f64; 2] {
    [0.0, 1.0].map(|face| ((face - center) / radius).clamp(-1.0, 1.0).asin())
}
