//! Flows with penalties that are large enough.
//!
//! Flows without mean flow around bodies that are held in a box without walls are as in one process: the flow
//! is linear in a uniform force on fluid and bodies, and the matrix of the mean velocities that unit forces
//! drive is the permeability.

use std::sync::Arc;

use gluey_fem::{Cell, Cuts, ImplicitTree};
use gluey_geom::{Dim, Matrix, Space, Vector};
use gluey_levelset::{Ball, BallTree, Body};
use gluey_parallel::{Communicator, Ranks};
use gluey_stokes::part::{AssembledSmoother, MOST_ROUNDS, PartMethod, VCycle, rings_around_surfaces};
use gluey_stokes::{Conditions, Film, GivenOf, Lubrication, Problem, StokesError};

use super::conditions::{check_count, given};
use super::context::{SharedTree, SolveContext, SurfaceBodies};
use super::space::{PartHalos, is_near_surface, owner_of_film};
use super::trial::Trial;
use super::weak::Before;
use crate::agreement::{agreed, gathered};
use crate::bodies::Shared;
use crate::cells::LocalFields;
use crate::flow::{BoxFlow, FlowError, LocalFlow, counts_of_all};
use crate::levels::Levels;
use crate::space::GhostLayer;
use crate::warm_start::{TransferredFlows, WarmStart};

impl BoxFlow {
    /// The flow with the velocity `walls` on the walls of the box. All ranks call this with the same tree and
    /// cuts. The function is also taken for the undisturbed flow inside.
    ///
    /// # Errors
    /// [`FlowError`], on all ranks; [`FlowError::NoWall`] in a box that is periodic in all directions.
    pub fn solve<const D: usize>(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        cuts: &Cuts,
        ranks: &Ranks,
        walls: &dyn Fn(&Vector<D>) -> Vector<D>,
    ) -> Result<LocalFlow<D>, FlowError>
    where
        Dim<D>: Space<D>,
    {
        if tree.frame().periodic().into_iter().all(|is_periodic| is_periodic) {
            return Err(FlowError::NoWall);
        }
        let none = SurfaceBodies { balls: &[], lubrication: Lubrication::None };
        self.solve_around_surfaces(&none, tree, cuts, ranks, &Conditions::boundary(walls))
    }

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
    ) -> Result<LocalFlow<D>, FlowError>
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
    ) -> Result<LocalFlow<D>, FlowError>
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
        let wide = GhostLayer { rings, spreads: &spreads };
        let Levels { cycle, finest: level, discretisation, bodies, sizes } =
            Levels::new(tree, &shared, self.viscosity, &wide)?;
        let setting = SolveContext {
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

    /// The flow with a uniform force so that nothing flows on the mean; what is kept is the flow without that
    /// force. All ranks call this.
    ///
    /// # Errors
    /// [`FlowError`], on all ranks. [`FlowError::Conditions`] unless bodies are held in a box without walls,
    /// and for stresses.
    fn balanced<const D: usize>(
        &self,
        around: &SurfaceBodies<'_, D>,
        leaves: &mut SharedTree<'_, '_, D>,
        conditions: &Conditions<'_, D>,
        kept: Option<&mut Option<Arc<WarmStart<D>>>>,
    ) -> Result<LocalFlow<D>, FlowError>
    where
        Dim<D>: Space<D>,
    {
        let held = conditions.held(around.balls.len());
        if held.is_empty() || conditions.stress || leaves.tree.frame().periodic().contains(&false) {
            return Err(FlowError::Conditions);
        }
        let first = Conditions { without_mean: false, ..*conditions };
        let mut flow = self.solve_from(around, leaves, &first, kept)?;
        let at_rest: Vec<GivenOf<D>> = held.into_iter().map(GivenOf::at_rest).collect();
        let (mut permeability, mut driven) = (Matrix::<D>::zeros(), Vec::new());
        for axis in 0..D {
            let unit = Vector::<D>::from_fn(|d, _| if d == axis { 1.0 } else { 0.0 });
            let force = |_: &Vector<D>| unit;
            let conditions = Conditions::at_rest().with_force(Some(&force)).with_bodies(&at_rest);
            let one = self.solve_from(around, leaves, &conditions, None)?;
            permeability.set_column(axis, &one.mean_velocity.unwrap_or_else(Vector::zeros));
            driven.push(one);
        }
        let Some(inverse) = permeability.try_inverse() else {
            let what = "flows without mean flow around bodies that let nothing through";
            return Err(FlowError::of_all(StokesError::Unsupported { what }));
        };
        let mean = flow.mean_velocity.unwrap_or_else(Vector::zeros);
        flow.mean_force = -(inverse * mean);
        for (factor, driven) in flow.mean_force.iter().copied().collect::<Vec<f64>>().into_iter().zip(&driven)
        {
            flow.add(factor, driven);
        }
        flow.mean_velocity = Some(mean + permeability * flow.mean_force);
        Ok(flow)
    }
}

