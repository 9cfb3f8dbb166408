//! The flow in the cells of one rank, for output.

use std::sync::Arc;

use gluey_fem::element::value;
use gluey_fem::{Part, points_of_cells};
use gluey_geom::Vector;
use gluey_levelset::{Ball, BallTree};
use gluey_linalg::vector;
use gluey_motion::Fields;

use crate::space::{LevelSpace, Nodes};

/// What a rank knows of the flow at the nodes of its own cells, whoever owns these.
#[derive(Clone, Debug)]
pub struct LocalFields<const D: usize> {
    part: Arc<Part<D>>,
    velocity_nodes: Arc<Nodes<D>>,
    pressure_nodes: Arc<Nodes<D>>,
    viscosity: f64,
    /// At all nodes of the part; right at those of own cells.
    velocity: Vec<f64>,
    pressure: Vec<f64>,
}

impl<const D: usize> LocalFields<D> {
    pub fn new(space: &LevelSpace<D>, viscosity: f64, velocity: Vec<f64>, pressure: Vec<f64>) -> Self {
        Self {
            part: space.part.clone(),
            velocity_nodes: space.velocity.clone(),
            pressure_nodes: space.pressure.clone(),
            viscosity,
            velocity,
            pressure,
        }
    }

    /// Adds a multiple of another flow in the same cells.
    pub fn add(&mut self, factor: f64, other: &Self) {
        vector::axpy(factor, &other.velocity, &mut self.velocity);
        vector::axpy(factor, &other.pressure, &mut self.pressure);
    }

    /// Of the box.
    pub fn shear(&self) -> f64 {
        self.part.mesh.shear()
    }

    /// The same numbers as one process gives at the same places.
    pub fn fields(&self, balls: &[Ball<D>]) -> Fields<D> {
        let balls = BallTree::new(balls);
        let (mesh, pressures) = (&self.part.mesh, &self.pressure_nodes.map);
        let (points, cells) = points_of_cells(mesh, &self.velocity_nodes.map, self.part.own());
        let mut fields = Fields { cells, ..Fields::default() };
        for point in &points {
            let corners = pressures.cell(point.cell).iter().enumerate();
            let term = |(q, &n): (usize, &u32)| value::<D>(1, q, &point.local) * self.pressure[n as usize];
            fields.points.push(point.x);
            fields.velocity.push(Vector::from_fn(|d, _| self.velocity[point.node * D + d]));
            fields.pressure.push(corners.map(term).sum());
            fields.level_set.push(balls.nearest(&point.x).map_or(f64::NEG_INFINITY, |nearest| nearest.1));
        }
        fields.viscosity = vec![self.viscosity; points.len()];
        fields.multiplier = vec![Vector::zeros(); points.len()];
        fields
    }
}
