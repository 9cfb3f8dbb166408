//! The flow around rigid bodies: prediction after prediction, in one of two [`Formulation`]s.

use std::sync::Arc;

use gluey_fem::TreeMesh;
use gluey_geom::{Dim, Space, Twist, Vector};
use gluey_levelset::Ball;
use gluey_linalg::vector;

use crate::direct::DirectSolver;
use crate::discretisation::Discretisation;
use crate::error::StokesError;
use crate::formulation::{Formulation, PaperParams};
use crate::multigrid::MultigridSolver;
use crate::point_matrices::PointMatrices;
use crate::problem::{Problem, check_viscosity};
use crate::solver::{SaddleSolver, SolveReport};
use crate::system::StokesSystem;
use crate::warm_start::{NodalFields, WarmStart, WarmStartError};

/// Which linear solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolverKind {
    /// Sparse direct factorisation.
    Direct,
    /// Krylov method with a multigrid preconditioner.
    Multigrid,
}

/// Parameters of a [`FlowSolver`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowParams {
    /// Viscosity of the fluid.
    pub viscosity: f64,
    /// How rigidity is imposed.
    pub formulation: Formulation,
    /// Linear solver.
    pub solver: SolverKind,
    /// Relative tolerance of a solve: Euclidean norm of the residual, relative to that of the undisturbed flow.
    pub tolerance: f64,
}

/// A computed flow.
#[derive(Clone, Debug)]
pub struct Flow<const D: usize>
where
    Dim<D>: Space<D>,
{
    /// Mesh and nodes.
    pub discretisation: Discretisation<D>,
    /// Nodal velocities, `D` interleaved components.
    pub velocity: Vec<f64>,
    /// Pressure at the pressure nodes; its mean over the nodes is zero.
    pub pressure: Vec<f64>,
    /// Multiplier of the rigidity, a nodal velocity field; empty in `rigid-dofs`.
    pub multiplier: Vec<f64>,
    /// Velocity and spin of each body.
    pub twists: Vec<Twist<D>>,
    /// Linear solves made.
    pub solve_count: usize,
    /// Krylov iterations or refinements over all solves.
    pub iteration_count: usize,
    /// Applications of the operator over all solves, see [`crate::SolveReport::fine_operator_applications`].
    pub fine_operator_applications: f64,
    /// Seconds in mesh and assembly, in the preparation of the solver, and in solves, as told by the caller's clock.
    pub phases: [f64; 3],
}

/// Computes flows one after the other, keeping what can be reused.
pub struct FlowSolver<const D: usize>
where
    Dim<D>: Space<D>,
{
    params: FlowParams,
    solver: Box<dyn SaddleSolver<D> + Send>,
    matrices: Arc<PointMatrices<D>>,
    /// The last mesh, which the next one is often equal to.
    discretisation: Option<Discretisation<D>>,
    warm_start: Option<WarmStart<D>>,
    clock: fn() -> f64,
}

/// What the solves of one prediction took and left.
#[derive(Default)]
struct Effort {
    multiplier: Vec<f64>,
    solve_count: usize,
    iteration_count: usize,
    fine_operator_applications: f64,
}

impl Effort {
    fn add(&mut self, report: SolveReport) {
        self.solve_count += 1;
        self.iteration_count += report.iterations;
        self.fine_operator_applications += report.fine_operator_applications;
    }
}

