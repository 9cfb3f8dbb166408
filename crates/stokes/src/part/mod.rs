//! What a part of a mesh has to hold for `unfitted`.
//!
//! A part is a [`crate::Discretisation::of_part`]: own cells, which are added up here, and others around
//! them. What follows from places alone is found without a message: which cells are cut, aggregates,
//! penalties, the blocks of the smoother. For that the part has to reach as far around its own surfaces as
//! [`rings_around_surfaces`] says. Vectors are those of [`crate::StokesSystem`] at all nodes of the part;
//! products of its operator are the sums over the own cells, and sums of these over all parts are right at
//! every node.

mod levels;

use gluey_geom::Aabb;
use gluey_levelset::Ball;

use crate::film::{Film, FilmCoupling, Lubrication, thin_films};

pub use crate::space::owner_of_point;
pub use levels::{GhostLayer, LevelSizes, levels, sizes};

/// Cells around own ones, without films, in 2D and in 3D. Cut cells depend on four: nodes of a bad cell, its
/// root up to two cells away, and what else that root carries. Weights of the pressures at surfaces take in
/// more cells; with four rings in 2D clusters of discs take up to six iterations more than one process.
const RINGS: [usize; 2] = [6, 4];

/// How many rings of cells around its own a part needs near surfaces, for cells of this size: for the roots
/// of bad cells, and for what flows through the films between these bodies that are `wanted`.
pub fn rings_around_surfaces<const D: usize>(
    lubrication: Lubrication,
    bodies: &[Ball<D>],
    domain: &Aabb<D>,
    cell_size: f64,
    wanted: &dyn Fn(&Film<D>) -> bool,
) -> usize {
    if lubrication == Lubrication::None {
        return RINGS[D - 2];
    }
    let heights = lubrication.heights::<D>(cell_size);
    let films = thin_films(bodies, domain, &heights);
    let edge = |film: &Film<D>| film.shape(film.height(&heights)).edge();
    let widest = films.iter().filter(|film| wanted(film)).map(edge).fold(0.0, f64::max);
    RINGS[D - 2] + (widest / cell_size).ceil() as usize
}

/// Numbers that `NodalFields::films` has for a film: a body, its partner (negative for walls), and vectors.
pub fn numbers_of_film<const D: usize>() -> usize {
    FilmCoupling::<D>::KEPT
}

#[cfg(test)]
mod tests;
