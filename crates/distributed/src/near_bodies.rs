//! Relaxation of the nodes around the bodies in 2D, as in the serial solver: after the sweep of a level the
//! error on the nodes within three cells of a body and on the twists is smoothed, all else at rest.

use gluey_fem::ImplicitTree;
use gluey_fem::cells::Workspace;
use gluey_linalg::{Chebyshev, Guess, LinOp, vector};
use gluey_parallel::GhostPlan;
use gluey_stokes::part::{BlockDiagonal, RELAXED_DIMENSIONS, RELAXED_RINGS, RELAXED_SWEEP};

use crate::bodies::{Shared, rigid};
use crate::level::{Level, LevelOperator};
use crate::space::{LevelSpace, Plans, wanted_nodes};

/// The sweep around the bodies of one level.
pub struct NearBodies<'a, const D: usize> {
    /// Of the cells around bodies, with ghosts there alone.
    operator: LevelOperator<'a, D>,
    /// Zero elsewhere: what it multiplies stays there.
    diagonal: BlockDiagonal,
    chebyshev: Chebyshev<f32>,
    r: Vec<f32>,
    e: Vec<f32>,
}

impl<'a, const D: usize> NearBodies<'a, D> {
    /// For a level with eigenvalues up to `lambda_max`; `None` in 3D and without bodies. All ranks call this.
    pub fn new(
        tree: &mut ImplicitTree<'_, D>,
        shared: &Shared<'a, '_, D>,
        level: &Level<'a, D>,
        viscosity: f64,
        lambda_max: f64,
    ) -> Option<Self> {
        if D > RELAXED_DIMENSIONS || shared.bodies.balls().is_empty() {
            return None;
        }
        let LevelOperator { space, plans, .. } = &level.operator;
        let near = near(tree, shared, space);
        let owned = space.velocity.owned.clone();
        let mut diagonal = level.diagonal.clone();
        for (entries, node) in diagonal.nodal_mut().chunks_exact_mut(D).zip(owned) {
            if !near[node] {
                entries.fill(0.0);
            }
        }
        let map = &space.velocity.map;
        let is_near = |&node: &u32| space.velocity.regular(node).any(|(node, _)| near[node as usize]);
        let cells = space.cells(viscosity).filter(|cell| map.cell(cell.cell).iter().any(is_near));
        let cells = space.operator_of(cells);
        let nodes = plans.nodes.restricted(shared.ranks, |node| near[node as usize]);
        let bodies = (&space.bodies.plan, rigid::<D>(), space.nodal_dim());
        let all = GhostPlan::joined(&[(&nodes, D, 0), bodies]);
        let plans = Plans { all, nodes, twists: plans.twists.clone() };
        let [x, y] = [0, 1].map(|_| vec![0.0; space.dim()]);
        let (space, work) = (space.clone(), Workspace::default());
        let operator = LevelOperator { ranks: shared.ranks, space, plans, cells, work, x, y };
        let dim = operator.dim();
        let [r, e] = [0, 1].map(|_| vec![0.0; dim]);
        Some(Self { operator, diagonal, chebyshev: Chebyshev::below(lambda_max, dim, &RELAXED_SWEEP), r, e })
    }

    /// Smooths `A x = b` from the present `x`, where `whole` is `A`.
    pub fn smooth(&mut self, whole: &mut LevelOperator<'_, D>, b: &[f32], x: &mut [f32]) {
        let Self { operator, diagonal, chebyshev, r, e } = self;
        whole.scatter(x);
        operator.cells.viscous(&whole.x, &mut operator.y, &mut operator.work);
        operator.gather(r);
        vector::residual_from_product(b, r);
        chebyshev.smooth(operator, diagonal, r, e, Guess::Zero);
        vector::axpy(1.0, e, x);
    }
}

/// Which nodes of a part lie within some cells of a body. What the owner of a node says holds.
fn near<const D: usize>(
    tree: &mut ImplicitTree<'_, D>,
    shared: &Shared<'_, '_, D>,
    space: &LevelSpace<D>,
) -> Vec<bool> {
    let nodes = &*space.velocity;
    let wanted = wanted_nodes(tree, shared, &space.part, nodes, |node| !nodes.map.is_hanging(node));
    let mut plan = GhostPlan::new(shared.ranks, wanted, nodes.finder());
    let mut near: Vec<f32> = (0..nodes.map.node_count())
        .map(|node| f32::from(u8::from(space.bodies.body_of(node).is_some())))
        .collect();
    for _ in 0..RELAXED_RINGS {
        let before = near.clone();
        for cell in 0..nodes.map.cell_count() {
            let of_cell = nodes.map.cell(cell);
            if of_cell.iter().any(|&node| before[node as usize] > 0.0) {
                of_cell.iter().for_each(|&node| near[node as usize] = 1.0);
            }
        }
        plan.update::<f32, 1>(shared.ranks, &mut near);
    }
    near.into_iter().map(|near| near > 0.0).collect()
}
