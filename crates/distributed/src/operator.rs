//! The Stokes operator on shared vectors: velocities and pressures at the owned nodes.

use std::ops::Range;

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_linalg::LinOp;
use gluey_parallel::{Communicator, GhostPlan};

use crate::space::{LevelSpace, Nodes};

/// `(y, q) = (A u - B^T p, -B u)`.
pub struct StokesOperator<'a, const D: usize> {
    pub ranks: &'a dyn Communicator,
    pub space: LevelSpace<D>,
    pub plans: Plans,
    cells: CellOperator<f64, D>,
    work: Workspace<f64>,
    /// At all nodes of the part.
    u: Vec<f64>,
    p: Vec<f64>,
    y: Vec<f64>,
    q: Vec<f64>,
}

/// Ghosts of velocities and of pressures.
#[derive(Clone)]
pub struct Plans {
    pub velocity: GhostPlan,
    pub pressure: GhostPlan,
}

impl<'a, const D: usize> StokesOperator<'a, D> {
    pub fn new(ranks: &'a dyn Communicator, space: LevelSpace<D>, plans: Plans, viscosity: f64) -> Self {
        let (velocity, pressure) = (&space.velocity.map, &space.pressure.map);
        let cells = CellOperator::new(&space.chunks, velocity, space.cells(viscosity), 1, &[], 0);
        let [u, y] = [0, 1].map(|_| vec![0.0; velocity.node_count() * D]);
        let [p, q] = [0, 1].map(|_| vec![0.0; pressure.node_count()]);
        Self { ranks, plans, cells, work: Workspace::default(), u, p, y, q, space }
    }

    /// Entries of the owned velocities in a vector; those of the pressures follow.
    pub fn velocity_dim(&self) -> usize {
        self.space.velocity.owned.len() * D
    }

    /// `y = A (u, 0)` for velocities that `of` gives at all nodes of the part on the walls and that are zero
    /// elsewhere.
    pub fn apply_to_walls(&mut self, of: impl Fn(usize) -> [f64; D], y: &mut [f64]) {
        self.u.fill(0.0);
        self.p.fill(0.0);
        for (node, u) in self.u.as_chunks_mut::<D>().0.iter_mut().enumerate() {
            if self.space.velocity.map.is_on_boundary(node) {
                *u = of(node);
            }
        }
        self.apply_cells(y);
        self.u.fill(0.0);
    }

    /// Values at the owned nodes, with those of hanging ones and on the walls.
    pub fn nodal_values(&mut self, x: &[f64], walls: impl Fn(usize) -> [f64; D]) -> (Vec<f64>, Vec<f64>) {
        self.fill(x);
        let Nodes { map, owned, .. } = &*self.space.velocity;
        for (node, u) in self.u.as_chunks_mut::<D>().0.iter_mut().enumerate() {
            if map.is_on_boundary(node) {
                *u = walls(node);
            }
        }
        map.distribute(D, |w| w, &mut self.u);
        let velocity = self.u[owned.start * D..owned.end * D].to_vec();
        self.u.fill(0.0);
        (velocity, self.p[self.space.pressure.owned.clone()].to_vec())
    }

    /// Unknowns at all nodes of the part.
    fn fill(&mut self, x: &[f64]) {
        let (velocity, pressure) = (&self.space.velocity.owned, &self.space.pressure.owned);
        let (x, p) = x.split_at(velocity.len() * D);
        self.u[velocity.start * D..velocity.end * D].copy_from_slice(x);
        self.p[pressure.clone()].copy_from_slice(p);
        self.plans.velocity.update::<f64, D>(self.ranks, &mut self.u);
        self.plans.pressure.update::<f64, 1>(self.ranks, &mut self.p);
        self.space.pressure.map.distribute(1, |w| w, &mut self.p);
    }

    fn apply_cells(&mut self, out: &mut [f64]) {
        self.cells.stokes(&self.u, &self.p, &mut self.y, &mut self.q, &mut self.work);
        self.space.pressure.map.condense(1, |w| w, &mut self.q);
        self.plans.velocity.accumulate::<f64, D>(self.ranks, &mut self.y);
        self.plans.pressure.accumulate::<f64, 1>(self.ranks, &mut self.q);
        let owned =
            |nodes: &Nodes<D>, c: usize| -> Range<usize> { nodes.owned.start * c..nodes.owned.end * c };
        let (y, q) = out.split_at_mut(self.space.velocity.owned.len() * D);
        y.copy_from_slice(&self.y[owned(&self.space.velocity, D)]);
        q.copy_from_slice(&self.q[owned(&self.space.pressure, 1)]);
    }
}

impl<const D: usize> LinOp<f64> for StokesOperator<'_, D> {
    fn dim(&self) -> usize {
        self.velocity_dim() + self.space.pressure.owned.len()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.fill(x);
        self.apply_cells(y);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.ranks.sum(sums);
    }
}
