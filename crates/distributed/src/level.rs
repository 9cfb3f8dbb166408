//! One level of the multigrid on the velocities, in `f32`: the viscous operator on shared vectors, and the
//! smoother.

use gluey_fem::cells::{CellOperator, Workspace};
use gluey_fem::{ImplicitTree, ReferenceMatrices};
use gluey_linalg::{BadDiagonal, Chebyshev, Guess, LinOp, invert_spd};
use gluey_parallel::{GhostPlan, Ranks};
use gluey_stokes::part::{BlockDiagonal, LEVEL_SWEEP, cell_lambda_max};

use crate::agreement::agreed;
use crate::bodies::{Shared, rigid, rows};
use crate::flow::{FlowError, PartError};
use crate::near_bodies::NearBodies;
use crate::space::{LevelSpace, Plans};

/// The viscous operator on the owned nodes and twists.
pub struct LevelOperator<'a, const D: usize> {
    pub ranks: &'a Ranks,
    pub space: LevelSpace<D>,
    pub plans: Plans,
    pub cells: CellOperator<f32, D>,
    pub work: Workspace<f32>,
    /// Velocities at all nodes of the part, then twists.
    pub x: Vec<f32>,
    pub y: Vec<f32>,
}

impl<const D: usize> LevelOperator<'_, D> {
    /// Sends what own cells gave to other ranks' nodes and bodies in `y`, and copies the rest.
    pub fn gather(&mut self, y: &mut [f32]) {
        self.plans.all.accumulate::<f32, 1>(self.ranks, &mut self.y);
        self.space.copy_owned(&self.y, y);
    }

    /// Fills `x` from the owned entries and those of other ranks.
    pub fn scatter(&mut self, x: &[f32]) {
        self.space.set_owned(x, &mut self.x);
        self.plans.all.update::<f32, 1>(self.ranks, &mut self.x);
    }

    /// Values at hanging and rigid nodes in `x`.
    pub fn expand(&mut self) {
        let (nodal, twists) = self.x.split_at_mut(self.space.nodal_dim());
        self.space.bodies.expand(nodal, twists);
        self.space.velocity.map.distribute(D, |w| w as f32, nodal);
    }

    /// The transpose: loads in `y` on unknowns alone.
    pub fn reduce(&mut self) {
        let (nodal, twists) = self.y.split_at_mut(self.space.nodal_dim());
        let map = &self.space.velocity.map;
        map.condense(D, |w| w as f32, nodal);
        self.space.bodies.reduce(nodal, twists);
        for (node, load) in nodal.chunks_exact_mut(D).enumerate() {
            if map.is_on_boundary(node) {
                load.fill(0.0);
            }
        }
    }

    /// Loads `b` on the owned unknowns as loads on the owned nodes: those on twists spread over the nodes of
    /// the body.
    pub fn spread(&mut self, b: &[f32], nodal: &mut [f32]) {
        let (loads, twists) = b.split_at(nodal.len());
        nodal.copy_from_slice(loads);
        if !self.has_bodies() {
            return;
        }
        let (bodies, first) = (&self.space.bodies, self.space.nodal_dim());
        let own = &mut self.x[first..][..twists.len()];
        own.copy_from_slice(twists);
        bodies.fit(own);
        self.plans.twists.update::<f32, 1>(self.ranks, &mut self.x);
        let (of_nodes, twists) = self.x.split_at_mut(first);
        bodies.expand(of_nodes, twists);
        let owned = &self.space.velocity.owned;
        for rigid in bodies.nodes.iter().filter(|rigid| owned.contains(&(rigid.node as usize))) {
            let at = rigid.node as usize;
            nodal[(at - owned.start) * D..][..D].copy_from_slice(&of_nodes[at * D..][..D]);
        }
    }

    /// Velocities of the owned nodes, those of bodies replaced by the motions that are closest to them, as
    /// owned unknowns `z`, which begin with the former.
    pub fn project(&mut self, z: &mut [f32]) {
        if !self.has_bodies() {
            return z[self.space.owned_nodal_dim()..].fill(0.0);
        }
        let (bodies, first) = (&self.space.bodies, self.space.nodal_dim());
        let (nodal, twists) = z.split_at_mut(self.space.owned_nodal_dim());
        self.y.fill(0.0);
        let owned = &self.space.velocity.owned;
        self.y[owned.start * D..owned.end * D].copy_from_slice(nodal);
        let (of_nodes, sums) = self.y.split_at_mut(first);
        bodies.reduce(of_nodes, sums);
        nodal.copy_from_slice(&of_nodes[owned.start * D..owned.end * D]);
        self.plans.twists.accumulate::<f32, 1>(self.ranks, &mut self.y);
        twists.copy_from_slice(&self.y[first..][..twists.len()]);
        bodies.fit(twists);
    }
}

