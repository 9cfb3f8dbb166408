//! Flows around the true surfaces of bodies, the formulation `unfitted` of the serial solver, on cells that
//! ranks share.
//!
//! A rank sets the serial solver's problem up on its part of the finest mesh, which reaches far enough around
//! surfaces for all that follows from places alone: cut cells, aggregates, penalties, films, blocks of the
//! smoother. Only sums over cells go between ranks. Coarser levels are those of bodies whose nodes move with
//! them.

mod balance;
mod conditions;
mod films;
mod space;
mod sums;
mod weak;

use std::sync::Arc;

use gluey_fem::{Cell, Cuts, ImplicitTree};
use gluey_geom::{Dim, Space, Vector, Wrench};
use gluey_levelset::{Ball, BallTree, Body};
use gluey_linalg::KrylovError;
use gluey_parallel::{Communicator, Halo, Ranks, Traffic};
use gluey_stokes::part::{
    AssembledSmoother, MOST_ROUNDS, PartMethod, SurfaceCorrection, VCycle, rings_around_surfaces,
};
use gluey_stokes::{
    Conditions, Discretisation, Film, Given, GivenOf, Lubrication, MultigridSolver, NodalFields, Problem,
    SaddleSolver, SolveReport, StokesError, Stress,
};

use crate::agreement::{agreed, gathered};
use crate::bodies::{NearBodies, Shared};
use crate::cells::MyCells;
use crate::flow::{BoxFlow, FlowError, LevelSizes, MyFlow, counts_of_all};
use crate::levels::Levels;
use crate::space::{Around, LevelSpace};
use crate::warm_start::{Moved, WarmStart};
use conditions::{check_count, given};
use films::network;
use space::{PartHalos, is_near_surface, owner_of_film};
use weak::Before;

/// Bodies whose surfaces cut the mesh where they are, all of which every rank knows.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceBodies<'a, const D: usize> {
    /// The bodies.
    pub balls: &'a [Ball<D>],
    /// Treatment of films that are too thin for the mesh.
    pub lubrication: Lubrication,
}

/// A tree and the ranks that share its leaves.
pub struct SharedTree<'s, 't, const D: usize> {
    pub tree: &'s mut ImplicitTree<'t, D>,
    pub cuts: &'s Cuts,
    pub ranks: &'s Ranks,
}

/// What a flow is computed with.
struct Setting<'f, 'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    flow: &'f BoxFlow,
    shared: Shared<'a, 'f, D>,
    bodies: NearBodies<D>,
    discretisation: Discretisation<D>,
    level: LevelSpace<D>,
    sizes: Vec<LevelSizes>,
    conditions: &'f Conditions<'f, D>,
    /// What is known of the bodies near the part; wrenches of those alone that this rank owns.
    given: Vec<GivenOf<D>>,
    /// Whether the flow is kept for the next one.
    keeps: bool,
    /// What was sent before.
    start: Traffic,
}

impl BoxFlow {
    /// The flow around bodies whose surfaces cut the mesh, under conditions on all of them. All ranks call
    /// this with the same arguments. A box without walls is sheared like the tree, and the flow has no mean
    /// where all bodies are free.
    ///
    /// # Errors
    /// [`FlowError`], on all ranks. [`FlowError::Conditions`] for a mean flow that cannot be taken away.
    pub fn solve_around_surfaces<const D: usize>(
        &self,
        around: &SurfaceBodies<'_, D>,
        tree: &mut ImplicitTree<'_, D>,
        cuts: &Cuts,
        ranks: &Ranks,
        conditions: &Conditions<'_, D>,
    ) -> Result<MyFlow<D>, FlowError>
    where
        Dim<D>: Space<D>,
    {
        self.solve_from(around, &mut SharedTree { tree, cuts, ranks }, conditions, None)
    }

