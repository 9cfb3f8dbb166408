//! The flow around rigid bodies: prediction after prediction, in one of the [`Formulation`]s.

mod adaptive_penalty;
mod balance;
mod conditions;
mod fields;
mod mean;
mod prepared;
mod raised;
mod refinement;
mod step;
mod stress;
mod times;
mod warm_start;

use std::sync::Arc;
use std::time::Instant;

use gluey_fem::TreeMesh;
use gluey_geom::{Matrix, Twist, Vector, Wrench};
use gluey_levelset::{Ball, Body};
use gluey_parallel::Traffic;

use crate::error::StokesError;
use crate::film::{FilmForce, Lubrication};
use crate::formulation::{FlowData, Formulation, Method, Problem, check_viscosity};
use crate::solver::{SaddleSolver, SolveReport, SolverKind};
use crate::space::{Discretisation, solid_nodes};
use stress::stress_of;
use warm_start::WarmStart;

pub(crate) use conditions::added;
pub use conditions::{Conditions, Field, Given, GivenOf};
pub use prepared::Prepared;
pub use raised::RaisedPenalties;
pub use refinement::Refinement;
pub(crate) use step::FlowsOfStep;
pub use stress::Stress;
pub use times::PhaseTimes;
pub use warm_start::{NodalFields, WarmStartError};

/// Parameters of a [`FlowSolver`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowParams {
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// How rigidity is imposed.
    pub formulation: Formulation,
    /// Linear solver.
    pub solver: SolverKind,
    /// Relative tolerance of a solve: Euclidean norm of the residual, relative to that of the undisturbed
    /// flow in the rows of fluid and bodies. Rows of motions in films hold exactly.
    pub tolerance: f64,
}

impl FlowParams {
    /// The usual choice in 2D or 3D: a fluid of viscosity one, true surfaces with lubrication below the cell,
    /// the direct solver in 2D and multigrid in 3D, to 1e-6.
    pub fn for_dimension(dimension: usize) -> Self {
        Self {
            viscosity: 1.0,
            formulation: Formulation::Unfitted { lubrication: Lubrication::Deficit },
            solver: if dimension == 2 { SolverKind::Direct } else { SolverKind::Multigrid },
            tolerance: 1e-6,
        }
    }
}

/// A computed flow.
#[derive(Clone, Debug)]
pub struct Flow<const D: usize> {
    /// Mesh and nodes.
    pub discretisation: Discretisation<D>,
    /// Nodal velocities, `D` interleaved components; inside bodies see [`Flow::velocity_with_bodies`].
    pub velocity: Vec<f64>,
    /// Pressure at the pressure nodes; its mean over the nodes is zero.
    pub pressure: Vec<f64>,
    /// Multiplier of the rigidity, a nodal velocity field; empty but in `paper`.
    pub multiplier: Vec<f64>,
    /// Velocity and spin of each body.
    pub twists: Vec<Twist<D>>,
    /// Force and torque on each body by something other than the fluid: those given, or those that hold it
    /// at the twist given.
    pub wrenches: Vec<Wrench<D>>,
    /// Strain of the linear flow that velocities, spins and pressures are relative to; zero for none.
    pub strain: Matrix<D>,
    /// Mean velocity of fluid and bodies over the box, relative to the linear flow, where bodies are held
    /// (`unfitted` only; elsewhere conditions at the border give it).
    pub mean_velocity: Option<Vector<D>>,
    /// The uniform force per unit of volume that [`Conditions::without_mean_flow`] found; zero elsewhere.
    pub mean_force: Vector<D>,
    /// Stress of the suspension, where [`Conditions::with_stress`] asked for it.
    pub stress: Option<Stress<D>>,
    /// What films too thin for the mesh exert on bodies and walls, where lubrication theory gives it; on
    /// ranks each has some.
    pub films: Vec<FilmForce<D>>,
    /// Linear solves made.
    pub solve_count: usize,
    /// Krylov iterations or refinements over all solves.
    pub iteration_count: usize,
    /// Norm of the last solve's residual over what it is relative to, see
    /// [`crate::StokesSystem::fluid_norm`].
    pub residual: f64,
    /// Applications of the operator over all solves, see [`crate::SolveReport::fine_operator_applications`].
    pub fine_operator_applications: f64,
    /// What the rank sent in the solves.
    pub solve_traffic: Traffic,
    /// Where the time went.
    pub times: PhaseTimes,
}