impl<const D: usize> FlowSolver<D>
where
    Dim<D>: Space<D>,
{
    /// A solver with the given parameters. `clock` gives seconds for the phase table; the library itself reads no clock.
    ///
    /// # Errors
    /// [`StokesError::Parameter`] for values out of range.
    pub fn new(params: FlowParams, clock: fn() -> f64) -> Result<Self, StokesError> {
        check(&params)?;
        let solver: Box<dyn SaddleSolver<D> + Send> = match params.solver {
            SolverKind::Direct => Box::new(DirectSolver::default()),
            SolverKind::Multigrid => Box::new(MultigridSolver::default()),
        };
        let matrices = Arc::new(PointMatrices::new(params.formulation.quadrature()));
        Ok(Self { params, solver, matrices, discretisation: None, warm_start: None, clock })
    }

    /// Flow on `mesh` around `bodies` with the velocity `boundary(x)` on the outer boundary; the same function, which
    /// must be divergence-free, is the undisturbed flow inside.
    pub fn solve(
        &mut self,
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
        boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
    ) -> Result<Flow<D>, StokesError> {
        self.solve_forced(mesh, bodies, boundary, None)
    }

    /// The flow under a force `f(x)` a unit of volume, on fluid and bodies alike: `-div(2 eta eps(u)) + grad p = f`.
    pub fn solve_forced(
        &mut self,
        mesh: TreeMesh<D>,
        bodies: &[Ball<D>],
        boundary: &dyn Fn(&Vector<D>) -> Vector<D>,
        force: Option<&dyn Fn(&Vector<D>) -> Vector<D>>,
    ) -> Result<Flow<D>, StokesError> {
        let FlowParams { viscosity, formulation, .. } = self.params;
        let start = (self.clock)();
        let discretisation = self.discretised(mesh);
        let problem = Problem::on(discretisation, bodies, viscosity, formulation, &self.matrices)?;
        let prepared_from = (self.clock)();
        problem.prepare(self.solver.as_mut())?;
        let solved_from = (self.clock)();
        let lift = problem.lift(boundary);
        let b = problem.right_hand_side(&lift, force);
        let (mut x, before) = self.initial_guess(&problem.system, &problem.discretisation);
        let effort = match formulation {
            Formulation::RigidDofs { .. } => self.solve_once(&problem, &b, &mut x)?,
            Formulation::Paper(paper) => self.solve_uzawa(&problem, &lift, &b, &mut x, paper)?,
        };
        let pressure = problem.pressure(&x);
        let mut velocity = problem.velocity(&lift, &x);
        let twists = problem.twists(&velocity)?;
        velocity.truncate(problem.system.space.full_dim());
        self.keep_for_next(&problem, &x, &pressure, before);
        let end = (self.clock)();
        Ok(Flow {
            discretisation: problem.discretisation,
            velocity,
            pressure,
            multiplier: effort.multiplier,
            twists,
            solve_count: effort.solve_count,
            iteration_count: effort.iteration_count,
            fine_operator_applications: effort.fine_operator_applications,
            phases: [prepared_from - start, solved_from - prepared_from, end - solved_from],
        })
    }

    /// The nodes of a mesh: those of the last one, if it is the same.
    fn discretised(&mut self, mesh: TreeMesh<D>) -> Discretisation<D> {
        let kept = self.discretisation.take().filter(|last| *last.mesh == mesh);
        let discretisation = kept.unwrap_or_else(|| Discretisation::new(mesh));
        self.discretisation = Some(discretisation.clone());
        discretisation
    }

    fn solve_once(&mut self, problem: &Problem<D>, b: &[f64], x: &mut [f64]) -> Result<Effort, StokesError> {
        let mut effort = Effort::default();
        effort.add(self.solver.solve(&problem.system, b, x, self.params.tolerance)?);
        Ok(effort)
    }

    /// The augmented Lagrangian of the paper, from `lambda = 0`.
    fn solve_uzawa(
        &mut self,
        problem: &Problem<D>,
        lift: &[f64],
        base: &[f64],
        x: &mut [f64],
        paper: PaperParams,
    ) -> Result<Effort, StokesError> {
        let reference = vector::norm(base);
        let mut effort =
            Effort { multiplier: vec![0.0; problem.system.space.full_dim()], ..Effort::default() };
        for step in 0..paper.uzawa_steps {
            let mut b = base.to_vec();
            if step > 0 {
                subtract_multiplier(&problem.system, &effort.multiplier, &mut b);
            }
            let scale = reference / vector::norm(&b).max(f64::MIN_POSITIVE);
            let tolerance = self.params.tolerance * scale.min(1.0);
            effort.add(self.solver.solve(&problem.system, &b, x, tolerance)?);
            vector::axpy(paper.rho, &problem.velocity(lift, x), &mut effort.multiplier);
        }
        Ok(effort)
    }

    /// The deviations from the undisturbed flow that the next solve starts from, where the solver is iterative: the last
    /// one, and the one before on the same mesh.
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
        self.warm_start = Some(WarmStart::restore(mesh, last, before)?);
        Ok(())
    }

    /// What the solve starts from, and the last flow on its mesh; zero and nothing at the first step.
    fn initial_guess(
        &self,
        system: &StokesSystem<D>,
        discretisation: &Discretisation<D>,
    ) -> (Vec<f64>, Option<NodalFields>) {
        match &self.warm_start {
            Some(warm) if self.params.solver == SolverKind::Multigrid => {
                let (guess, last) = warm.moved(discretisation).into_guess(system);
                (guess, Some(last))
            }
            _ => (vec![0.0; system.dim()], None),
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
            let space = &problem.system.space;
            let mut velocity = x[..space.dim()].to_vec();
            space.expand(&mut velocity);
            velocity.truncate(space.full_dim());
            let last = NodalFields { velocity, pressure: pressure.to_vec() };
            let smooth = matches!(self.params.formulation, Formulation::Paper(_));
            let before = before.filter(|_| smooth);
            self.warm_start = Some(WarmStart::new(problem.discretisation.clone(), last, before));
        }
    }
}

/// `b -= int I eta_s eps(lambda):eps(v)`: half of `K(I eta_s) lambda`, which carries `2 eta_s`.
fn subtract_multiplier<const D: usize>(system: &StokesSystem<D>, multiplier: &[f64], b: &mut [f64])
where
    Dim<D>: Space<D>,
{
    if let Some(penalty) = &system.penalty {
        let mut load = vec![0.0; system.velocity_dim()];
        penalty.stress.apply(system.space.nodes(), multiplier, &mut load);
        system.space.reduce(&mut load);
        vector::axpy(-0.5, &load, &mut b[..system.velocity_dim()]);
    }
}

fn check(params: &FlowParams) -> Result<(), StokesError> {
    let wrong = |name, value, wanted| Err(StokesError::Parameter { name, value, wanted });
    check_viscosity(params.viscosity)?;
    if !(params.tolerance > 0.0 && params.tolerance < 1.0) {
        return wrong("tolerance", params.tolerance, "must lie between 0 and 1");
    }
    params.formulation.check()
}
