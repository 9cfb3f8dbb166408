//! Shape functions at the Gauss points of a cut cell, with gradients in space where cells are sheared.

use gluey_fem::cut::POINTS;
use gluey_fem::element::{gauss_cube, gradient, node_count, value};
use gluey_geom::Vector;

/// The functions of a cell at its points: value and gradient in space of velocities, value of pressures.
pub struct Shapes<const D: usize> {
    /// The points, in the unit cube.
    pub points: Vec<[f64; D]>,
    /// Of degree 2, per point and node.
    pub velocity: Vec<Vec<(f64, Vector<D>)>>,
    /// Of degree 1, per point and node.
    pub pressure: Vec<Vec<f64>>,
}

impl<const D: usize> Shapes<D> {
    /// Those of cells with this shear and edges of length one.
    pub fn new(shear: f64) -> Self {
        let points: Vec<[f64; D]> = gauss_cube::<D>(POINTS).into_iter().map(|point| point.0).collect();
        let of_velocity = |x: &[f64; D]| {
            (0..node_count::<D>(2)).map(|i| (value::<D>(2, i, x), slope(shear, i, x))).collect()
        };
        let of_pressure = |x: &[f64; D]| (0..node_count::<D>(1)).map(|i| value::<D>(1, i, x)).collect();
        Self {
            velocity: points.iter().map(of_velocity).collect(),
            pressure: points.iter().map(of_pressure).collect(),
            points,
        }
    }
}

/// Gradient in space of a velocity function at a point of the unit cube, in a cell with this shear and edges
/// of length one.
pub fn slope<const D: usize>(shear: f64, node: usize, x: &[f64; D]) -> Vector<D> {
    let mut slope = Vector::from(gradient::<D>(2, node, x));
    slope[1] -= shear * slope[0];
    slope
}