impl<'a, const D: usize> SolveContext<'_, 'a, D>
where
    Dim<D>: Space<D>,
{
    /// The flow with penalties that are large enough, as in one process.
    fn trusted(
        &self,
        tree: &mut ImplicitTree<'_, D>,
        mut cycle: VCycle<D>,
        mut method: PartMethod,
        mut before: Option<TransferredFlows>,
    ) -> Result<(LocalFlow<D>, Option<Arc<WarmStart<D>>>), FlowError> {
        let (ranks, mut earlier) = (self.shared.ranks, Before::default());
        loop {
            let mut problem = agreed(ranks, self.problem(tree, &method))?;
            let halos = PartHalos::new(tree, &self.shared, &self.level, &problem);
            problem.system.share(halos.of_system.clone());
            let smoother = self.named(AssembledSmoother::new(&problem));
            if let Some(stiffer) = self.stiffened(&method, &smoother) {
                method = stiffer;
                earlier.raised.doubled += 1;
                continue;
            }
            let of_smoother = [halos.of_system[1].clone(), halos.of_twist_blocks.clone()];
            let smoother = agreed(ranks, self.named(agreed(ranks, smoother)?.completed(of_smoother)))?;
            let cycle_around = cycle.with_surfaces(smoother, &problem.system.space);
            let trial = self.trial(tree, &halos, cycle_around, &problem, before.as_mut())?;
            let weak = gathered(ranks, &self.weak_cells(tree, &problem, &trial));
            let Some(&[_, _, body, share]) = weak.first() else {
                return self.finished((tree, &problem), trial, &earlier, before);
            };
            let rounds = earlier.raised.solved_again;
            if rounds == MOST_ROUNDS {
                trial.report.map_err(FlowError::Krylov)?;
                let (body, share) = (body as usize, f64::from_bits(share));
                return Err(FlowError::WeakSurface { body, share, rounds });
            }
            earlier.raised.cells += weak.len();
            earlier.raised.solved_again += 1;
            earlier.iterations += trial.report.as_ref().map_or(0, |report| report.iterations);
            method = method.raised(self.found(tree, &weak).into_iter());
            cycle = trial.cycle;
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

    /// The flow, and what the next one may start from.
    fn finished(
        &self,
        (tree, problem): (&ImplicitTree<'_, D>, &Problem<D>),
        trial: Trial<D>,
        earlier: &Before,
        before: Option<TransferredFlows>,
    ) -> Result<(LocalFlow<D>, Option<Arc<WarmStart<D>>>), FlowError> {
        let Trial { velocity, pressure, deviation, sizes, report, .. } = trial;
        let (report, level) = (report.map_err(FlowError::Krylov)?, &self.level);
        let here = (tree, &self.shared);
        let kept = deviation.map(|last| WarmStart::new(here, level, &self.bodies, last, before).into());
        let (points, nodal) = (&level.velocity, level.nodal_dim());
        let counts = counts_of_all(level, self.shared.ranks);
        let reference = if report.reference > 0.0 { report.reference } else { 1.0 };
        let flow = LocalFlow {
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
            wrenches: trial.wrenches,
            mean_velocity: trial.mean_velocity,
            mean_force: Vector::zeros(),
            stress: trial.stress,
            levels: sizes,
            setup_traffic: trial.setup_traffic,
            solve_traffic: trial.solve_traffic,
            cells: LocalFields::new(level, self.flow.viscosity, velocity[..nodal].to_vec(), pressure),
        };
        Ok((flow, kept))
    }
}
