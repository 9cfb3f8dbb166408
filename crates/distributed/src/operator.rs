//! The Stokes operator on shared vectors: velocities at the owned nodes, owned twists, pressures at the owned
//! nodes.
//!
//! Units are those of the serial solver, so that a tolerance means the same on any number of ranks.

use gluey_fem::cells::{CellOperator, CellScalar, Workspace};
use gluey_linalg::{LinOp, Scalar};
use gluey_parallel::{Communicator, GhostPlan, Number};

use crate::bodies::rigid;
use crate::pressures::SharedPressures;
use crate::space::{LevelSpace, Plans};

/// `(y, q) = (A u - B^T p, -B u)`.
pub struct StokesOperator<'a, const D: usize> {
    pub ranks: &'a dyn Communicator,
    pub space: LevelSpace<D>,
    pub pressures: SharedPressures,
    twists: GhostPlan,
    wide: Kernel<f64, D>,
    /// For steps in single precision.
    narrow: Kernel<f32, D>,
}

/// The operator in one precision.
struct Kernel<T, const D: usize> {
    plan: GhostPlan,
    cells: CellOperator<T, D>,
    work: Workspace<T>,
    /// Velocities, twists and pressures at all nodes of the part, in one vector.
    x: Vec<T>,
    y: Vec<T>,
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
        let dim = space.dim() + pressures.dim();
        let wide = Kernel::new(plan.clone(), space.operator(viscosity), dim);
        let narrow = Kernel::new(plan, space.operator(viscosity), dim);
        Self { ranks, twists: plans.twists.clone(), space, pressures, wide, narrow }
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
        let Self { ranks, space, pressures, wide, .. } = self;
        let mut y = vec![0.0; b.len()];
        let at_rest = vec![0.0; pressures.dim()];
        let (velocity, pressure) = wide.y.split_at_mut(space.dim());
        let nodes = space.pressure.map.node_count();
        wide.cells.stokes_of_field(lift, &at_rest[..nodes], velocity, &mut pressure[..nodes], &mut wide.work);
        wide.gather(*ranks, space, pressures, &mut y);
        b.iter_mut().zip(y).for_each(|(b, y)| *b -= y);
    }

    /// Values of `lift + T x` at all nodes of the part, right at those of own cells, all own twists, and the
    /// pressures, as the velocities.
    pub fn nodal_values(&mut self, lift: &[f64], x: &[f64]) -> [Vec<f64>; 3] {
        let Self { ranks, space, pressures, wide, .. } = self;
        wide.fill(*ranks, space, pressures, x);
        let (velocity, p) = wide.x.split_at_mut(space.dim());
        let (nodal, twists) = velocity.split_at_mut(space.nodal_dim());
        space.bodies.expand(nodal, twists);
        space.velocity.map.distribute(D, |w| w, nodal);
        velocity.iter_mut().zip(lift).for_each(|(u, lift)| *u += lift);
        let (nodal, twists) = velocity.split_at(space.nodal_dim());
        let twists = twists[..space.bodies.owned_dim()].to_vec();
        let values = [nodal.to_vec(), twists, p[..space.pressure.map.node_count()].to_vec()];
        wide.x.fill(0.0);
        values
    }

    fn owned_nodes(&self) -> std::ops::Range<usize> {
        let owned = &self.space.velocity.owned;
        owned.start * D..owned.end * D
    }

    fn dim(&self) -> usize {
        self.velocity_dim() + self.space.pressure.owned.len()
    }
}

impl<T: CellScalar + Scalar + Number, const D: usize> Kernel<T, D> {
    fn new(plan: GhostPlan, cells: CellOperator<T, D>, dim: usize) -> Self {
        let [x, y] = [0, 1].map(|_| vec![T::ZERO; dim]);
        Self { plan, cells, work: Workspace::default(), x, y }
    }

    fn apply(
        &mut self,
        ranks: &dyn Communicator,
        space: &LevelSpace<D>,
        pressures: &SharedPressures,
        x: &[T],
        y: &mut [T],
    ) {
        self.fill(ranks, space, pressures, x);
        let nodes = space.pressure.map.node_count();
        let (u, p) = self.x.split_at(space.dim());
        let (yu, yp) = self.y.split_at_mut(space.dim());
        self.cells.stokes(u, &p[..nodes], yu, &mut yp[..nodes], &mut self.work);
        self.gather(ranks, space, pressures, y);
    }

    /// Unknowns at all nodes of the part.
    fn fill(
        &mut self,
        ranks: &dyn Communicator,
        space: &LevelSpace<D>,
        pressures: &SharedPressures,
        x: &[T],
    ) {
        let (u, p) = x.split_at(space.owned_dim());
        let first = space.dim();
        space.set_owned(u, &mut self.x);
        let owned = &space.pressure.owned;
        self.x[first + owned.start..first + owned.end].copy_from_slice(p);
        self.plan.update::<T, 1>(ranks, &mut self.x);
        let pressure = &mut self.x[first..];
        pressures.expand(pressure);
        space.pressure.map.distribute(1, T::from_f64, pressure);
    }

    /// What cells gave, added up at the owners.
    fn gather(
        &mut self,
        ranks: &dyn Communicator,
        space: &LevelSpace<D>,
        pressures: &SharedPressures,
        out: &mut [T],
    ) {
        let first = space.dim();
        let pressure = &mut self.y[first..];
        space.pressure.map.condense(1, T::from_f64, pressure);
        pressures.reduce(pressure);
        self.plan.accumulate::<T, 1>(ranks, &mut self.y);
        let (y, q) = out.split_at_mut(space.owned_dim());
        space.copy_owned(&self.y, y);
        let owned = &space.pressure.owned;
        q.copy_from_slice(&self.y[first + owned.start..first + owned.end]);
        if pressures.has_bridges {
            pressures.remove_mean(ranks, q);
        }
    }
}

impl<const D: usize> LinOp<f64> for StokesOperator<'_, D> {
    fn dim(&self) -> usize {
        self.dim()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.wide.apply(self.ranks, &self.space, &self.pressures, x, y);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.ranks.sum(sums);
    }
}

impl<const D: usize> LinOp<f32> for StokesOperator<'_, D> {
    fn dim(&self) -> usize {
        self.dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.narrow.apply(self.ranks, &self.space, &self.pressures, x, y);
    }

    fn complete(&self, sums: &mut [f64]) {
        self.ranks.sum(sums);
    }
}