impl<const D: usize> Flow<D> {
    /// Counts the effort of an earlier flow of the same step as well.
    pub(crate) fn count_effort_of(&mut self, earlier: &Self) {
        self.solve_count += earlier.solve_count;
        self.iteration_count += earlier.iteration_count;
        self.fine_operator_applications += earlier.fine_operator_applications;
        self.solve_traffic = self.solve_traffic + earlier.solve_traffic;
        self.times = self.times + earlier.times;
    }

    /// The nodal velocities with the motion of the `bodies`, those of the flow, at all nodes inside these:
    /// for pictures. In `unfitted` [`Flow::velocity`] continues the fluid's polynomials there, which give the
    /// velocity of the fluid in the cells that surfaces cut.
    pub fn velocity_with_bodies(&self, bodies: &[Ball<D>]) -> Vec<f64> {
        let nodes = &self.discretisation.velocity;
        let mut velocity = self.velocity.clone();
        for (node, body) in solid_nodes(&self.discretisation, bodies, 0.0).into_iter().enumerate() {
            let Some(body) = body.map(|body| body as usize) else { continue };
            let motion = self.twists[body].velocity_at(&bodies[body].arm(&nodes.point(node)));
            velocity[node * D..][..D].copy_from_slice(motion.as_slice());
        }
        velocity
    }
}

/// Computes flows one after the other, keeping what can be reused.
pub struct FlowSolver<const D: usize> {
    params: FlowParams,
    /// For free bodies, and where any is held.
    solvers: [Box<dyn SaddleSolver<D> + Send>; 2],
    method: Arc<dyn Method<D>>,
    /// The last mesh, which the next one is often equal to.
    discretisation: Option<Discretisation<D>>,
    warm_start: Option<WarmStart<D>>,
    raised_penalties: RaisedPenalties,
}

/// Effort of the solves of one prediction.
#[derive(Default)]
struct SolveEffort {
    solve_count: usize,
    iteration_count: usize,
    residual: f64,
    fine_operator_applications: f64,
    traffic: Traffic,
}

impl SolveEffort {
    fn add(&mut self, report: &SolveReport, traffic: Traffic) {
        self.traffic = self.traffic + traffic;
        let norm = report.reference;
        self.residual = report.residuals.last().filter(|_| norm > 0.0).map_or(0.0, |last| last / norm);
        self.solve_count += 1;
        self.iteration_count += report.iterations;
        self.fine_operator_applications += report.fine_operator_applications;
    }
}

impl<const D: usize> FlowSolver<D> {
    /// A solver with the given parameters.
    ///
    /// # Errors
    /// [`StokesError::Parameter`] for values out of range.
    pub fn new(params: FlowParams) -> Result<Self, StokesError> {
        check(&params)?;
        let method = params.formulation.method()?;
        let solvers = [(); 2].map(|()| params.solver.solver());
        Ok(Self {
            params,
            solvers,
            method,
            discretisation: None,
            warm_start: None,
            raised_penalties: RaisedPenalties::default(),
        })
    }

    /// Flow on `mesh` around `bodies` with the velocity `boundary(x)` on the outer boundary; the same
    /// function, which must be divergence-free, is the undisturbed flow inside.
    pub fn solve(
        &mut self,
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
        boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
    ) -> Result<Flow<D>, StokesError> {
        self.solve_forced(mesh, bodies, boundary, None)
    }

    /// The flow under a force `f(x)` per unit of volume, on fluid and bodies alike:
    /// `-div(2 eta eps(u)) + grad p = f`.
    pub fn solve_forced(
        &mut self,
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
        boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
        force: Option<&dyn Fn(&Vector<D>) -> Vector<D>>,
    ) -> Result<Flow<D>, StokesError> {
        self.solve_under(mesh, bodies, &Conditions::boundary(boundary).with_force(force))
    }

