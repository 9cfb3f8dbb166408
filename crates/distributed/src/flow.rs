//! A flow in a box that ranks share.

use gluey_fem::{Cuts, ImplicitTree};
use gluey_geom::{Dim, Space, Twist, Vector, Wrench};
use gluey_levelset::{Ball, BallTree, Body};
use gluey_linalg::{
    BadDiagonal, BlockError, DirectError, Gcr, GcrParams, KrylovError, KrylovReport, LinOp, Reference,
    SparseError, vector,
};
use gluey_motion::Fields;
use gluey_parallel::{Communicator, Traffic};
use gluey_stokes::{RaisedPenalties, StokesError, Stress};

use crate::bodies::{Shared, rigid};
use crate::cells::MyCells;
use crate::cycle::VCycle;
use crate::operator::StokesOperator;
use crate::precondition::BlockTriangular;
use crate::pressures::SharedPressures;
use crate::schur::SchurInverse;
use crate::space::{LevelSpace, Plans};

/// Largest change of the viscous force when a velocity is rounded to single precision, over the force of a
/// velocity as smooth as the box, with which steps are taken in it, as in the serial solver.
const MOST_NOISE: f64 = 1.0;
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

/// Rigid bodies in a flow, all of which every rank knows.
///
/// As in the formulation `rigid-dofs` of the serial solver: nodes inside a body take part in its motion, and
/// pressures of cut cells follow from those outside.
#[derive(Clone, Copy, Debug)]
pub struct RigidBodies<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    /// The bodies.
    pub balls: &'a [Ball<D>],
    /// Nodes with a level set of at least this many cells are rigid.
    pub offset: f64,
    /// Force and torque on each body, or no entries for none on any.
    pub wrenches: &'a [Wrench<D>],
}