impl<const D: usize> LevelOperator<'_, D> {
    /// Whether there are rigid nodes here, or elsewhere of bodies owned here.
    fn has_bodies(&self) -> bool {
        self.space.bodies.plan.neighbour_count() > 0 || !self.space.bodies.nodes.is_empty()
    }
}

impl<const D: usize> LinOp<f32> for LevelOperator<'_, D> {
    fn dim(&self) -> usize {
        self.space.owned_dim()
    }

    fn apply(&mut self, x: &[f32], y: &mut [f32]) {
        self.scatter(x);
        self.cells.viscous(&self.x, &mut self.y, &mut self.work);
        self.gather(y);
    }
}

/// One level.
pub struct Level<'a, const D: usize> {
    pub operator: LevelOperator<'a, D>,
    pub diagonal: BlockDiagonal,
    chebyshev: Chebyshev<f32>,
    near_bodies: Option<NearBodies<'a, D>>,
    /// Right-hand side and solution at the owned nodes and twists.
    pub b: Vec<f32>,
    pub z: Vec<f32>,
    /// Loads or velocities at the owned nodes on their way between levels.
    pub nodal: Vec<f32>,
}

impl<'a, const D: usize> Level<'a, D> {
    pub fn new(
        ranks: &'a Ranks,
        space: LevelSpace<D>,
        plans: Plans,
        viscosity: f64,
    ) -> Result<Self, FlowError> {
        let cells = space.operator(viscosity);
        let [x, y] = [0, 1].map(|_| vec![0.0; space.dim()]);
        let mut operator = LevelOperator { ranks, space, plans, cells, work: Workspace::default(), x, y };
        let diagonal = operator.diagonal(viscosity)?;
        let dim = operator.dim();
        let largest = cell_lambda_max(&operator.space.reference());
        let chebyshev = Chebyshev::below(largest, dim, &LEVEL_SWEEP);
        let nodal = vec![0.0; operator.space.owned_nodal_dim()];
        let [b, z] = [0, 1].map(|_| vec![0.0; dim]);
        Ok(Self { operator, diagonal, chebyshev, near_bodies: None, b, z, nodal })
    }

    /// Has the nodes around bodies smoothed once more, in 2D. All ranks call this.
    pub fn relax_near_bodies(
        &mut self,
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'a, '_, D>,
        viscosity: f64,
    ) {
        let largest = cell_lambda_max(&self.operator.space.reference());
        self.near_bodies = NearBodies::new(tree, shared, self, viscosity, largest);
    }

    /// Improves `z`, then once more around the bodies.
    pub fn smooth(&mut self) {
        let Self { operator, diagonal, chebyshev, near_bodies, b, z, .. } = self;
        chebyshev.smooth(operator, diagonal, b, z, Guess::Given);
        if let Some(near_bodies) = near_bodies {
            near_bodies.smooth(operator, b, z);
        }
    }
}