    /// The flow under any conditions. Where the solver is iterative it starts from the last flow, which is
    /// meant for bodies that move on in small steps; for several flows around the same ones see
    /// [`FlowSolver::prepared`].
    ///
    /// # Errors
    /// Those of [`FlowSolver::prepared`] and [`Prepared::solve`].
    pub fn solve_under(
        &mut self,
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
        conditions: &Conditions<'_, D>,
    ) -> Result<Flow<D>, StokesError> {
        let start = Instant::now();
        let discretisation = self.discretised(mesh);
        let numbered = start.elapsed().as_secs_f64();
        let mut flow = self.solve_on(&discretisation, bodies, conditions)?;
        flow.times.assembly += numbered;
        Ok(flow)
    }

    /// The same on a mesh whose nodes are known, or on the part of it that a rank has. All ranks call this,
    /// with the same bodies and conditions.
    ///
    /// # Errors
    /// As above, on all ranks.
    pub fn solve_on(
        &mut self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
        conditions: &Conditions<'_, D>,
    ) -> Result<Flow<D>, StokesError> {
        self.flows_of_step(discretisation, bodies).solve(conditions)
    }

    fn problem(
        &self,
        discretisation: &Discretisation<D>,
        bodies: &[Ball<D>],
    ) -> Result<Problem<D>, StokesError> {
        Problem::on(discretisation, bodies, self.params.viscosity, self.method.as_ref())
    }

    /// The solver for free bodies, or for where any is held.
    fn solver(&mut self, problem: &Problem<D>) -> &mut Box<dyn SaddleSolver<D> + Send> {
        &mut self.solvers[usize::from(problem.system.space.holds_any())]
    }

    /// The flow under some conditions from the guess `x`, which becomes the reduced vector that it belongs
    /// to.
    fn solved(
        &mut self,
        problem: &Problem<D>,
        conditions: &Conditions<'_, D>,
        [lift, b]: [&[f64]; 2],
        x: &mut [f64],
    ) -> Result<Flow<D>, StokesError> {
        let (mut effort, tolerance) = (SolveEffort::default(), self.params.tolerance);
        let (solver, system) = (self.solver(problem), &problem.system);
        let mut solve = |b: &[f64], x: &mut [f64], tightening: f64| {
            let before = problem.discretisation().traffic();
            let report = solver.solve(system, b, x, tolerance * tightening);
            system.update(x);
            effort.add(&report?, problem.discretisation().traffic().since(before));
            Ok(())
        };
        let multiplier = problem.rigidity.solve(problem, &FlowData { lift, b }, x, &mut solve)?;
        flow_of(problem, conditions, lift, x, multiplier, &effort)
    }

    /// The same on parts of meshes, of which the levels below the one with the bodies are `coarser`; a solve
    /// is given up after so many iterations.
    ///
    /// # Errors
    /// [`StokesError::Unsupported`] for solvers on whole meshes only.
    pub fn on_parts(
        mut self,
        coarser: &[Discretisation<D>],
        max_iterations: usize,
    ) -> Result<Self, StokesError> {
        self.solvers.iter_mut().try_for_each(|solver| solver.share(coarser, max_iterations))?;
        Ok(self)
    }

    /// Viscosity of the fluid.
    pub fn viscosity(&self) -> f64 {
        self.params.viscosity
    }

    /// The nodes of a mesh: those of the last one, if it is the same.
    pub fn discretised(&mut self, mesh: TreeMesh<D>) -> Discretisation<D> {
        let kept = self.discretisation.take().filter(|last| *last.mesh == mesh);
        let discretisation = kept.unwrap_or_else(|| Discretisation::new(mesh));
        self.discretisation = Some(discretisation.clone());
        discretisation
    }

    /// The deviations from the undisturbed flow that the next solve starts from, where the solver is
    /// iterative: the last one, and the one before on the same mesh.
    pub fn warm_start(&self) -> Option<(&NodalFields, Option<&NodalFields>)> {
        self.warm_start.as_ref().map(WarmStart::fields)
    }

    /// Restores what [`FlowSolver::warm_start`] gave, on the mesh it belongs to.
    ///
    /// # Errors
    /// If the lengths do not fit; the solver is as before then.
    pub fn set_warm_start(
        &mut self,
        mesh: TreeMesh<D>,
        last: NodalFields,
        before: Option<NodalFields>,
    ) -> Result<(), WarmStartError> {
        self.start_from(Discretisation::new(mesh), last, before)
    }

