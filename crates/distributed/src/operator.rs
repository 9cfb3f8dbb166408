//! The Stokes operator on shared vectors: velocities at the owned nodes, owned twists, pressures at the owned
//! nodes.
//!
//! Pressures are in units of `eta / h` with the size `h` of the smallest cells, and so are the rows of
//! divergences: those that a velocity leaves count like the forces it leaves. In plain units the norm of a
//! residual forgives divergences, by a factor of `h / eta`, and velocities are less exact than it says.

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_linalg::LinOp;
use gluey_parallel::{Communicator, GhostPlan};

use crate::bodies::rigid;
use crate::pressures::SharedPressures;
use crate::space::{LevelSpace, Plans};

/// `(y, q) = (A u - B^T p, -B u)`.
pub struct StokesOperator<'a, const D: usize> {
    pub ranks: &'a dyn Communicator,
    pub space: LevelSpace<D>,
    pub pressures: SharedPressures,
    /// Unit of the pressures.
    pub unit: f64,
    plan: GhostPlan,
    twists: GhostPlan,
    cells: CellOperator<f64, D>,
    work: Workspace<f64>,
    /// Velocities, twists and pressures at all nodes of the part, in one vector.
    x: Vec<f64>,
    y: Vec<f64>,
}

impl<'a, const D: usize> StokesOperator<'a, D> {
    pub fn new(
        ranks: &'a dyn Communicator,
        space: LevelSpace<D>,
        plans: &Plans,
        pressures: SharedPressures,
        viscosity: f64,
    ) -> Self {
        let plan = GhostPlan::joined(&[
            (&plans.nodes, D, 0),
            (&space.bodies.plan, rigid::<D>(), space.nodal_dim()),
            (&pressures.plan, 1, space.dim()),
        ]);
        let cells = space.operator(viscosity);
        let [x, y] = [0, 1].map(|_| vec![0.0; space.dim() + pressures.dim()]);
        let (twists, work) = (plans.twists.clone(), Workspace::default());
        let mesh = &space.part.mesh;
        let unit = viscosity / mesh.size(mesh.max_level());
        Self { ranks, unit, plan, twists, cells, work, x, y, space, pressures }
    }

    /// Entries of the owned velocities and twists in a vector; those of the pressures follow.
    pub fn velocity_dim(&self) -> usize {
        self.space.owned_dim()
    }

    /// The field closest to what `of` gives at the nodes that fulfils all constraints and has these values on
    /// the walls: velocities at all nodes of the part, then twists.
    pub fn lift(&mut self, of: impl Fn(usize) -> [f64; D]) -> Vec<f64> {
        let (map, bodies) = (&self.space.velocity.map, &self.space.bodies);
        let nodal = self.space.nodal_dim();
        let mut lift: Vec<f64> = (0..map.node_count()).flat_map(of).collect();
        let mut owned = vec![0.0; lift.len() + bodies.dim()];
        owned[self.owned_nodes()].copy_from_slice(&lift[self.owned_nodes()]);
        let (of_nodes, twists) = owned.split_at_mut(nodal);
        bodies.reduce(of_nodes, twists);
        self.twists.accumulate::<f64, 1>(self.ranks, &mut owned);
        bodies.fit(&mut owned[nodal..][..bodies.owned_dim()]);
        self.twists.update::<f64, 1>(self.ranks, &mut owned);
        lift.extend_from_slice(&owned[nodal..]);
        let (of_nodes, twists) = lift.split_at_mut(nodal);
        bodies.expand(of_nodes, twists);
        map.distribute(D, |w| w, of_nodes);
        lift
    }

    /// `b -= A (u, 0)` for a field that [`StokesOperator::lift`] gave.
    pub fn subtract_lift(&mut self, lift: &[f64], b: &mut [f64]) {
        let mut y = vec![0.0; b.len()];
        let at_rest = vec![0.0; self.pressures.dim()];
        let (velocity, pressure) = self.y.split_at_mut(self.space.dim());
        let nodes = self.space.pressure.map.node_count();
        self.cells.stokes_of_field(lift, &at_rest[..nodes], velocity, &mut pressure[..nodes], &mut self.work);
        self.gather(&mut y);
        b.iter_mut().zip(y).for_each(|(b, y)| *b -= y);
    }

    /// Values of `lift + T x` at the owned nodes and of all own twists, and the pressures.
    pub fn nodal_values(&mut self, lift: &[f64], x: &[f64]) -> [Vec<f64>; 3] {
        self.fill(x);
        let (velocity, p) = self.x.split_at_mut(self.space.dim());
        let (nodal, twists) = velocity.split_at_mut(self.space.nodal_dim());
        self.space.bodies.expand(nodal, twists);
        self.space.velocity.map.distribute(D, |w| w, nodal);
        velocity.iter_mut().zip(lift).for_each(|(u, lift)| *u += lift);
        let mut owned = vec![0.0; self.space.owned_dim()];
        self.space.copy_owned(velocity, &mut owned);
        let twists = owned.split_off(self.space.owned_nodal_dim());
        let pressure = p[self.space.pressure.owned.clone()].to_vec();
        self.x.fill(0.0);
        [owned, twists, pressure]
    }

    fn owned_nodes(&self) -> std::ops::Range<usize> {
        let owned = &self.space.velocity.owned;
        owned.start * D..owned.end * D
    }

    /// Unknowns at all nodes of the part.
    fn fill(&mut self, x: &[f64]) {
        let (u, p) = x.split_at(self.space.owned_dim());
        let first = self.space.dim();
        self.space.set_owned(u, &mut self.x);
        let owned = &self.space.pressure.owned;
        let own = self.x[first + owned.start..first + owned.end].iter_mut();
        own.zip(p).for_each(|(own, p)| *own = self.unit * p);
        self.plan.update::<f64, 1>(self.ranks, &mut self.x);
        let pressure = &mut self.x[first..];
        self.pressures.expand(pressure);
        self.space.pressure.map.distribute(1, |w| w, pressure);
    }

    /// What cells gave, added up at the owners.
    fn gather(&mut self, out: &mut [f64]) {
        let first = self.space.dim();
        let pressure = &mut self.y[first..];
        self.space.pressure.map.condense(1, |w| w, pressure);
        self.pressures.reduce(pressure);
        self.plan.accumulate::<f64, 1>(self.ranks, &mut self.y);
        let (y, q) = out.split_at_mut(self.space.owned_dim());
        self.space.copy_owned(&self.y, y);
        let owned = &self.space.pressure.owned;
        let own = &self.y[first + owned.start..first + owned.end];
        q.iter_mut().zip(own).for_each(|(q, own)| *q = self.unit * own);
        if self.pressures.has_bridges {
            self.pressures.remove_mean(self.ranks, q);
        }
    }
}

impl<const D: usize> LinOp<f64> for StokesOperator<'_, D> {
    fn dim(&self) -> usize {
        self.velocity_dim() + self.space.pressure.owned.len()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.fill(x);
        let nodes = self.space.pressure.map.node_count();
        let (u, p) = self.x.split_at(self.space.dim());
        let (yu, yp) = self.y.split_at_mut(self.space.dim());
        self.cells.stokes(u, &p[..nodes], yu, &mut yp[..nodes], &mut self.work);
        self.gather(y);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.ranks.sum(sums);
    }
}