impl<const D: usize> LevelOperator<'_, D> {
    fn diagonal(&mut self, viscosity: f64) -> Result<BlockDiagonal, FlowError> {
        let mut nodal = vec![0.0; self.space.owned_dim()];
        self.fill_diagonal(viscosity);
        self.gather(&mut nodal);
        nodal.truncate(self.space.owned_nodal_dim());
        let inverted = self.invert(&mut nodal);
        let blocks = self.blocks(viscosity);
        let blocks = agreed(self.ranks, inverted.map_err(PartError::from).and(blocks))?;
        Ok(BlockDiagonal::new(nodal, blocks, rigid::<D>()))
    }

    /// Inverts the diagonal at owned nodes, whose entry is zero where nothing is unknown.
    fn invert(&self, nodal: &mut [f32]) -> Result<(), BadDiagonal> {
        let first = self.space.velocity.owned.start;
        for (row, entry) in nodal.iter_mut().enumerate() {
            *entry = match self.space.is_free(first + row / D) {
                true if *entry > 0.0 => 1.0 / *entry,
                true => return Err(BadDiagonal { row, value: f64::from(*entry) }),
                false => 0.0,
            };
        }
        Ok(())
    }

    /// Inverses of `R^T A R` for the owned bodies, zero for those that are not rigid here or held. All ranks
    /// call this.
    fn blocks(&self, viscosity: f64) -> Result<Vec<f32>, PartError> {
        let (bodies, map) = (&self.space.bodies, &self.space.velocity.map);
        let (n, size) = (rigid::<D>(), rigid::<D>() * rigid::<D>());
        let viscous = self.space.reference().viscous;
        let velocities = ReferenceMatrices::<D>::VELOCITY;
        let viscous = nalgebra::DMatrix::from_row_slice(velocities, velocities, &viscous);
        let mut blocks = vec![0.0; bodies.ids.len() * size];
        for cell in self.space.cells(viscosity) {
            let nodes = map.cell(cell.cell);
            let mut here: Vec<u32> = nodes.iter().filter_map(|&node| bodies.body_of(node as usize)).collect();
            here.sort_unstable();
            here.dedup();
            for body in here {
                let mut motion = nalgebra::DMatrix::zeros(velocities, n);
                for (i, &node) in nodes.iter().enumerate() {
                    if bodies.body_of(node as usize) == Some(body)
                        && let Ok(place) = bodies.nodes.binary_search_by_key(&node, |rigid| rigid.node)
                    {
                        let rows = rows(&bodies.nodes[place]);
                        (0..D * n).for_each(|k| motion[(i * D + k / n, k % n)] = rows[k]);
                    }
                }
                let product = motion.transpose() * (&viscous * &motion) * cell.viscous;
                let block = &mut blocks[body as usize * size..][..size];
                block.iter_mut().zip(product.iter()).for_each(|(b, p)| *b += p);
            }
        }
        let mut plan = GhostPlan::joined(&[(&bodies.plan, size, 0)]);
        plan.accumulate::<f64, 1>(self.ranks, &mut blocks);
        blocks.truncate(bodies.owned * size);
        for (body, block) in blocks.chunks_exact_mut(size).enumerate() {
            match bodies.is_active(body) && !bodies.is_held(body) {
                true => invert_spd(n, block)
                    .map_err(|source| PartError::Body { body: bodies.ids[body] as usize, source })?,
                false => block.fill(0.0),
            }
        }
        Ok(blocks.into_iter().map(|entry| entry as f32).collect())
    }

    /// What own cells add to the diagonal at nodes, in `y`.
    fn fill_diagonal(&mut self, viscosity: f64) {
        let Self { space, y, .. } = self;
        let nodes = &space.velocity;
        let n = ReferenceMatrices::<D>::VELOCITY;
        let viscous = space.reference().viscous;
        y.fill(0.0);
        for cell in space.cells(viscosity) {
            let local = nodes.map.cell(cell.cell);
            let has_hanging = local.iter().any(|&node| nodes.map.is_hanging(node as usize));
            for (i, &node) in local.iter().enumerate() {
                if !has_hanging {
                    (0..D).for_each(|c| {
                        y[node as usize * D + c] += (cell.viscous * viscous[(i * D + c) * (n + 1)]) as f32;
                    });
                    continue;
                }
                for (j, &other) in local.iter().enumerate() {
                    for (master, weight) in nodes.regular(node) {
                        let same = nodes.regular(other).find(|other| other.0 == master);
                        let weight = cell.viscous * weight * same.map_or(0.0, |same| same.1);
                        for c in 0..D {
                            let entry = viscous[(i * D + c) * n + j * D + c];
                            y[master as usize * D + c] += (weight * entry) as f32;
                        }
                    }
                }
            }
        }
    }
}
