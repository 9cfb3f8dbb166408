//! Where the penalised solid is on a mesh, and the rigid motion that fits a velocity field best in it.

use std::sync::Arc;

use gluey_fem::NodeMap;
use gluey_geom::{Dim, Space, Twist, Vector};
use gluey_levelset::{Ball, BallTree, Body, Ramp};

use super::moments::Moments;
use super::quadrature::PointMatrices;
use crate::error::StokesError;
use crate::space::Discretisation;

/// Solid fraction `I` in a cell, and the body it belongs to.
#[derive(Clone, Debug)]
pub(super) struct SolidCell {
    pub cell: u32,
    pub body: u32,
    /// At the quadrature points; empty for a cell wholly inside.
    pub fraction: Vec<f64>,
}

impl SolidCell {
    /// At a quadrature point.
    pub fn fraction(&self, point: usize) -> f64 {
        self.fraction.get(point).map_or(1.0, |&f| f)
    }
}

/// Where the solid is on a mesh.
#[derive(Clone, Debug)]
pub struct SolidRegion<const D: usize> {
    pub(super) cells: Arc<Vec<SolidCell>>,
}

impl<const D: usize> SolidRegion<D>
where
    Dim<D>: Space<D>,
{
    /// Evaluates the solid fraction at the quadrature points of all cells near the bodies.
    pub fn new(
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        ramp: Ramp,
        matrices: &PointMatrices<D>,
    ) -> Self {
        let bodies = BallTree::new(bodies);
        let mut cells = Vec::new();
        for (cell, c) in discretisation.mesh.cells().iter().enumerate() {
            let (lower, h) = (discretisation.mesh.lower_corner(c), discretisation.cell_size(cell));
            let center = lower + Vector::repeat(0.5 * h);
            let reach = 0.5 * h * (D as f64).sqrt();
            let Some((body, _)) = bodies.nearest_within(&center, reach) else { continue };
            let at = |x: &[f64; D]| {
                let x = lower + Vector::from_fn(|d, _| h * x[d]);
                bodies.nearest_within(&x, 0.0).map_or(0.0, |b| ramp.fraction(b.1))
            };
            let mut fraction: Vec<f64> = matrices.points().map(|p| at(p.0)).collect();
            if fraction.iter().any(|&f| f > 0.0) {
                if fraction.iter().all(|&f| f == 1.0) {
                    fraction = Vec::new();
                }
                cells.push(SolidCell { cell: cell as u32, body: body as u32, fraction });
            }
        }
        Self { cells: Arc::new(cells) }
    }

    /// Whether each of `count` bodies has any cell.
    pub fn held(&self, count: usize) -> Vec<bool> {
        let mut held = vec![false; count];
        self.cells.iter().for_each(|c| held[c.body as usize] = true);
        held
    }

    /// The nodes of all cells with any solid in them, each with the body nearest to it.
    pub fn touched_nodes(&self, nodes: &NodeMap<D>, bodies: &[Ball<D>]) -> Vec<Option<u32>> {
        let bodies = BallTree::new(bodies);
        let mut touched = vec![None; nodes.node_count()];
        for solid in self.cells.iter() {
            for &node in nodes.cell(solid.cell as usize) {
                let body = bodies.nearest(&nodes.point(node as usize)).map(|b| b.0 as u32);
                touched[node as usize] = body;
            }
        }
        touched
    }

    /// The rigid motions closest to a velocity field in the `I`-weighted mean: `U = int I u / int I` and the
    /// spin from the angular momentum, `int I r x u = J w` with `J` the `I`-weighted inertia.
    ///
    /// # Errors
    /// [`StokesError::NoSolid`] for a body that is the nearest at no quadrature point of the solid, or at too
    /// few of them.
    pub fn twists(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        matrices: &PointMatrices<D>,
        velocity: &[f64],
    ) -> Result<Vec<Twist<D>>, StokesError> {
        let mut moments = vec![Moments::<D>::new(); bodies.len()];
        let tree = BallTree::new(bodies);
        for solid in self.cells.iter() {
            let cell = solid.cell as usize;
            let c = &discretisation.mesh.cells()[cell];
            let (lower, h) = (discretisation.mesh.lower_corner(c), discretisation.cell_size(cell));
            let nodes = discretisation.velocity.cell(cell);
            let solid_points = matrices.points().enumerate().filter(|(q, _)| solid.fraction(*q) > 0.0);
            for (q, (x, weight, shapes)) in solid_points {
                let mut u = Vector::<D>::zeros();
                for (&node, &shape) in nodes.iter().zip(shapes) {
                    for d in 0..D {
                        u[d] += shape * velocity[node as usize * D + d];
                    }
                }
                let position = lower + Vector::from_fn(|d, _| h * x[d]);
                let Some((body, _)) = tree.nearest(&position) else { continue };
                let weight = weight * h.powi(D as i32) * solid.fraction(q);
                moments[body].add(weight, &bodies[body].arm(&position), &u);
            }
        }
        let cell_size = discretisation.finest_cell_size();
        let twist = |(body, moments): (usize, &Moments<D>)| {
            let radius = bodies[body].bounding_radius();
            moments.twist().ok_or(StokesError::NoSolid { body, radius, cell_size })
        };
        moments.iter().enumerate().map(twist).collect()
    }
}
