//! The viscosity of levels whose cells are too large for the bodies.
//!
//! The fluid between many bodies flows, on the scale of cells that are larger than they are, like one of the
//! viscosity of the suspension. A level that does not know corrects by too much: by a factor of seven at a
//! fraction of 0.45.

use gluey_geom::ball_volume;
use gluey_levelset::{Ball, Body};

use crate::space::Discretisation;

/// Logarithm of the viscosity of a level over the fraction of its volume that bodies are. Suspensions have
/// 2.7 at 0.1 to 4.3 at 0.45 (Krieger and Dougherty 1959, `(1 - fraction / 0.64)^-1.6`); with more than 3
/// motions of single cells, which the levels correct too, take longer.
const PER_FRACTION: f64 = 3.0;
/// Radii in cells: from the first on a level resolves a body, below the second not at all.
const RESOLVED: [f64; 2] = [1.7, 0.6];

/// The viscosity of a level over that of the fluid, where these are all bodies of the box and some of them
/// may be `held`: fluid flows through them as through a porous medium.
pub fn relative_viscosity<const D: usize>(
    level: &Discretisation<D>,
    bodies: &[Ball<D>],
    held: &[bool],
) -> f64 {
    let cell = level.finest_cell_size();
    let unresolved = |body: &Ball<D>| {
        let radius = body.bounding_radius();
        let share = (RESOLVED[0] - radius / cell) / (RESOLVED[0] - RESOLVED[1]);
        share.clamp(0.0, 1.0) * ball_volume::<D>(radius)
    };
    let is_free = |(body, _): &(usize, _)| held.get(*body) != Some(&true);
    let free = bodies.iter().enumerate().filter(is_free);
    let volume: f64 = free.map(|(_, body)| unresolved(body)).sum();
    (PER_FRACTION * volume / level.mesh.domain().extent().product()).exp()
}
