//! Bodies cut flat by planes.
//!
//! Where two bodies are nearer than about a cell, the mesh does not resolve the film between them. Flattened
//! on both sides, they leave a slab that it does; what this takes from the resistance of the film is known
//! from lubrication theory.

use gluey_fem::cut::{BallInCell, FlatInCell};
use gluey_geom::Vector;
use gluey_linalg::Jagged;

/// A plane that cuts a body: what remains are the points with `n . (x - c) <= d`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flat<const D: usize> {
    /// Unit normal `n`, out of the body.
    pub normal: Vector<D>,
    /// Distance `d` of the plane from the centre of the body, negative if the centre is cut away.
    pub distance: f64,
}

impl<const D: usize> Flat<D> {
    /// The plane in the coordinates of a cell of this edge length and shear, in which its ball is `ball`.
    pub fn in_cell(&self, ball: &BallInCell<D>, edge: f64, shear: f64) -> FlatInCell<D> {
        let mut normal = self.normal;
        normal[1] += shear * normal[0];
        let center = Vector::<D>::from(ball.center);
        FlatInCell::new(normal.into(), self.distance / edge + normal.dot(&center))
    }
}

/// The flats of all bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Flats<const D: usize>(Jagged<Flat<D>>);

impl<const D: usize> Flats<D> {
    /// Bodies that no plane cuts.
    pub fn none(body_count: usize) -> Self {
        (0..body_count).map(|_| None).collect()
    }

    /// From pairs of a body and a flat of it.
    pub fn grouped(body_count: usize, flats: impl Iterator<Item = (usize, Flat<D>)> + Clone) -> Self {
        Self(Jagged::grouped(body_count, flats))
    }

    /// Those of a body.
    pub fn of(&self, body: usize) -> &[Flat<D>] {
        &self.0[body]
    }

    /// Number of bodies.
    pub fn body_count(&self) -> usize {
        self.0.len()
    }
}

impl<const D: usize, L: IntoIterator<Item = Flat<D>>> FromIterator<L> for Flats<D> {
    /// From the flats of each body.
    fn from_iter<I: IntoIterator<Item = L>>(bodies: I) -> Self {
        Self(bodies.into_iter().collect())
    }
}
