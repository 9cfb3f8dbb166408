//! A flow in a box that ranks share.

use gluey_fem::{Cuts, ImplicitTree};
use gluey_geom::Vector;
use gluey_linalg::{BadDiagonal, DirectError, Gcr, GcrParams, KrylovError, LinOp, Reference};
use gluey_parallel::{Communicator, Traffic};

use crate::cycle::VCycle;
use crate::operator::{Plans, StokesOperator};
use crate::precondition::BlockTriangular;
use crate::space::{LevelSpace, ghost_plan};

/// Iterations between restarts.
const RESTART: usize = 60;

/// A fluid, and how well its flow is to be known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxFlow {
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// Largest residual, as a fraction of that of a fluid at rest.
    pub tolerance: f64,
    /// Give up after so many.
    pub max_iterations: usize,
}

/// Why there is no flow.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlowError {
    /// The iterations did not converge.
    #[error(transparent)]
    Krylov(#[from] KrylovError),
    /// A velocity has no equation.
    #[error(transparent)]
    Diagonal(#[from] BadDiagonal),
    /// The matrix of the coarsest level has no factor: the box has no wall.
    #[error("coarsest level: {0}")]
    Coarse(#[from] DirectError),
    /// The same, on rank zero, which has that matrix and says more.
    #[error("coarsest level: no factor on rank 0")]
    CoarseElsewhere,
}

/// What one rank holds of one level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelSizes {
    /// Its own cells.
    pub cells: usize,
    /// Cells around them.
    pub ghost_cells: usize,
    /// Velocity nodes that it owns.
    pub nodes: usize,
    /// Velocity nodes of other ranks that it reads or adds to.
    pub ghost_nodes: usize,
    /// Ranks that it sends velocities to.
    pub neighbours: usize,
}

/// The part of a flow at the nodes of one rank. The parts of all ranks, in their order, are the flow at all
/// nodes in the order of the serial solver.
#[derive(Clone, Debug)]
pub struct MyFlow<const D: usize> {
    /// Places of the velocity nodes.
    pub points: Vec<Vector<D>>,
    /// Velocities at them.
    pub velocity: Vec<Vector<D>>,
    /// Pressures at the pressure nodes, without their mean.
    pub pressure: Vec<f64>,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Norm of the true residual, over that of a fluid at rest.
    pub relative_residual: f64,
    /// What the rank holds, coarsest level first.
    pub levels: Vec<LevelSizes>,
    /// What it sent before the first iteration, and in the solve.
    pub setup_traffic: Traffic,
    /// What it sent in the solve.
    pub solve_traffic: Traffic,
}

impl BoxFlow {
    /// The flow with the velocity `walls` on the walls of the box. All ranks call this with the same tree and
    /// cuts.
    ///
    /// # Errors
    /// [`FlowError`], on all ranks.
    pub fn solve<const D: usize>(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        cuts: &Cuts,
        ranks: &dyn Communicator,
        walls: &dyn Fn(&Vector<D>) -> Vector<D>,
    ) -> Result<MyFlow<D>, FlowError> {
        let start = ranks.traffic();
        let cycle = VCycle::new(tree, (cuts, ranks), self.viscosity)?;
        let top = &cycle.levels[cycle.levels.len() - 1].operator;
        let space = top.space.clone();
        let pressure = ghost_plan(tree, (cuts, ranks), &space.part, &space.pressure, |_| true);
        let plans = Plans { velocity: top.plan.clone(), pressure };
        let levels = cycle.levels.iter().map(|level| sizes(&level.operator.space, &level.operator.plan));
        let levels = levels.collect();
        let mut preconditioner = BlockTriangular::new(cycle, plans.pressure.clone(), self.viscosity);
        let mut operator = StokesOperator::new(ranks, space, plans, self.viscosity);
        let points = operator.space.velocity.clone();
        let on_wall = |node: usize| -> [f64; D] { walls(&points.map.point(node)).into() };
        let b = right_hand_side(&mut operator, &preconditioner.mass, &on_wall);
        let setup_traffic = ranks.traffic().since(start);
        let mut x = vec![0.0; b.len()];
        let report =
            self.krylov().solve(&mut operator, &mut preconditioner, &b, &mut x, Reference::RightHandSide)?;
        let solve_traffic = ranks.traffic().since(start).since(setup_traffic);
        remove_mean(ranks, &preconditioner.mass, &mut x[operator.velocity_dim()..]);
        let (velocity, pressure) = operator.nodal_values(&x, on_wall);
        let reference = if report.reference_norm > 0.0 { report.reference_norm } else { 1.0 };
        Ok(MyFlow {
            points: points.owned.clone().map(|node| points.map.point(node)).collect(),
            velocity: velocity.as_chunks::<D>().0.iter().map(|&u| u.into()).collect(),
            pressure,
            iterations: report.iterations,
            relative_residual: report.residual_norm / reference,
            levels,
            setup_traffic,
            solve_traffic,
        })
    }

    /// Directions in single precision, as exact as the preconditioner that gives them.
    fn krylov(&self) -> Gcr<f64, f64, f32> {
        Gcr::with_directions(GcrParams {
            relative_tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            restart: RESTART,
            ..GcrParams::default()
        })
    }
}

fn sizes<const D: usize>(space: &LevelSpace<D>, plan: &gluey_parallel::GhostPlan) -> LevelSizes {
    let cells = space.part.own().len();
    LevelSizes {
        cells,
        ghost_cells: space.part.mesh.cell_count() - cells,
        nodes: space.velocity.owned.len(),
        ghost_nodes: plan.ghost_count(),
        neighbours: plan.neighbour_count(),
    }
}

/// Minus what the walls' velocities give, without the part that no flow can take: a net flux through them.
fn right_hand_side<const D: usize>(
    operator: &mut StokesOperator<'_, D>,
    mass: &[f64],
    on_wall: &dyn Fn(usize) -> [f64; D],
) -> Vec<f64> {
    let mut b = vec![0.0; operator.dim()];
    operator.apply_to_walls(on_wall, &mut b);
    b.iter_mut().for_each(|b| *b = -*b);
    let divergence = &mut b[operator.velocity_dim()..];
    let mut sums = [divergence.iter().sum(), mass.iter().sum()];
    operator.ranks.sum(&mut sums);
    divergence.iter_mut().zip(mass).for_each(|(q, mass)| *q -= sums[0] / sums[1] * mass);
    b
}

/// Subtracts the mean from pressures that are zero at hanging nodes.
fn remove_mean(ranks: &dyn Communicator, mass: &[f64], p: &mut [f64]) {
    let mut sums = [p.iter().zip(mass).map(|(p, mass)| p * mass).sum(), mass.iter().sum()];
    ranks.sum(&mut sums);
    p.iter_mut().zip(mass).filter(|(_, mass)| **mass > 0.0).for_each(|(p, _)| *p -= sums[0] / sums[1]);
}