/// What goes wrong in the part of a rank. None of it turns into a [`FlowError`] by itself: ranks agree first.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PartError {
    /// A velocity or pressure has no equation.
    #[error(transparent)]
    Diagonal(#[from] BadDiagonal),
    /// The matrix of the coarsest level has no factor: the box has no wall.
    #[error("coarsest level: {0}")]
    Coarse(#[from] DirectError),
    /// The motion of a body has no equation.
    #[error("body {}: {source}", body + 1)]
    Body {
        /// Index of the body, from 0; messages count from 1.
        body: usize,
        /// Its rows.
        source: BlockError,
    },
    /// What the serial solver says: of small matrices of pressures, in a gap or of the box, and of surfaces.
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
/// nodes in the order of the serial solver.
#[derive(Clone, Debug)]
pub struct MyFlow<const D: usize>
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
    pub(crate) cells: MyCells<D>,
}

impl<const D: usize> MyFlow<D>
where
    Dim<D>: Space<D>,
{
    /// The fields in the cells of the rank, around the bodies of the flow: cells of all ranks, in their
    /// order, are those of the serial solver, each once. Points on borders are points of every rank that has
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

impl BoxFlow {
    /// The flow with the velocity `walls` on the walls of the box. All ranks call this with the same tree and
    /// cuts. The function is also taken for the undisturbed flow inside.
    ///
    /// # Errors
    /// [`FlowError`], on all ranks.
    pub fn solve<const D: usize>(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        cuts: &Cuts,
        ranks: &dyn Communicator,
        walls: &dyn Fn(&Vector<D>) -> Vector<D>,
    ) -> Result<MyFlow<D>, FlowError>
    where
        Dim<D>: Space<D>,
    {
        let none = RigidBodies { balls: &[], offset: 0.0, wrenches: &[] };
        self.solve_around(&none, tree, cuts, ranks, walls)
    }

    /// The same around rigid bodies, which all ranks know.
    ///
    /// # Errors
    /// [`FlowError`], on all ranks.
    pub fn solve_around<const D: usize>(
        &self,
        bodies: &RigidBodies<'_, D>,
        tree: &mut ImplicitTree<'_, D>,
        cuts: &Cuts,
        ranks: &dyn Communicator,
        walls: &dyn Fn(&Vector<D>) -> Vector<D>,
    ) -> Result<MyFlow<D>, FlowError>
    where
        Dim<D>: Space<D>,
    {
        bodies.check()?;
        let (start, tree_of_balls) = (ranks.traffic(), BallTree::new(bodies.balls));
        let shared = Shared { cuts, ranks, bodies: &tree_of_balls, offset: bodies.offset, held: &[] };
        let cycle = VCycle::new(tree, &shared, self.viscosity)?;
        let top = &cycle.levels[cycle.levels.len() - 1].operator;
        let space = top.space.clone();
        check_resolved(bodies.balls, &space, ranks)?;
        let pressures = SharedPressures::new(tree, &shared, &space);
        let levels = cycle.levels.iter().map(|level| sizes(&level.operator.space, &level.operator.plans));
        let levels = levels.collect();
        let schur = SchurInverse::new(tree, &shared, &space, &top.plans.nodes, &pressures, self.viscosity)?;
        let mut operator = StokesOperator::new(ranks, space, &top.plans, pressures.clone(), self.viscosity);
        let mut preconditioner = BlockTriangular::new(cycle, pressures, schur);
        let points = operator.space.velocity.clone();
        let lift = operator.lift(|node| walls(&points.map.point(node)).into());
        let b = right_hand_side(&mut operator, bodies, &lift);
        let (setup_traffic, mut x) = (ranks.traffic().since(start), vec![0.0; b.len()]);
        let report =
            self.krylov(&mut operator, &mut preconditioner, &b, &mut x).map_err(FlowError::Krylov)?;
        let solve_traffic = ranks.traffic().since(start).since(setup_traffic);
        let velocity_dim = operator.velocity_dim();
        operator.pressures.remove_mean(ranks, &mut x[velocity_dim..]);
        let [velocity, twists, pressure] = operator.nodal_values(&lift, &x);
        let counts = counts_of_all(&operator.space, ranks);
        let reference = if report.reference_norm > 0.0 { report.reference_norm } else { 1.0 };
        Ok(MyFlow {
            points: points.owned.clone().map(|node| points.map.point(node)).collect(),
            velocity: velocity.as_chunks::<D>().0[points.owned.clone()].iter().map(|&u| u.into()).collect(),
            pressure: pressure[operator.space.pressure.owned.clone()].to_vec(),
            twists: twists_of_all(bodies.balls, &operator.space, ranks, &twists),
            wrenches: match bodies.wrenches {
                [] => vec![Wrench::default(); bodies.balls.len()],
                given => given.to_vec(),
            },
            mean_velocity: None,
            mean_force: Vector::zeros(),
            stress: None,
            cell_count: counts[0] as usize,
            dof_count: counts[1] as usize,
            solve_count: 1,
            raised_penalties: RaisedPenalties::default(),
            iterations: report.iterations,
            relative_residual: report.residual_norm / reference,
            levels,
            setup_traffic,
            solve_traffic,
            cells: MyCells::new(&operator.space, self.viscosity, velocity, pressure),
        })
    }

    /// Steps in single precision, where rounding does not disturb them, as in the serial solver.
    fn krylov<const D: usize>(
        &self,
        operator: &mut StokesOperator<'_, D>,
        preconditioner: &mut BlockTriangular<'_, D>,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<KrylovReport, KrylovError>
    where
        Dim<D>: Space<D>,
    {
        let params = GcrParams {
            relative_tolerance: self.tolerance,
            max_iterations: self.max_iterations,
            restart: RESTART,
            ..GcrParams::default()
        };
        let mesh = &operator.space.part.mesh;
        let cells = mesh.domain().extent().max() / mesh.size(mesh.max_level());
        let reference = Reference::RightHandSide;
        match f64::from(f32::EPSILON) * cells * cells {
            ..=MOST_NOISE => {
                Gcr::<f64, f32>::with_steps(params).solve(operator, preconditioner, b, x, reference)
            }
            _ => {
                Gcr::<f64, f64, f32>::with_directions(params).solve(operator, preconditioner, b, x, reference)
            }
        }
    }
}

impl<const D: usize> RigidBodies<'_, D>
where
    Dim<D>: Space<D>,
{
    fn check(&self) -> Result<(), FlowError> {
        let (found, bodies) = (self.wrenches.len(), self.balls.len());
        if found == 0 || found == bodies { Ok(()) } else { Err(FlowError::Count { found, bodies }) }
    }
}

/// All ranks learn of the first body that is too small.
fn check_resolved<const D: usize>(
    balls: &[Ball<D>],
    space: &LevelSpace<D>,
    ranks: &dyn Communicator,
) -> Result<(), FlowError> {
    let mesh = &space.part.mesh;
    let cell_size = mesh.size(mesh.max_level());
    let is_lost = |place: &usize| {
        let ball = &balls[space.bodies.ids[*place] as usize];
        !space.bodies.is_active(*place) || ball.bounding_radius() < cell_size
    };
    let lost =
        (0..space.bodies.owned).find(is_lost).map_or(u64::MAX, |place| u64::from(space.bodies.ids[place]));
    let first = ranks.all_gather(&[lost]).into_iter().min().unwrap_or(u64::MAX);
    match balls.get(first as usize) {
        Some(ball) => {
            let (body, radius) = (first as usize, ball.bounding_radius());
            Err(FlowError::of_all(StokesError::Unresolved { body, radius, cell_size }))
        }
        None => Ok(()),
    }
}

pub fn sizes<const D: usize>(space: &LevelSpace<D>, plans: &Plans) -> LevelSizes {
    let cells = space.part.own().len();
    LevelSizes {
        cells,
        ghost_cells: space.part.mesh.cell_count() - cells,
        nodes: space.velocity.owned.len(),
        ghost_nodes: plans.nodes.ghost_count(),
        bodies: space.bodies.owned,
        ghost_bodies: space.bodies.plan.ghost_count(),
        neighbours: plans.all.neighbour_count(),
    }
}

/// Forces and torques on the bodies, less what the lift gives, without the part that no flow can take: a net
/// flux through the walls.
fn right_hand_side<const D: usize>(
    operator: &mut StokesOperator<'_, D>,
    bodies: &RigidBodies<'_, D>,
    lift: &[f64],
) -> Vec<f64>
where
    Dim<D>: Space<D>,
{
    let mut b = vec![0.0; LinOp::<f64>::dim(operator)];
    let nodal = operator.space.owned_nodal_dim();
    let own = &operator.space.bodies.ids[..operator.space.bodies.owned];
    let rows = b[nodal..].chunks_exact_mut(rigid::<D>());
    for (&body, rows) in own.iter().zip(rows) {
        let Some(wrench) = bodies.wrenches.get(body as usize) else { continue };
        let radius = bodies.balls[body as usize].bounding_radius();
        rows[..D].copy_from_slice(wrench.force.as_slice());
        let torque = Dim::<D>::spin_slice(&wrench.torque);
        rows[D..].iter_mut().zip(torque).for_each(|(row, torque)| *row = torque / radius);
    }
    operator.subtract_lift(lift, &mut b);
    let divergence = &mut b[operator.velocity_dim()..];
    operator.pressures.remove_mean(operator.ranks, divergence);
    b
}

/// Cells and unknowns of all ranks.
pub fn counts_of_all<const D: usize>(space: &LevelSpace<D>, ranks: &dyn Communicator) -> [f64; 2] {
    let unknowns = space.owned_nodal_dim() + space.pressure.owned.len();
    let mut counts = [space.part.own().len() as f64, unknowns as f64];
    ranks.sum(&mut counts);
    counts
}

/// The twists of all bodies, of which each rank has its own.
fn twists_of_all<const D: usize>(
    balls: &[Ball<D>],
    space: &LevelSpace<D>,
    ranks: &dyn Communicator,
    own: &[f64],
) -> Vec<Twist<D>>
where
    Dim<D>: Space<D>,
{
    if balls.is_empty() {
        return Vec::new();
    }
    let n = rigid::<D>();
    let mut all = vec![0.0; balls.len() * n];
    for (&body, twist) in space.bodies.ids.iter().zip(own.chunks_exact(n)) {
        all[body as usize * n..][..n].copy_from_slice(twist);
    }
    ranks.sum(&mut all);
    let twist = |(ball, entries): (&Ball<D>, &[f64])| {
        let mut twist = Twist::default();
        twist.velocity.copy_from_slice(&entries[..D]);
        (D..n).for_each(|k| twist.spin[k - D] = entries[k] / ball.bounding_radius());
        twist
    };
    balls.iter().zip(all.chunks_exact(n)).map(twist).collect()
}