    /// The same from the last flows, which this one becomes one of where it is to be kept.
    ///
    /// # Errors
    /// As above; nothing is kept then.
    pub(crate) fn solve_from<const D: usize>(
        &self,
        around: &SurfaceBodies<'_, D>,
        leaves: &mut SharedTree<'_, '_, D>,
        conditions: &Conditions<'_, D>,
        kept: Option<&mut Option<Arc<WarmStart<D>>>>,
    ) -> Result<MyFlow<D>, FlowError>
    where
        Dim<D>: Space<D>,
    {
        check_count(conditions, around.balls.len())?;
        if conditions.without_mean {
            return self.balanced(around, leaves, conditions, kept);
        }
        let SharedTree { tree, cuts, ranks } = leaves;
        let (cuts, ranks) = (*cuts, *ranks);
        let cell_size = tree.frame().size(tree.max_level());
        let is_small = |ball: &Ball<D>| ball.bounding_radius() < cell_size;
        if let Some(body) = around.balls.iter().position(is_small) {
            let radius = around.balls[body].bounding_radius();
            return Err(FlowError::of_all(StokesError::Unresolved { body, radius, cell_size }));
        }
        let start = ranks.traffic();
        let bodies = BallTree::new(around.balls);
        let held = conditions.held(around.balls.len());
        let shared = Shared { cuts, ranks, bodies: &bodies, held: &held };
        let frame = tree.frame().clone();
        let spreads = |cell: &Cell<D>| is_near_surface(&frame, &bodies, cell);
        let is_own = |film: &Film<D>| owner_of_film(tree, &shared, film) == ranks.rank();
        let all = (around.balls, frame.domain());
        let rings = rings_around_surfaces(around.lubrication, all, cell_size, &is_own);
        let wide = Around { rings, spreads: &spreads };
        let Levels { cycle, finest: level, discretisation, bodies, sizes } =
            Levels::new(tree, &shared, self.viscosity, &wide)?;
        let setting = Setting {
            flow: self,
            given: given(conditions, &bodies, ranks.rank()),
            bodies,
            shared,
            discretisation,
            level,
            sizes,
            conditions,
            keeps: kept.is_some(),
            start,
        };
        let mut nothing = None;
        let kept = kept.unwrap_or(&mut nothing);
        let before = kept.take().map(|last| last.moved(ranks, &setting.level));
        let method = PartMethod::new(around.lubrication);
        let flow;
        (flow, *kept) = setting.trusted(tree, cycle, method, before)?;
        Ok(flow)
    }
}

/// A flow with the penalties that were tried.
struct Attempt<const D: usize>
where
    Dim<D>: Space<D>,
{
    cycle: VCycle<D>,
    /// Values at all nodes of the part, those of the velocity followed by the twists near it.
    velocity: Vec<f64>,
    pressure: Vec<f64>,
    /// What the next flow may start from.
    deviation: Option<NodalFields>,
    wrenches: Vec<Wrench<D>>,
    mean_velocity: Option<Vector<D>>,
    stress: Option<Stress<D>>,
    sizes: Vec<LevelSizes>,
    report: Result<SolveReport, KrylovError>,
    setup_traffic: Traffic,
    solve_traffic: Traffic,
}

