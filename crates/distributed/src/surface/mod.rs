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
mod operator;
mod precondition;
mod space;
mod sums;
mod weak;

use std::sync::Arc;

use gluey_fem::{Cell, Cuts, ImplicitTree};
use gluey_geom::{Dim, Space, Vector, Wrench};
use gluey_levelset::{Ball, BallTree, Body};
use gluey_linalg::{Gcr, GcrParams, KrylovError, KrylovReport, Reference, vector};
use gluey_parallel::{Communicator, Ranks, Traffic};
use gluey_stokes::part::{
    AssembledSmoother, MOST_ROUNDS, PartMethod, RESTART, SurfaceCorrection, VCycle, rings_around_surfaces,
};
use gluey_stokes::{
    Conditions, Discretisation, Film, Given, GivenOf, Lubrication, NodalFields, Problem, StokesError,
    StokesSystem, Stress,
};

use crate::agreement::{agreed, gathered};
use crate::bodies::{NearBodies, Shared};
use crate::cells::MyCells;
use crate::flow::{BoxFlow, FlowError, LevelSizes, MyFlow, counts_of_all};
use crate::levels::Levels;
use crate::schur::{Flowing, PressureCells, SchurInverse};
use crate::space::{Around, LevelSpace};
use crate::warm_start::{Moved, WarmStart};
use conditions::{check_count, given};
use films::{corrections, network};
use operator::SurfaceOperator;
use precondition::SurfaceTriangular;
use space::{SurfaceSpace, is_near_surface, owner_of_film};
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
struct Attempt<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    cycle: VCycle<D>,
    space: SurfaceSpace<'a, D>,
    /// Values at all nodes of the part, those of the velocity followed by the twists near it.
    velocity: Vec<f64>,
    pressure: Vec<f64>,
    /// What the next flow may start from.
    deviation: Option<NodalFields>,
    wrenches: Vec<Wrench<D>>,
    mean_velocity: Option<Vector<D>>,
    stress: Option<Stress<D>>,
    sizes: Vec<LevelSizes>,
    report: Result<KrylovReport, KrylovError>,
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
            let problem = agreed(ranks, self.problem(tree, &method))?;
            let smoother = self.named(AssembledSmoother::new(&problem));
            if let Some(stiffer) = self.stiffened(&method, &smoother) {
                method = stiffer;
                earlier.raised.doubled += 1;
                continue;
            }
            let smoother = agreed(ranks, smoother)?;
            let attempt = self.attempt(tree, cycle, (&problem, smoother), before.as_mut())?;
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
        tree: &mut ImplicitTree<'_, D>,
        cycle: VCycle<D>,
        (problem, smoother): (&Problem<D>, AssembledSmoother<'_, D>),
        before: Option<&mut Moved>,
    ) -> Result<Attempt<'a, D>, FlowError> {
        let (ranks, system) = (self.shared.ranks, &problem.system);
        let space = SurfaceSpace::new(tree, &self.shared, &self.level, (problem, &self.bodies));
        let mut sizes = self.sizes.clone();
        if let Some(finest) = sizes.last_mut() {
            [finest.neighbours, finest.ghost_nodes] = space.neighbours();
        }
        let smoother = agreed(ranks, self.named(smoother.completed(space.halos())))?;
        let rigid = &cycle.levels[cycle.levels.len() - 1].space;
        let surfaces = SurfaceCorrection::with_smoother(smoother, &system.space, rigid);
        let cycle = cycle.with_surfaces(surfaces);
        let schur = self.schur(tree, system, &space)?;
        let all = (self.shared.bodies.balls().len(), self.shared.held);
        let network = agreed(ranks, network(ranks, system, &self.bodies, all))?;
        let [of_iterates, of_steps] = corrections(network.as_ref(), &space, (&self.bodies, all.0))?;
        let mut operator = SurfaceOperator::new(system, space.clone(), of_iterates);
        let mut preconditioner = SurfaceTriangular::new(system, space, cycle, schur, of_steps);
        let (lift, [whole, b]) = self.data(problem, &mut operator)?;
        let mut x = self.guess((tree, problem), &mut operator.space, &whole, before);
        drop(whole);
        let before = ranks.traffic();
        let report = self.krylov(&mut operator, &mut preconditioner, &b, &mut x);
        let solve_traffic = ranks.traffic().since(before);
        let mut space = operator.into_space();
        let [mut velocity, pressure, mut whole] = self.fields(problem, &mut space, &lift, &mut x);
        let integrals = self.integrals(problem, [&velocity, &pressure]);
        let mean_velocity = self.mean_flow(problem, &space, [&mut velocity, &mut whole], &integrals);
        let wrenches = self.wrenches(problem, &velocity, &whole)?;
        let wants_stress = self.conditions.stress;
        let stress = wants_stress.then(|| {
            let mean = integrals.pressure / integrals.volume;
            let pressure: Vec<f64> = pressure.iter().map(|p| p - mean).collect();
            self.stress(problem, [&velocity, &pressure], &whole)
        });
        let stress = stress.transpose()?;
        Ok(Attempt {
            cycle: preconditioner.into_cycle(),
            space,
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

    /// The owned vector that a solve with the sums `b` over own cells as its right-hand side starts from. All
    /// ranks call this.
    fn guess(
        &self,
        (tree, problem): (&ImplicitTree<'_, D>, &Problem<D>),
        space: &mut SurfaceSpace<'a, D>,
        b: &[f64],
        before: Option<&mut Moved>,
    ) -> Vec<f64> {
        let mut x = vec![0.0; space.dim()];
        if let Some(before) = before {
            let bodies = problem.system.bodies_with_films();
            let fields = before.near((tree, &self.shared), &self.bodies, &bodies);
            let whole = problem.guess(fields, b, &mut |x| space.update_velocities(x));
            space.copy_owned(&whole, &mut x);
        }
        x
    }

    /// Velocity and pressure of the part and the vector that they belong to, from an owned one, whose
    /// pressures lose their mean.
    fn fields(
        &self,
        problem: &Problem<D>,
        space: &mut SurfaceSpace<'a, D>,
        lift: &[f64],
        x: &mut [f64],
    ) -> [Vec<f64>; 3] {
        let mut pressure = space.parts(x)[1].to_vec();
        space.pressures.remove_mean(space.ranks, &mut pressure);
        space.parts_mut(x)[1].copy_from_slice(&pressure);
        let mut whole = vec![0.0; problem.system.dim()];
        space.spread(x, &mut whole);
        space.update_around(&mut whole);
        [problem.velocity(lift, &whole), problem.pressure(&whole), whole]
    }

    fn schur(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        system: &StokesSystem<D>,
        space: &SurfaceSpace<'a, D>,
    ) -> Result<SchurInverse<'a, D>, FlowError> {
        let map = &self.level.velocity.map;
        let is_fixed = |node: usize| map.is_on_boundary(node) || system.space.body_of(node).is_some();
        let flowing = Flowing {
            own: system.own_fluid_cells().collect(),
            all: system.fluid_cells().collect(),
            is_fixed: (0..map.node_count()).map(is_fixed).collect(),
        };
        let masses = |visit: &mut dyn FnMut(usize, &[f64])| system.for_each_pressure_mass(visit);
        let cells = PressureCells { viscosity: self.flow.viscosity, flowing: &flowing, masses: &masses };
        SchurInverse::new(tree, space.ranks, &self.level, &space.pressures, &cells)
    }

    /// The field that carries the data, and the right-hand side: the sums over own cells, without what is
    /// others', and that of all.
    fn data(
        &self,
        problem: &Problem<D>,
        operator: &mut SurfaceOperator<'_, 'a, D>,
    ) -> Result<(Vec<f64>, [Vec<f64>; 2]), FlowError> {
        let wrenches: Vec<Wrench<D>> = self.given.iter().filter_map(GivenOf::wrench).collect();
        let bodies = match self.conditions.bodies {
            Given::Wrenches([]) => Given::Wrenches(&[]),
            _ if self.shared.held.is_empty() => Given::Wrenches(&wrenches),
            _ => Given::Each(&self.given),
        };
        let data = problem.data_under(&Conditions { bodies, ..*self.conditions });
        let (lift, mut whole) = agreed(self.shared.ranks, self.named(data))?;
        let mut b = vec![0.0; operator.space.dim()];
        operator.space.gather(&mut whole, &mut b);
        Ok((lift, [whole, b]))
    }

    /// Steps in double precision, as in the serial solver: in films penalties and extrapolated nodes leave
    /// large numbers that nearly cancel.
    fn krylov(
        &self,
        operator: &mut SurfaceOperator<'_, 'a, D>,
        preconditioner: &mut SurfaceTriangular<'_, 'a, D>,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<KrylovReport, KrylovError> {
        let params = GcrParams {
            relative_tolerance: self.flow.tolerance,
            max_iterations: self.flow.max_iterations,
            restart: RESTART,
            ..GcrParams::default()
        };
        let mut gcr = Gcr::<f64, f64, f32>::with_directions(params);
        let films = operator.space.parts(b)[2].len();
        let mut square = [vector::dot(&b[..b.len() - films], &b[..b.len() - films])];
        self.shared.ranks.sum(&mut square);
        gcr.solve(operator, preconditioner, b, x, Reference::Norm(square[0].sqrt()))
    }

    /// The flow, and what the next one may start from.
    fn finished(
        &self,
        (tree, problem): (&ImplicitTree<'_, D>, &Problem<D>),
        attempt: Attempt<'a, D>,
        earlier: &Before,
        before: Option<Moved>,
    ) -> Result<(MyFlow<D>, Option<Arc<WarmStart<D>>>), FlowError> {
        let Attempt { space, velocity, pressure, deviation, sizes, report, .. } = attempt;
        let (report, level) = (report.map_err(FlowError::Krylov)?, &self.level);
        let here = (tree, &self.shared);
        let kept = deviation.map(|last| WarmStart::new(here, level, &self.bodies, last, before).into());
        let (points, nodal) = (&level.velocity, level.nodal_dim());
        let counts = counts_of_all(level, space.ranks);
        let reference = if report.reference_norm > 0.0 { report.reference_norm } else { 1.0 };
        let flow = MyFlow {
            points: points.owned.clone().map(|node| points.map.point(node)).collect(),
            velocity: velocity[..nodal].as_chunks::<D>().0[points.owned.clone()]
                .iter()
                .map(|&u| u.into())
                .collect(),
            pressure: pressure[level.pressure.owned.clone()].to_vec(),
            twists: self.twists_of_all(problem, &space, &velocity),
            cell_count: counts[0] as usize,
            dof_count: counts[1] as usize,
            solve_count: earlier.raised.solved_again + 1,
            raised_penalties: earlier.raised,
            iterations: earlier.iterations + report.iterations,
            relative_residual: report.residual_norm / reference,
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
