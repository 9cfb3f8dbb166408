//! A flow in a box that ranks share.

use gluey_geom::{Dim, Space, Twist, Vector, Wrench};
use gluey_levelset::Ball;
use gluey_linalg::{BadDiagonal, BlockError, KrylovError, SparseError, vector};
use gluey_motion::Fields;
use gluey_parallel::{Communicator, Ranks, Traffic};
use gluey_stokes::{RaisedPenalties, StokesError, Stress};

use crate::cells::LocalFields;
use crate::space::LevelSpace;

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

/// What goes wrong in the part of a rank. None of it turns into a [`FlowError`] by itself: ranks agree first.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PartError {
    /// A velocity or pressure has no equation.
    #[error(transparent)]
    Diagonal(#[from] BadDiagonal),
    /// The motion of a body has no equation.
    #[error("body {}: {source}", body + 1)]
    Body {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Its rows.
        source: BlockError,
    },
    /// What the solver says: of the pressures of the box, and of surfaces.
    #[error(transparent)]
    Stokes(#[from] StokesError),
    /// A matrix of pressures is too large.
    #[error(transparent)]
    Sparse(#[from] SparseError),
}

/// Why there is no flow, on all ranks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlowError {
    /// The iterations did not converge.
    #[error(transparent)]
    Krylov(KrylovError),
    /// What goes wrong in the part of this rank, or the same in the part of each.
    #[error(transparent)]
    Part(PartError),
    /// What goes wrong in the part of another rank.
    #[error("{message} (on rank {rank})")]
    Elsewhere {
        /// Which rank, the first of them.
        rank: usize,
        /// What it says.
        message: String,
    },
    /// The velocity block lacks positivity at a body, whatever the penalty there.
    #[error(
        "penalties at body {} were raised {rounds} times, and the surface of a cell still takes {share:.2} of the strain \
         energy around it: refine the mesh",
        body + 1
    )]
    WeakSurface {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// What the tractions on the surface take, over the strain energy around the cell.
        share: f64,
        /// How often penalties were raised.
        rounds: usize,
    },
    /// A mean flow is taken away around held bodies in a box without walls only, and the stress is not known
    /// then.
    #[error("flows without mean flow are those around held bodies in boxes without walls, without a stress")]
    Conditions,
    /// Walls drive a flow that has none.
    #[error("the box has no wall whose velocity could drive a flow")]
    NoWall,
    /// As many wrenches or motions as bodies are needed, or none.
    #[error("{found} wrenches or motions for {bodies} bodies")]
    Count {
        /// Entries given.
        found: usize,
        /// Bodies.
        bodies: usize,
    },
}

impl FlowError {
    /// What goes wrong in the same way on each rank, for it follows from what all know.
    pub(crate) fn of_all(error: StokesError) -> Self {
        Self::Part(error.into())
    }

    /// What ranks have agreed on.
    pub(crate) fn agreed(error: StokesError) -> Self {
        match error {
            StokesError::Elsewhere { rank, message } => Self::Elsewhere { rank, message },
            error => Self::of_all(error),
        }
    }
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
    /// Bodies whose twists it owns.
    pub bodies: usize,
    /// Bodies of other ranks that it has nodes of.
    pub ghost_bodies: usize,
    /// Ranks that it sends velocities to.
    pub neighbours: usize,
}

/// The part of a flow at the nodes of one rank. The parts of all ranks, in their order, are the flow at all
/// nodes in the order of one process.
#[derive(Clone, Debug)]
pub struct LocalFlow<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Places of the velocity nodes.
    pub points: Vec<Vector<D>>,
    /// Velocities at them.
    pub velocity: Vec<Vector<D>>,
    /// Pressures at the pressure nodes, without the mean of the unknown ones; zero where bodies are all
    /// around.
    pub pressure: Vec<f64>,
    /// Velocity and spin of each body, the same on all ranks.
    pub twists: Vec<Twist<D>>,
    /// Forces and torques on the bodies but those of the fluid and of `force`: given, or what held ones lack;
    /// the same on all ranks.
    pub wrenches: Vec<Wrench<D>>,
    /// Where bodies are held in `unfitted`, the mean velocity over fluid and bodies, in a linear flow less
    /// that of the flow.
    pub mean_velocity: Option<Vector<D>>,
    /// The force per unit of volume that takes the mean flow away, where that was wanted.
    pub mean_force: Vector<D>,
    /// The stress, where it was wanted, the same on all ranks.
    pub stress: Option<Stress<D>>,
    /// Cells of all ranks.
    pub cell_count: usize,
    /// Velocity and pressure unknowns of all ranks, as if there were no bodies and no hanging nodes.
    pub dof_count: usize,
    /// Solves that it took: one, but for weak penalties, boxes without mean flow and given stresses.
    pub solve_count: usize,
    /// How penalties were changed for them.
    pub raised_penalties: RaisedPenalties,
    /// Iterations of the solver in all of them.
    pub iterations: usize,
    /// Norm of the true residual, over that of a fluid at rest.
    pub relative_residual: f64,
    /// What the rank holds, coarsest level first.
    pub levels: Vec<LevelSizes>,
    /// What it sent before the first iteration, and in the solve.
    pub setup_traffic: Traffic,
    /// What it sent in the solve.
    pub solve_traffic: Traffic,
    pub(crate) cells: LocalFields<D>,
}

impl<const D: usize> LocalFlow<D>
where
    Dim<D>: Space<D>,
{
    /// The fields in the cells of the rank, around the bodies of the flow: cells of all ranks, in their
    /// order, are those of one process, each once. Points on borders are points of every rank that has
    /// a cell there.
    pub fn fields(&self, balls: &[Ball<D>]) -> Fields<D> {
        self.cells.fields(balls)
    }

    /// Adds a multiple of a flow around the same bodies on the same cells.
    pub(crate) fn add(&mut self, factor: f64, other: &Self) {
        let velocities = self.velocity.iter_mut().zip(&other.velocity);
        velocities.for_each(|(u, other)| *u += other * factor);
        vector::axpy(factor, &other.pressure, &mut self.pressure);
        let twists = self.twists.iter_mut().zip(&other.twists);
        twists.for_each(|(twist, other)| *twist = *twist + *other * factor);
        let wrenches = self.wrenches.iter_mut().zip(&other.wrenches);
        wrenches.for_each(|(wrench, other)| *wrench = *wrench + *other * factor);
        self.cells.add(factor, &other.cells);
        self.solve_count += other.solve_count;
        self.raised_penalties += other.raised_penalties;
        self.iterations += other.iterations;
        self.relative_residual = self.relative_residual.max(other.relative_residual);
    }

    /// Shear of the box: what stands at `x` in it is at `x + shear (y - y_lower) e_1` in space.
    pub fn shear(&self) -> f64 {
        self.cells.shear()
    }
}

/// Cells and unknowns of all ranks.
pub fn counts_of_all<const D: usize>(space: &LevelSpace<D>, ranks: &Ranks) -> [f64; 2] {
    let unknowns = space.owned_nodal_dim() + space.pressure.owned.len();
    let mut counts = [space.part.own().len() as f64, unknowns as f64];
    ranks.sum(&mut counts);
    counts
}