impl<'a, const D: usize> Setting<'_, 'a, D>
where
    Dim<D>: Space<D>,
{
    /// The flow with penalties that are large enough, as in the serial solver.
    fn trusted(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        mut cycle: VCycle<D>,
        mut method: PartMethod,
        mut before: Option<Moved>,
    ) -> Result<(MyFlow<D>, Option<Arc<WarmStart<D>>>), FlowError> {
        let (ranks, mut earlier) = (self.shared.ranks, Before::default());
        loop {
            let mut problem = agreed(ranks, self.problem(tree, &method))?;
            let halos = PartHalos::new(tree, &self.shared, &self.level, (&problem, &self.bodies));
            problem.system.share(halos.of_system.clone());
            let smoother = self.named(AssembledSmoother::new(&problem));
            if let Some(stiffer) = self.stiffened(&method, &smoother) {
                method = stiffer;
                earlier.raised.doubled += 1;
                continue;
            }
            let smoother = agreed(ranks, smoother)?;
            let attempt = self.attempt((tree, &halos), cycle, (&problem, smoother), before.as_mut())?;
            let weak = gathered(ranks, &self.weak_cells(tree, &problem, &attempt));
            let Some(&[_, _, body, share]) = weak.first() else {
                return self.finished((tree, &problem), attempt, &earlier, before);
            };
            let rounds = earlier.raised.solved_again;
            if rounds == MOST_ROUNDS {
                attempt.report.map_err(FlowError::Krylov)?;
                let (body, share) = (body as usize, f64::from_bits(share));
                return Err(FlowError::WeakSurface { body, share, rounds });
            }
            earlier.raised.cells += weak.len();
            earlier.raised.solved_again += 1;
            earlier.iterations += attempt.report.as_ref().map_or(0, |report| report.iterations);
            method = method.raised(self.found(tree, &weak).into_iter());
            cycle = attempt.cycle;
        }
    }

    /// With penalties twice as large, if blocks of any rank show that they are too small.
    fn stiffened<T>(&self, method: &PartMethod, smoother: &Result<T, StokesError>) -> Option<PartMethod> {
        let is_weak = matches!(smoother, Err(StokesError::SurfaceBlock { .. } | StokesError::AtSurface(_)));
        let weak = self.shared.ranks.all_gather(&[u64::from(is_weak)]);
        if weak.contains(&1) { method.stiffened() } else { None }
    }

    fn problem(&self, tree: &ImplicitTree<'_, D>, method: &PartMethod) -> Result<Problem<D>, StokesError> {
        let rank = self.shared.ranks.rank();
        let wanted = |film: &Film<D>| owner_of_film(tree, &self.shared, film) == rank;
        let problem = method.problem(&self.discretisation, &self.bodies.balls, self.flow.viscosity, &wanted);
        let mut problem = self.named(problem)?;
        if !self.shared.held.is_empty() {
            let held: Vec<bool> = self.given.iter().map(|given| given.twist().is_some()).collect();
            problem.system.space.hold(&held);
        }
        Ok(problem)
    }

    /// With the numbers of bodies among all.
    fn named<T>(&self, outcome: Result<T, StokesError>) -> Result<T, StokesError> {
        outcome.map_err(|error| error.with_bodies(|place| self.bodies.ids[place] as usize))
    }

    /// The flow with the penalties of a problem. All ranks call this.
    fn attempt(
        &self,
        (tree, halos): (&ImplicitTree<'_, D>, &PartHalos),
        cycle: VCycle<D>,
        (problem, smoother): (&Problem<D>, AssembledSmoother<'_, D>),
        before: Option<&mut Moved>,
    ) -> Result<Attempt<D>, FlowError> {
        let (ranks, system) = (self.shared.ranks, &problem.system);
        let mut sizes = self.sizes.clone();
        if let Some(finest) = sizes.last_mut() {
            [finest.neighbours, finest.ghost_nodes] = halos.neighbours::<D>();
        }
        let smoother = agreed(
            ranks,
            self.named(smoother.completed([halos.of_system[1].clone(), halos.of_twist_blocks.clone()])),
        )?;
        let rigid = &cycle.levels[cycle.levels.len() - 1].space;
        let surfaces = SurfaceCorrection::with_smoother(smoother, &system.space, rigid);
        let cycle = cycle.with_surfaces(surfaces);
        let schur = self.named(problem.schur_inverse(&cycle)).map_err(FlowError::agreed)?;
        let all = (self.shared.bodies.balls().len(), self.shared.held);
        let network = agreed(ranks, network(ranks, system, &self.bodies, all))?;
        let (lift, mut b) = self.data(problem)?;
        let mut x = self.guess((tree, problem), &b, before);
        system.complete(&mut b);
        let mut solver = MultigridSolver::of_parts(system, (cycle, schur), network, self.flow.max_iterations);
        let before = ranks.traffic();
        let report = match solver.solve(system, &b, &mut x, self.flow.tolerance) {
            Err(StokesError::Krylov(error)) => Err(error),
            other => Ok(other.map_err(FlowError::agreed)?),
        };
        let solve_traffic = ranks.traffic().since(before);
        let [mut velocity, pressure, mut whole] = fields(problem, &halos.around, &lift, x);
        let integrals = self.integrals(problem, [&velocity, &pressure]);
        let mean_velocity = self.mean_flow(problem, [&mut velocity, &mut whole], &integrals);
        let wrenches = self.wrenches(problem, &velocity, &whole)?;
        let wants_stress = self.conditions.stress;
        let stress = wants_stress.then(|| {
            let mean = integrals.pressure / integrals.volume;
            let pressure: Vec<f64> = pressure.iter().map(|p| p - mean).collect();
            self.stress(problem, [&velocity, &pressure], &whole)
        });
        let stress = stress.transpose()?;
        Ok(Attempt {
            cycle: solver.into_cycle().ok_or_else(|| FlowError::of_all(StokesError::NotPrepared))?,
            velocity,
            pressure,
            deviation: self.keeps.then(|| problem.deviation(&whole)),
            wrenches,
            mean_velocity,
            stress,
            sizes,
            report,
            setup_traffic: before.since(self.start),
            solve_traffic,
        })
    }

    /// The vector that a solve with the sums `b` over own cells as its right-hand side starts from. All
    /// ranks call this.
    fn guess(
        &self,
        (tree, problem): (&ImplicitTree<'_, D>, &Problem<D>),
        b: &[f64],
        before: Option<&mut Moved>,
    ) -> Vec<f64> {
        let system = &problem.system;
        let Some(before) = before else { return vec![0.0; system.dim()] };
        let bodies = system.bodies_with_films();
        let fields = before.near((tree, &self.shared), &self.bodies, &bodies);
        let mut halo = system.halo_of_velocities().clone();
        let mut x = problem.guess(fields, b, &mut |x| halo.update(x));
        system.halo().clear(&mut x);
        x
    }

    /// The field that carries the data, and the sums over own cells of the right-hand side.
    fn data(&self, problem: &Problem<D>) -> Result<(Vec<f64>, Vec<f64>), FlowError> {
        let wrenches: Vec<Wrench<D>> = self.given.iter().filter_map(GivenOf::wrench).collect();
        let bodies = match self.conditions.bodies {
            Given::Wrenches([]) => Given::Wrenches(&[]),
            _ if self.shared.held.is_empty() => Given::Wrenches(&wrenches),
            _ => Given::Each(&self.given),
        };
        let data = problem.data_under(&Conditions { bodies, ..*self.conditions });
        let (lift, b) = agreed(self.shared.ranks, self.named(data))?;
        Ok((lift, b))
    }

    /// The flow, and what the next one may start from.
    fn finished(
        &self,
        (tree, problem): (&ImplicitTree<'_, D>, &Problem<D>),
        attempt: Attempt<D>,
        earlier: &Before,
        before: Option<Moved>,
    ) -> Result<(MyFlow<D>, Option<Arc<WarmStart<D>>>), FlowError> {
        let Attempt { velocity, pressure, deviation, sizes, report, .. } = attempt;
        let (report, level) = (report.map_err(FlowError::Krylov)?, &self.level);
        let here = (tree, &self.shared);
        let kept = deviation.map(|last| WarmStart::new(here, level, &self.bodies, last, before).into());
        let (points, nodal) = (&level.velocity, level.nodal_dim());
        let counts = counts_of_all(level, self.shared.ranks);
        let reference = if report.reference > 0.0 { report.reference } else { 1.0 };
        let flow = MyFlow {
            points: points.owned.clone().map(|node| points.map.point(node)).collect(),
            velocity: velocity[..nodal].as_chunks::<D>().0[points.owned.clone()]
                .iter()
                .map(|&u| u.into())
                .collect(),
            pressure: pressure[level.pressure.owned.clone()].to_vec(),
            twists: self.twists_of_all(problem, &velocity),
            cell_count: counts[0] as usize,
            dof_count: counts[1] as usize,
            solve_count: earlier.raised.solved_again + 1,
            raised_penalties: earlier.raised,
            iterations: earlier.iterations + report.iterations,
            relative_residual: report.residuals.last().map_or(0.0, |last| last / reference),
            wrenches: attempt.wrenches,
            mean_velocity: attempt.mean_velocity,
            mean_force: Vector::zeros(),
            stress: attempt.stress,
            levels: sizes,
            setup_traffic: attempt.setup_traffic,
            solve_traffic: attempt.solve_traffic,
            cells: MyCells::new(level, self.flow.viscosity, velocity[..nodal].to_vec(), pressure),
        };
        Ok((flow, kept))
    }
}

/// Velocity and pressure of the part and the vector that they belong to, right at all cells around own ones
/// that are cut, from a vector that is zero at ghosts, whose pressures lose their mean.
fn fields<const D: usize>(problem: &Problem<D>, around: &Halo, lift: &[f64], mut x: Vec<f64>) -> [Vec<f64>; 3]
where
    Dim<D>: Space<D>,
{
    let system = &problem.system;
    let [_, p, _] = system.parts_mut(&mut x);
    system.pressure.remove_mean(p);
    system.halo().clone().update(&mut x);
    around.clone().update(&mut x);
    [problem.velocity(lift, &x), problem.pressure(&x), x]
}
