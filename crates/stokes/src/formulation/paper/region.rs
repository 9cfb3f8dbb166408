//! Where the penalised solid is on a mesh, and the rigid motion that fits a velocity field best in it.

use std::sync::Arc;

use gluey_fem::NodeMap;
use gluey_geom::{Twist, Vector, Wrench};
use gluey_levelset::{Ball, BallTree, Body, Ramp};

use super::moments::BodyMoments;
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

/// The solid on a mesh.
#[derive(Clone, Debug)]
pub struct SolidRegion<const D: usize> {
    pub(super) cells: Arc<Vec<SolidCell>>,
}

impl<const D: usize> SolidRegion<D> {
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
        let mut moments = vec![BodyMoments::<D>::new(); bodies.len()];
        self.for_each_point(discretisation, bodies, matrices, |point| {
            let mut u = Vector::<D>::zeros();
            for (&node, &shape) in point.nodes.iter().zip(point.shapes) {
                for d in 0..D {
                    u[d] += shape * velocity[node as usize * D + d];
                }
            }
            moments[point.body].add(point.weight, &point.arm, &u);
        });
        each_body(discretisation, bodies, |body| moments[body].twist())
    }

    /// Nodal loads of forces and torques on the bodies, each as a rigid field of force densities weighted
    /// with `I`: the transpose of [`SolidRegion::twists`]. Their sum and moment are exact, since shape
    /// functions reproduce rigid motions.
    ///
    /// # Errors
    /// As for [`SolidRegion::twists`].
    pub fn loads(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        matrices: &PointMatrices<D>,
        wrenches: &[Wrench<D>],
    ) -> Result<Vec<f64>, StokesError> {
        let mut moments = vec![BodyMoments::<D>::new(); bodies.len()];
        self.for_each_point(discretisation, bodies, matrices, |point| {
            moments[point.body].add(point.weight, &point.arm, &Vector::zeros());
        });
        let densities =
            each_body(discretisation, bodies, |body| moments[body].force_density(&wrenches[body]))?;
        let mut loads = vec![0.0; discretisation.velocity.node_count() * D];
        self.for_each_point(discretisation, bodies, matrices, |point| {
            let force = densities[point.body].velocity_at(&point.arm) * point.weight;
            for (&node, &shape) in point.nodes.iter().zip(point.shapes) {
                for d in 0..D {
                    loads[node as usize * D + d] += shape * force[d];
                }
            }
        });
        Ok(loads)
    }

    /// Visits the quadrature points with any solid.
    fn for_each_point(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        matrices: &PointMatrices<D>,
        mut visit: impl FnMut(&SolidPoint<'_, D>),
    ) {
        let tree = BallTree::new(bodies);
        for solid in self.cells.iter() {
            let cell = solid.cell as usize;
            let c = &discretisation.mesh.cells()[cell];
            let (lower, h) = (discretisation.mesh.lower_corner(c), discretisation.cell_size(cell));
            let nodes = discretisation.velocity.cell(cell);
            let solid_points = matrices.points().enumerate().filter(|(q, _)| solid.fraction(*q) > 0.0);
            for (q, (x, weight, shapes)) in solid_points {
                let position = lower + Vector::from_fn(|d, _| h * x[d]);
                let Some((body, _)) = tree.nearest(&position) else { continue };
                let weight = weight * h.powi(D as i32) * solid.fraction(q);
                visit(&SolidPoint { body, weight, arm: bodies[body].arm(&position), nodes, shapes });
            }
        }
    }
}

/// A quadrature point in the solid.
struct SolidPoint<'a, const D: usize> {
    /// The nearest body.
    body: usize,
    /// Volume times solid fraction.
    weight: f64,
    /// From the body's reference point.
    arm: Vector<D>,
    /// Nodes of the cell, and their shape functions here.
    nodes: &'a [u32],
    shapes: &'a [f64],
}

/// A rigid motion for each body.
///
/// # Errors
/// [`StokesError::NoSolid`] for a body that has none.
fn each_body<const D: usize>(
    discretisation: &Discretisation<D>,
    bodies: &[Ball<D>],
    motion: impl Fn(usize) -> Option<Twist<D>>,
) -> Result<Vec<Twist<D>>, StokesError> {
    let cell_size = discretisation.finest_cell_size();
    let of_body = |body: usize| {
        let radius = bodies[body].bounding_radius();
        motion(body).ok_or(StokesError::NoSolid { body, radius, cell_size })
    };
    (0..bodies.len()).map(of_body).collect()
}