    /// The same on a mesh whose nodes are known, or on the part of it that a rank has.
    ///
    /// # Errors
    /// As above.
    pub fn start_from(
        &mut self,
        discretisation: Discretisation<D>,
        last: NodalFields,
        before: Option<NodalFields>,
    ) -> Result<(), WarmStartError> {
        self.warm_start = Some(WarmStart::restore(discretisation, last, before)?);
        Ok(())
    }

    /// The initial guess, and the last flow on its mesh; zero and nothing at the first step.
    fn initial_guess(
        &self,
        problem: &Problem<D>,
        conditions: &Conditions<'_, D>,
    ) -> Result<(Vec<f64>, Option<NodalFields>), StokesError> {
        match &self.warm_start {
            Some(warm) if self.params.solver == SolverKind::Multigrid => {
                // Only forces of terms need it.
                let b = match problem.system.row_count() {
                    0 => Vec::new(),
                    _ => conditions.data(problem)?.1,
                };
                let (guess, last) = warm.moved(problem.discretisation()).into_guess(&problem.system, &b);
                Ok((guess, Some(last)))
            }
            _ => Ok((gluey_linalg::parallel::filled(0.0, problem.system.dim()), None)),
        }
    }

    /// Keeps the solution for the next guess, where the solver is iterative.
    fn keep_for_next(
        &mut self,
        problem: &Problem<D>,
        x: &[f64],
        pressure: &[f64],
        before: Option<NodalFields>,
    ) {
        if self.params.solver == SolverKind::Multigrid {
            let last = NodalFields::of(&problem.system, x, pressure.to_vec());
            let before = before.or_else(|| self.warm_start.take().and_then(WarmStart::into_before));
            self.warm_start = Some(WarmStart::new(problem.discretisation().clone(), last, before));
        }
    }
}

/// The flow under some conditions that belongs to a lift and a reduced vector, which loses its mean velocity
/// where no equation determines it.
fn flow_of<const D: usize>(
    problem: &Problem<D>,
    conditions: &Conditions<'_, D>,
    lift: &[f64],
    x: &mut [f64],
    multiplier: Vec<f64>,
    effort: &SolveEffort,
) -> Result<Flow<D>, StokesError> {
    let mut pressure = problem.pressure_and_films(x);
    let mut velocity = problem.velocity(lift, x);
    let space = &problem.system.space;
    let mut mean_velocity = None;
    if let Some(surfaces) = problem.system.surfaces()
        && space.holds_any()
    {
        mean_velocity = Some(mean::mean_velocity(problem, surfaces, &velocity)?);
    }
    if let (false, Some(surfaces)) = (space.is_anchored(), problem.system.surfaces()) {
        let mean = mean::mean_velocity(problem, surfaces, &velocity)?;
        mean::subtract(space, &mut velocity, &mean, |_| true);
        // Guesses made of solutions would let what no equation determines grow from step to step.
        mean::subtract(space, x, &mean, |node| space.is_free(node));
    }
    let twists = problem.twists(&velocity)?;
    let wrenches = conditions.wrenches(problem, &velocity, &pressure)?;
    let stress = conditions.stress.then(|| stress_of(problem, &conditions.strain, [&velocity, &pressure], x));
    let stress = stress.transpose()?;
    velocity.truncate(problem.system.space.full_dim());
    pressure.truncate(problem.system.pressure.dim());
    let body_number = |body: u32| problem.discretisation().body_number(body);
    let flow = Flow {
        discretisation: problem.discretisation().clone(),
        velocity,
        pressure,
        multiplier,
        twists,
        wrenches,
        strain: conditions.strain,
        mean_velocity,
        mean_force: Vector::zeros(),
        stress,
        films: problem.film_forces(x).into_iter().map(|force| force.renumbered(body_number)).collect(),
        solve_count: effort.solve_count,
        iteration_count: effort.iteration_count,
        residual: effort.residual,
        fine_operator_applications: effort.fine_operator_applications,
        solve_traffic: effort.traffic,
        times: PhaseTimes::default(),
    };
    Ok(flow)
}

fn check(params: &FlowParams) -> Result<(), StokesError> {
    let wrong = |name, value, wanted| Err(StokesError::Parameter { name, value, wanted });
    check_viscosity(params.viscosity)?;
    if !(params.tolerance > 0.0 && params.tolerance < 1.0) {
        return wrong("tolerance", params.tolerance, "must lie between 0 and 1");
    }
    params.formulation.check()
}
