//! A flow with the penalties that were tried.

use gluey_fem::ImplicitTree;
use gluey_geom::{Dim, Space, Vector, Wrench};
use gluey_linalg::KrylovError;
use gluey_parallel::{Communicator, Halo, Traffic};
use gluey_stokes::part::VCycle;
use gluey_stokes::{
    Conditions, Given, GivenOf, MultigridSolver, NodalFields, Problem, SaddleSolver, SolveReport,
    StokesError, Stress,
};

use super::context::SolveContext;
use super::films::network;
use super::space::PartHalos;
use crate::agreement::agreed;
use crate::flow::{FlowError, LevelSizes};
use crate::warm_start::TransferredFlows;

/// A flow with the penalties that were tried.
pub struct Trial<const D: usize>
where
    Dim<D>: Space<D>,
{
    pub cycle: VCycle<D>,
    /// Values at all nodes of the part, those of the velocity followed by the twists near it.
    pub velocity: Vec<f64>,
    pub pressure: Vec<f64>,
    /// What the next flow may start from.
    pub deviation: Option<NodalFields>,
    pub wrenches: Vec<Wrench<D>>,
    pub mean_velocity: Option<Vector<D>>,
    pub stress: Option<Stress<D>>,
    pub sizes: Vec<LevelSizes>,
    pub report: Result<SolveReport, KrylovError>,
    pub setup_traffic: Traffic,
    pub solve_traffic: Traffic,
}

impl<'a, const D: usize> SolveContext<'_, 'a, D>
where
    Dim<D>: Space<D>,
{
    /// The flow with the penalties of a problem. All ranks call this.
    pub fn trial(
        &self,
        tree: &ImplicitTree<'_, D>,
        halos: &PartHalos,
        cycle: VCycle<D>,
        problem: &Problem<D>,
        before: Option<&mut TransferredFlows>,
    ) -> Result<Trial<D>, FlowError> {
        let (ranks, system) = (self.shared.ranks, &problem.system);
        let mut sizes = self.sizes.clone();
        if let Some(finest) = sizes.last_mut() {
            [finest.neighbours, finest.ghost_nodes] = halos.neighbours::<D>();
        }
        let schur = self.named(problem.schur_inverse(&cycle)).map_err(FlowError::agreed)?;
        let network = agreed(ranks, network(system, &self.bodies, &self.shared))?;
        let (lift, mut b) = self.data(problem)?;
        let mut x = self.guess(tree, problem, &b, before);
        system.complete(&mut b);
        let mut solver = MultigridSolver::of_parts(system, cycle, schur, network, self.flow.max_iterations);
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
        Ok(Trial {
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
        tree: &ImplicitTree<'_, D>,
        problem: &Problem<D>,
        b: &[f64],
        before: Option<&mut TransferredFlows>,
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
