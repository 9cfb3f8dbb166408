//! Rays through a ball along the edges of the unit cube.
//!
//! A ray lies at `y = c + rho sin(theta)` in a plane in which the ball is a disc of radius
//! `rho`, and is inside the ball for `|x - c_d| <= rho
//! cos(theta)`; in a sheared cell the disc is an ellipse, see [`super::frame`]. In 3D the planes lie at
//! `z = c + a sin(phi)`, where `rho = a cos(phi)`. Moments of a cut change their form where a chord ends on a
//! face; how they depend on `phi` changes where a disc begins to reach a face, like a square root, or an
//! edge.

use super::ball::BallInCell;
use super::corners::{self, HalfSpace};
use super::disc::Disc;
use super::frame::SectionFrame;
use super::intervals::{Breakpoint, Interval, Intervals};
use super::slice::Slice;

/// The parts of the angle of the rays through the disc of `slice` that lie in the unit interval, on each of
/// which chords are analytic.
pub fn parts_of_rays<'a>(slice: &Slice, parts: &'a mut Intervals) -> &'a [Interval] {
    let disc = &slice.disc;
    let corners = slice.ends_on_faces().chain(slice.corners());
    let kinks = corners.map(|at| Breakpoint { at, is_root: false });
    parts.split(angles(disc.across, disc.radius * disc.widths[1]), kinks)
}

/// Calls `visit(disc, z, width)` for the planes of rays across a ball, cut by these flats.
pub fn for_each_plane(
    ball: &BallInCell<3>,
    frame: &SectionFrame,
    flats: &[HalfSpace],
    rule: &[(f64, f64)],
    parts: &mut Intervals,
    mut visit: impl FnMut(Disc, f64, f64),
) {
    let radius = ball.radius;
    let breakpoints = corners::breakpoints(radius, flats, &frame.faces(ball));
    let range = [0.0, 1.0].map(|face| (frame.height(ball, face) / radius).clamp(-1.0, 1.0).asin());
    parts.for_each_point(range, breakpoints.into_iter(), rule, |angle, weight| {
        let (sin, cos) = angle.sin_cos();
        let (disc, z) = frame.section(ball, radius * sin);
        // Better rounded than the root of a difference.
        let disc = Disc { radius: radius * cos, ..disc };
        visit(disc, z, frame.width(weight * radius * cos));
    });
}

/// The angles at which a circle about `center` lies in the unit interval.
fn angles(center: f64, radius: f64) -> [f64; 2] {
    [0.0, 1.0].map(|face| ((face - center) / radius).clamp(-1.0, 1.0).asin())
}
